//! Commands that open, edit and save the task, and propose subgoals for it.

use super::arguments::{
    Argument, Index, Number, Optional, OptionalUnless, Or, Output, Parsed, Position, Properties, Text, Within,
    is_option,
};
use super::{Awaits, Edit, Execute, InScripts, Verb, syntax};
use crate::dry_run::DryRun;
use crate::setup::Setup;
use crate::{Session, SessionError};
use mge_base::atomic::{Format, Target};
use mge_task::Edit::*;
use mge_task::{self as task, Editor, STANDARD_RADIUS};

/// Maximum number of subgoals in one proposal.
const MAX_PROPOSALS: usize = 9;

/// Opens a shipped task or a task file.
#[derive(Debug, Clone, PartialEq)]
pub struct Task(pub String);

impl Execute for Task {
    syntax! { "task" "NAME|FILE" "open a shipped task or a task file" => Task { 0: Text("a task") }; }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.open_task(&self.0)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let report = session.change(|setup| self.prepare(setup))?;
        session.forget_results_of_task();
        Ok(report)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.open_task(&self.0)
    }
}

/// Searches for the random puzzle of a seed and opens it.
#[derive(Debug, Clone, PartialEq)]
pub struct Puzzle(pub u64);

impl Execute for Puzzle {
    syntax! {
        "puzzle" "SEED" "search for the random puzzle of a seed, and open it"
            => Puzzle { 0: Within("seed", 0..=u64::MAX) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.search_puzzle(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.task_unknown = true;
        Ok(())
    }

    /// Recorded when the puzzle is opened: only later commands can refer to it.
    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, awaits: Awaits::Result, ..InScripts::default() }
    }
}

/// Saves the edited task to the given file, by default the one it was loaded from.
#[derive(Debug, Clone, PartialEq)]
pub struct Save(pub Option<Target>);

impl Execute for Save {
    syntax! { "save" "[FILE [force]]" "save the edited task" => Save { 0: Optional(Output("a file")) }; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.setup.save_task(self.0.as_ref())
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(self.0.as_ref());
        Ok(())
    }

    fn output(&self) -> Option<(&Target, Format<'static>)> {
        self.0.as_ref().map(|to| (to, task::FORMAT))
    }

    fn output_mut(&mut self) -> Option<&mut Target> {
        self.0.as_mut()
    }
}

/// Undoes the latest edit.
#[derive(Debug, Clone, PartialEq)]
pub struct Undo;

impl Execute for Undo {
    syntax! { "undo" "" "undo the latest edit" => Undo {}; }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.step_history(Editor::undo, "undo", "the edit is undone")
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

/// Redoes the undone edit.
#[derive(Debug, Clone, PartialEq)]
pub struct Redo;

impl Execute for Redo {
    syntax! { "redo" "" "redo the undone edit" => Redo {}; }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.step_history(Editor::redo, "redo", "the edit is redone")
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

impl Execute for Edit {
    syntax! {
        "subgoal add" "X Y [RADIUS]" "add a subgoal after the others"
            => AddSubgoal { position: Position, radius: Or(Number("radius"), STANDARD_RADIUS) };
        "subgoal move" "N X Y" "move subgoal N (from 1) to normalised X Y"
            => MoveSubgoal { index: Index, position: Position };
        "subgoal size" "N RADIUS" "resize a subgoal, in units"
            => ResizeSubgoal { index: Index, radius: Number("radius") };
        "subgoal swap" "N M" "exchange two subgoals in the order"
            => SwapSubgoals { first: Index, second: Index };
        "subgoal delete" "N" "delete a subgoal" => DeleteSubgoal { index: Index };
        "goal move" "X Y" "move the goal" => MoveGoal { position: Position };
        "goal size" "RADIUS" "resize the goal, in units" => ResizeGoal { radius: Number("radius") };
        "ball move" "X Y" "move the ball's start" => MoveBall { position: Position };
        "tool add" "TYPE X Y [SIZE] [KEY=VALUE]..." "add a static tool, such as `tool add ramp 0 0 20 angle=45`"
            => AddTool {
                kind: Parsed("a type"), position: Position, size: OptionalUnless(Number("size"), is_option),
                values: Properties(0)
            };
        "tool move" "N X Y" "move a static tool (from 1)" => MoveTool { index: Index, position: Position };
        "tool size" "N SIZE" "resize a static tool, in units"
            => ResizeTool { index: Index, size: Number("size") };
        "tool set" "N KEY=VALUE..." "change properties of a static tool: size, angle (degrees), force, ..."
            => SetTool { index: Index, values: Properties(1) };
        "tool delete" "N" "delete a static tool" => DeleteTool { index: Index };
        "placeable" "TYPE [SIZE] [KEY=VALUE]..." "give the agent another tool to place"
            => SetPlaceable {
                kind: Parsed("a type"), size: OptionalUnless(Number("size"), is_option), values: Properties(0)
            };
        "part move" "PART X Y" "move another part: marker, ball-N, box-N or marker-subgoal-N"
            => MovePart { part: Parsed("a part"), position: Position };
        "proposal move" "N X Y" "move proposed subgoal N (from 1)"
            => MoveProposal { index: Index, position: Position };
        "proposal size" "N RADIUS" "resize a proposed subgoal, in units"
            => ResizeProposal { index: Index, radius: Number("radius") };
        "proposal accept" "[N]" "accept one proposed subgoal, or all in place of the task's own"
            => AcceptProposal { index: Optional(Index) };
        "proposal delete" "[N]" "reject one proposed subgoal, or all of them"
            => DeleteProposal { index: Optional(Index) };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.edit(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

/// Proposes subgoals by model rollouts: the given number, by default as many as the task has.
#[derive(Debug, Clone, PartialEq)]
pub struct Propose(pub Option<usize>);

impl Execute for Propose {
    syntax! {
        "propose" "[N]" "let the model propose subgoals, N or as many as the task has"
            => Propose { 0: Optional(Within("number of subgoals", 1..=MAX_PROPOSALS)) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.propose(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.proposed = true;
        Ok(())
    }

    /// Recorded when the proposals arrive: only later commands can refer to them.
    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, awaits: Awaits::Work, ..InScripts::default() }
    }
}
