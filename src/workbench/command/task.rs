//! The task: opened, edited, saved, and subgoals proposed for it.

use std::path::{Path, PathBuf};

use super::arguments::{optional, quoted, quoted_path};
use super::{Edit, Execute, Recording, Verb};
use crate::physics::ToolKind;
use crate::task::Editor;
use crate::workbench::dry_run::DryRun;
use crate::workbench::setup::Setup;
use crate::workbench::{Session, SessionError};

/// Most subgoals that are looked for at once.
const MOST_PROPOSALS: usize = 9;
/// Radius of a subgoal that is added without one, in units.
const SUBGOAL_RADIUS: f32 = 4.0;

/// Opens a shipped task or a task file.
#[derive(Debug, Clone, PartialEq)]
pub struct Task(pub String);

impl Execute for Task {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("task", "NAME|FILE", "open a shipped task or a task file", |args| {
            Ok(Self(args.word("a task")?.to_owned()).into())
        })]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted(&self.0))
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.open_task(&self.0)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let report = session.change(|setup| self.prepare(setup))?;
        session.forget_clusters();
        session.forget_proposals();
        Ok(report)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.open_task(self)
    }
}

/// Saves the edited task, in the file it came from unless another is named.
#[derive(Debug, Clone, PartialEq)]
pub struct Save(pub Option<PathBuf>);

impl Execute for Save {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("save", "[FILE]", "save the edited task", |args| Ok(Self(args.optional_path()).into()))]
    }

    fn arguments(&self) -> String {
        optional(self.0.as_deref().map(quoted_path))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.change(|setup| setup.save_task(self.0.as_deref()))
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(self.0.as_deref());
        Ok(())
    }

    fn overwrites(&self) -> Option<&Path> {
        self.0.as_deref()
    }
}

/// Takes the latest edit back.
#[derive(Debug, Clone, PartialEq)]
pub struct Undo;

impl Execute for Undo {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("undo", "", "take the latest edit back", |_| Ok(Self.into()))]
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.step_history(Editor::undo, "undo", "the edit is taken back")
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

/// Makes the undone edit again.
#[derive(Debug, Clone, PartialEq)]
pub struct Redo;

impl Execute for Redo {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("redo", "", "make the undone edit again", |_| Ok(Self.into()))]
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.step_history(Editor::redo, "redo", "the edit is made again")
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

impl Execute for Edit {
    fn verbs() -> Vec<Verb> {
        vec![
            Verb::new("subgoal add", "X Y [RADIUS]", "add a subgoal after the others", |args| {
                let position = args.position()?;
                let radius = args.optional_number("radius")?.unwrap_or(SUBGOAL_RADIUS);
                Ok(Self::AddSubgoal { position, radius }.into())
            }),
            Verb::new("subgoal move", "N X Y", "move subgoal N (from 1) to normalised X Y", |args| {
                Ok(Self::MoveSubgoal { index: args.index()?, position: args.position()? }.into())
            }),
            Verb::new("subgoal size", "N RADIUS", "resize a subgoal, in units", |args| {
                Ok(Self::ResizeSubgoal { index: args.index()?, radius: args.number("radius")? }.into())
            }),
            Verb::new("subgoal swap", "N M", "exchange two subgoals in the order", |args| {
                Ok(Self::SwapSubgoals { first: args.index()?, second: args.index()? }.into())
            }),
            Verb::new("subgoal delete", "N", "delete a subgoal", |args| {
                Ok(Self::DeleteSubgoal { index: args.index()? }.into())
            }),
            Verb::new("goal move", "X Y", "move the goal", |args| {
                Ok(Self::MoveGoal { position: args.position()? }.into())
            }),
            Verb::new("goal size", "RADIUS", "resize the goal, in units", |args| {
                Ok(Self::ResizeGoal { radius: args.number("radius")? }.into())
            }),
            Verb::new("ball move", "X Y", "move the ball's start", |args| {
                Ok(Self::MoveBall { position: args.position()? }.into())
            }),
            Verb::new("tool add", "TYPE X Y [SIZE]", "add a static tool: bucket, square, box, wall or floor", |args| {
                let kind = args.word("a type")?.parse::<ToolKind>()?;
                let (position, size) = (args.position()?, args.optional_number("size")?);
                Ok(Self::AddTool { kind, position, size }.into())
            }),
            Verb::new("tool move", "N X Y", "move a static tool (from 1)", |args| {
                Ok(Self::MoveTool { index: args.index()?, position: args.position()? }.into())
            }),
            Verb::new("tool size", "N SIZE", "resize a static tool, in units", |args| {
                Ok(Self::ResizeTool { index: args.index()?, size: args.number("size")? }.into())
            }),
            Verb::new("tool delete", "N", "delete a static tool", |args| {
                Ok(Self::DeleteTool { index: args.index()? }.into())
            }),
            Verb::new("proposal move", "N X Y", "move proposed subgoal N (from 1)", |args| {
                Ok(Self::MoveProposal { index: args.index()?, position: args.position()? }.into())
            }),
            Verb::new("proposal size", "N RADIUS", "resize a proposed subgoal, in units", |args| {
                Ok(Self::ResizeProposal { index: args.index()?, radius: args.number("radius")? }.into())
            }),
            Verb::new(
                "proposal accept",
                "[N]",
                "accept one proposed subgoal, or all in place of the task's own",
                |args| Ok(Self::AcceptProposal { index: args.optional_index()? }.into()),
            ),
            Verb::new("proposal delete", "[N]", "reject one proposed subgoal, or all of them", |args| {
                Ok(Self::DeleteProposal { index: args.optional_index()? }.into())
            }),
        ]
    }

    fn line(&self) -> Option<String> {
        let number = |index: Option<usize>| optional(index.map(|index| index + 1));
        Some(match *self {
            Self::AddSubgoal { position: [x, y], radius } => format!("subgoal add {x} {y} {radius}"),
            Self::MoveSubgoal { index, position: [x, y] } => format!("subgoal move {} {x} {y}", index + 1),
            Self::ResizeSubgoal { index, radius } => format!("subgoal size {} {radius}", index + 1),
            Self::SwapSubgoals { first, second } => format!("subgoal swap {} {}", first + 1, second + 1),
            Self::DeleteSubgoal { index } => format!("subgoal delete {}", index + 1),
            Self::MoveGoal { position: [x, y] } => format!("goal move {x} {y}"),
            Self::ResizeGoal { radius } => format!("goal size {radius}"),
            Self::MoveBall { position: [x, y] } => format!("ball move {x} {y}"),
            Self::AddTool { kind, position: [x, y], size } => format!("tool add {kind} {x} {y}{}", optional(size)),
            Self::MoveTool { index, position: [x, y] } => format!("tool move {} {x} {y}", index + 1),
            Self::ResizeTool { index, size } => format!("tool size {} {size}", index + 1),
            Self::DeleteTool { index } => format!("tool delete {}", index + 1),
            Self::MoveProposal { index, position: [x, y] } => format!("proposal move {} {x} {y}", index + 1),
            Self::ResizeProposal { index, radius } => format!("proposal size {} {radius}", index + 1),
            Self::AcceptProposal { index } => format!("proposal accept{}", number(index)),
            Self::DeleteProposal { index } => format!("proposal delete{}", number(index)),
        })
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.edit(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

/// Lets the model propose subgoals, so many or as many as the task has.
#[derive(Debug, Clone, PartialEq)]
pub struct Propose(pub Option<usize>);

impl Execute for Propose {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("propose", "[N]", "let the model propose subgoals, N or as many as the task has", |args| {
            match args.optional_number("number of subgoals")? {
                Some(count) if !(1..=MOST_PROPOSALS).contains(&count) => {
                    Err(format!("`{count}` is not a number of subgoals from 1 to {MOST_PROPOSALS}"))
                }
                count => Ok(Self(count).into()),
            }
        })]
    }

    fn arguments(&self) -> String {
        optional(self.0)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.propose(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.propose();
        Ok(())
    }

    /// The proposals belong where they arrived: what was done before cannot refer to them.
    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }

    fn begins_work(&self) -> bool {
        true
    }
}
