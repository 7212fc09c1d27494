//! Commands that open, edit and save the task, and propose subgoals for it.

use super::arguments::{
    Argument, Index, Named, Number, Optional, Output, Parsed, Position, Properties, Text, Within, Words, is_option,
    optional,
};
use super::{Command, Edit, Execute, ScriptRole, Verb, WaitFor, command};
use crate::setup::Setup;
use crate::{Session, SessionError};
use mge_base::atomic::Target;
use mge_task::Edit::*;
use mge_task::{self as task, Editor, Object, Part};

/// Maximum number of subgoals in one proposal.
const MAX_PROPOSALS: usize = 9;

command! {
    /// Opens a shipped task or a task file.
    Task(name: String = Text("a task")): "task" "NAME|FILE" "open a shipped task or a task file";
    prepare = |this, setup| setup.open_task(&this.0);
    execute = |this, session| {
        let report = session.change(|setup| this.prepare(setup))?;
        // Those of one task are meaningless for another.
        session.forget_clusters();
        session.cancel_jobs(Command::is_propose);
        Ok(report)
    };
}

command! {
    /// Saves the edited task to the given file, by default the one it was loaded from.
    Save(to: Option<Target> = optional(Output(task::FORMAT))): "save" "[FILE [force]]" "save the edited task";
    execute = |this, session| session.setup.save_task(this.0.as_ref());
}

command! {
    /// Undoes the latest edit.
    Undo: "undo" "" "undo the latest edit";
    prepare = |_, setup| {
        let no_edit = "undo: `undo` reverts edits of the task, `restore` brings back a deleted run";
        setup.step_history(Editor::undo, no_edit, "the edit is undone")
    };
}

command! {
    /// Redoes the undone edit.
    Redo: "redo" "" "redo the undone edit";
    prepare = |_, setup| setup.step_history(Editor::redo, "redo: only edits of the task are done again", "the edit is redone");
}

/// Implements `verbs` and `line` of `Execute` for the variants of `Edit`, each with its verb, the arguments as shown in
/// usage and help, the help line, and the kind of each argument.
macro_rules! edits {
    ($($name:literal $arguments:literal $help:literal
        => ($($form:tt)+) { $($field:ident: $kind:expr),* $(,)? };)+) => {
        fn verbs() -> Vec<Verb> {
            vec![$(Verb {
                name: $name,
                arguments: $arguments,
                help: $help,
                read: |words| {
                    $(let $field = $kind.read(words)?;)*
                    Ok(($($form)+).into())
                },
            }),+]
        }

        fn line(&self) -> String {
            match self {
                $($($form)+ => [$name.to_owned(), $($kind.write($field)),*].concat()),+
            }
        }
    };
}

impl Execute for Edit {
    edits! {
        "subgoal add" "X Y [RADIUS]" "add a subgoal after the others"
            => (AddSubgoal { position, radius }) { position: Position, radius: optional(Number("radius")) };
        "subgoal move" "N X Y" "move subgoal N (from 1) to normalised X Y"
            => (Move { object: Object::Part(Part::Subgoal(index)), position }) { index: Index, position: Position };
        "subgoal size" "N RADIUS" "resize a subgoal, in units"
            => (ResizeSubgoal { index, radius }) { index: Index, radius: Number("radius") };
        "subgoal swap" "N M" "exchange two subgoals in the order"
            => (SwapSubgoals { first, second }) { first: Index, second: Index };
        "subgoal delete" "N" "delete a subgoal" => (DeleteSubgoal { index }) { index: Index };
        "goal move" "X Y" "move the goal" => (Move { object: Object::Part(Part::Goal), position }) { position: Position };
        "goal size" "RADIUS" "resize the goal, in units" => (ResizeGoal { radius }) { radius: Number("radius") };
        "ball move" "X Y" "move the ball's start"
            => (Move { object: Object::Part(Part::Target), position }) { position: Position };
        "tool add" "TYPE X Y [SIZE] [KEY=VALUE]..." "add a static tool, such as `tool add ramp 0 0 20 angle=45`"
            => (AddTool { kind, position, size, values }) {
                kind: Parsed("a type"), position: Position, size: Optional(Number("size"), is_option),
                values: Properties(0)
            };
        "tool move" "N X Y" "move a static tool (from 1)"
            => (Move { object: Object::Part(Part::Tool(index)), position }) { index: Index, position: Position };
        "tool size" "N SIZE" "resize a static tool, in units"
            => (ResizeTool { index, size }) { index: Index, size: Number("size") };
        "tool set" "N KEY=VALUE..." "change properties of a static tool: size, angle (degrees), force, ..."
            => (SetTool { index, values }) { index: Index, values: Properties(1) };
        "tool delete" "N" "delete a static tool" => (DeleteTool { index }) { index: Index };
        "placeable" "TYPE [SIZE] [KEY=VALUE]..." "give the agent another tool to place"
            => (SetPlaceable { kind, size, values }) {
                kind: Parsed("a type"), size: Optional(Number("size"), is_option), values: Properties(0)
            };
        "part move" "PART X Y" "move another part: marker, ball-N, box-N or marker-subgoal-N"
            => (Move { object: Object::Part(part), position }) { part: Parsed("a part"), position: Position };
        "proposal move" "N X Y" "move proposed subgoal N (from 1)"
            => (Move { object: Object::Proposal(index), position }) { index: Index, position: Position };
        "proposal size" "N RADIUS" "resize a proposed subgoal, in units"
            => (ResizeProposal { index, radius }) { index: Index, radius: Number("radius") };
        "proposal accept" "[N]" "accept one proposed subgoal, or all in place of the task's own"
            => (AcceptProposal { index }) { index: optional(Index) };
        "proposal delete" "[N]" "reject one proposed subgoal, or all of them"
            => (DeleteProposal { index }) { index: optional(Index) };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.edit(self)
    }
}

command! {
    /// Proposes subgoals by model rollouts: the given number, by default as many as the task has.
    Propose(count: Option<usize> = optional(Within("number of subgoals", 1..=MAX_PROPOSALS))):
        "propose" "[N]" "let the model propose subgoals, N or as many as the task has";
    execute = |this, session| session.propose(this);
    // Recorded when the proposals arrive: only later commands can refer to them.
    script_role = |_| ScriptRole { unrecorded: true, awaits: WaitFor::Work, ..ScriptRole::default() };
}
