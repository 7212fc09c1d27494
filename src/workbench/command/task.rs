//! The task: opened, edited, saved, and subgoals proposed for it.

use std::fmt;
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
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "task",
            arguments: "NAME|FILE",
            help: "open a shipped task or a task file",
            read: |args| Ok(Self(args.word("a task")?.to_owned()).into()),
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "task {}", quoted(&self.0))
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.open_task(&self.0)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let report = session.change(|setup| self.prepare(setup))?;
        session.forget_task();
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
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "save",
            arguments: "[FILE]",
            help: "save the edited task",
            read: |args| Ok(Self(args.optional_path()).into()),
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "save{}", optional(self.0.as_deref().map(quoted_path)))
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
    fn verbs() -> &'static [Verb] {
        &[Verb { name: "undo", arguments: "", help: "take the latest edit back", read: |_| Ok(Self.into()) }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("undo")
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
    fn verbs() -> &'static [Verb] {
        &[Verb { name: "redo", arguments: "", help: "make the undone edit again", read: |_| Ok(Self.into()) }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("redo")
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.step_history(Editor::redo, "redo", "the edit is made again")
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.edit(|setup| self.prepare(setup))
    }
}

impl Execute for Edit {
    #[expect(clippy::too_many_lines, reason = "a table")]
    fn verbs() -> &'static [Verb] {
        &[
            Verb {
                name: "subgoal add",
                arguments: "X Y [RADIUS]",
                help: "add a subgoal after the others",
                read: |args| {
                    let position = args.position()?;
                    let radius = args.optional_number("radius")?.unwrap_or(SUBGOAL_RADIUS);
                    Ok(Self::AddSubgoal { position, radius }.into())
                },
            },
            Verb {
                name: "subgoal move",
                arguments: "N X Y",
                help: "move subgoal N (from 1) to normalised X Y",
                read: |args| Ok(Self::MoveSubgoal { index: args.index()?, position: args.position()? }.into()),
            },
            Verb {
                name: "subgoal size",
                arguments: "N RADIUS",
                help: "resize a subgoal, in units",
                read: |args| Ok(Self::ResizeSubgoal { index: args.index()?, radius: args.number("radius")? }.into()),
            },
            Verb {
                name: "subgoal swap",
                arguments: "N M",
                help: "exchange two subgoals in the order",
                read: |args| Ok(Self::SwapSubgoals { first: args.index()?, second: args.index()? }.into()),
            },
            Verb {
                name: "subgoal delete",
                arguments: "N",
                help: "delete a subgoal",
                read: |args| Ok(Self::DeleteSubgoal { index: args.index()? }.into()),
            },
            Verb {
                name: "goal move",
                arguments: "X Y",
                help: "move the goal",
                read: |args| Ok(Self::MoveGoal { position: args.position()? }.into()),
            },
            Verb {
                name: "goal size",
                arguments: "RADIUS",
                help: "resize the goal, in units",
                read: |args| Ok(Self::ResizeGoal { radius: args.number("radius")? }.into()),
            },
            Verb {
                name: "ball move",
                arguments: "X Y",
                help: "move the ball's start",
                read: |args| Ok(Self::MoveBall { position: args.position()? }.into()),
            },
            Verb {
                name: "tool add",
                arguments: "TYPE X Y [SIZE]",
                help: "add a static tool: bucket, square, box, wall or floor",
                read: |args| {
                    let kind = args.word("a type")?.parse::<ToolKind>()?;
                    let (position, size) = (args.position()?, args.optional_number("size")?);
                    Ok(Self::AddTool { kind, position, size }.into())
                },
            },
            Verb {
                name: "tool move",
                arguments: "N X Y",
                help: "move a static tool (from 1)",
                read: |args| Ok(Self::MoveTool { index: args.index()?, position: args.position()? }.into()),
            },
            Verb {
                name: "tool size",
                arguments: "N SIZE",
                help: "resize a static tool, in units",
                read: |args| Ok(Self::ResizeTool { index: args.index()?, size: args.number("size")? }.into()),
            },
            Verb {
                name: "tool delete",
                arguments: "N",
                help: "delete a static tool",
                read: |args| Ok(Self::DeleteTool { index: args.index()? }.into()),
            },
            Verb {
                name: "proposal move",
                arguments: "N X Y",
                help: "move proposed subgoal N (from 1)",
                read: |args| Ok(Self::MoveProposal { index: args.index()?, position: args.position()? }.into()),
            },
            Verb {
                name: "proposal size",
                arguments: "N RADIUS",
                help: "resize a proposed subgoal, in units",
                read: |args| Ok(Self::ResizeProposal { index: args.index()?, radius: args.number("radius")? }.into()),
            },
            Verb {
                name: "proposal accept",
                arguments: "[N]",
                help: "accept one proposed subgoal, or all in place of the task's own",
                read: |args| Ok(Self::AcceptProposal { index: args.optional_index()? }.into()),
            },
            Verb {
                name: "proposal delete",
                arguments: "[N]",
                help: "reject one proposed subgoal, or all of them",
                read: |args| Ok(Self::DeleteProposal { index: args.optional_index()? }.into()),
            },
        ]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |index: Option<usize>| optional(index.map(|index| index + 1));
        match *self {
            Self::AddSubgoal { position: [x, y], radius } => write!(f, "subgoal add {x} {y} {radius}"),
            Self::MoveSubgoal { index, position: [x, y] } => write!(f, "subgoal move {} {x} {y}", index + 1),
            Self::ResizeSubgoal { index, radius } => write!(f, "subgoal size {} {radius}", index + 1),
            Self::SwapSubgoals { first, second } => write!(f, "subgoal swap {} {}", first + 1, second + 1),
            Self::DeleteSubgoal { index } => write!(f, "subgoal delete {}", index + 1),
            Self::MoveGoal { position: [x, y] } => write!(f, "goal move {x} {y}"),
            Self::ResizeGoal { radius } => write!(f, "goal size {radius}"),
            Self::MoveBall { position: [x, y] } => write!(f, "ball move {x} {y}"),
            Self::AddTool { kind, position: [x, y], size } => write!(f, "tool add {kind} {x} {y}{}", optional(size)),
            Self::MoveTool { index, position: [x, y] } => write!(f, "tool move {} {x} {y}", index + 1),
            Self::ResizeTool { index, size } => write!(f, "tool size {} {size}", index + 1),
            Self::DeleteTool { index } => write!(f, "tool delete {}", index + 1),
            Self::MoveProposal { index, position: [x, y] } => write!(f, "proposal move {} {x} {y}", index + 1),
            Self::ResizeProposal { index, radius } => write!(f, "proposal size {} {radius}", index + 1),
            Self::AcceptProposal { index } => write!(f, "proposal accept{}", number(index)),
            Self::DeleteProposal { index } => write!(f, "proposal delete{}", number(index)),
        }
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
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "propose",
            arguments: "[N]",
            help: "let the model propose subgoals, N or as many as the task has",
            read: |args| match args.optional_number("number of subgoals")? {
                Some(count) if !(1..=MOST_PROPOSALS).contains(&count) => {
                    Err(format!("`{count}` is not a number of subgoals from 1 to {MOST_PROPOSALS}"))
                }
                count => Ok(Self(count).into()),
            },
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "propose{}", optional(self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.propose(self.0)
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
