//! From a command to the line that is read back as it.

use std::fmt;
use std::path::PathBuf;

use super::{Command, Expectation};
use crate::task::Edit;

impl fmt::Display for Command {
    /// The line that is read back as this command.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quote = |text: &str| shell_words::quote(text).into_owned();
        let path = |path: &PathBuf| quote(&path.display().to_string());
        let optional = |value: &Option<PathBuf>| value.as_ref().map(|p| format!(" {}", path(p))).unwrap_or_default();
        let until = |value: &Option<u32>| value.map(|n| format!(" until {n}")).unwrap_or_default();
        match self {
            Self::Task(name) => write!(f, "task {}", quote(name)),
            Self::Save(file) => write!(f, "save{}", optional(file)),
            Self::Undo => f.write_str("undo"),
            Self::Redo => f.write_str("redo"),
            Self::Edit(edit) => write_edit(edit, f),
            Self::Propose(count) => {
                write!(f, "propose{}", count.map(|count| format!(" {count}")).unwrap_or_default())
            }
            Self::Seed(seed) => write!(f, "seed {seed}"),
            Self::Method(method) => write!(f, "method {method}"),
            Self::Episodes(episodes) => write!(f, "episodes {episodes}"),
            Self::Epsilon(schedule) => write!(f, "epsilon {schedule}"),
            Self::Set { key, value } => write!(f, "set {} {}", quote(key), quote(value)),
            Self::Model(source) => write!(f, "model {}", quote(&String::from(source.clone()))),
            Self::ModelTrain { tools, path: file, epochs } => {
                let tools = tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
                let epochs = epochs.map(|epochs| format!(" {epochs}")).unwrap_or_default();
                write!(f, "model train {tools} {}{epochs}", path(file))
            }
            Self::ModelStop => f.write_str("model stop"),
            Self::ModelEvaluate(model) => write!(f, "model evaluate {}", quote(model)),
            Self::Clusters(file) => write!(f, "clusters{}", optional(file)),
            Self::Guide => f.write_str("guide"),
            Self::Out(folder) => write!(f, "out {}", path(folder)),
            Self::Train { folder, until: at } => write!(f, "train{}{}", optional(folder), until(at)),
            Self::Pause => f.write_str("pause"),
            Self::Resume { until: at } => write!(f, "resume{}", until(at)),
            Self::Stop => f.write_str("stop"),
            Self::Wait => f.write_str("wait"),
            Self::Open(folder) => write!(f, "open {}", path(folder)),
            Self::Watch(number) => write!(f, "watch {}", number + 1),
            Self::Delete(folder) => write!(f, "delete {}", path(folder)),
            Self::Continue(folder) => write!(f, "continue{}", optional(folder)),
            Self::Evaluate => f.write_str("evaluate"),
            Self::Place([x, y]) => write!(f, "place {x} {y}"),
            Self::Reset => f.write_str("reset"),
            Self::Figure { kind, path: file, dpi } => {
                let dpi = dpi.map(|dpi| format!(" {dpi}")).unwrap_or_default();
                write!(f, "figure {} {}{dpi}", kind.name(), path(file))
            }
            Self::Expect(Expectation { quantity, comparison, value }) => {
                write!(f, "expect {} {} {value}", quantity.name(), comparison.sign())
            }
            Self::Record(file) => write!(f, "record {}", path(file)),
            Self::Quit => f.write_str("quit"),
        }
    }
}

fn write_edit(edit: &Edit, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let number = |index: Option<usize>| index.map(|index| format!(" {}", index + 1)).unwrap_or_default();
    match *edit {
        Edit::AddSubgoal { position: [x, y], radius } => write!(f, "subgoal add {x} {y} {radius}"),
        Edit::MoveSubgoal { index, position: [x, y] } => write!(f, "subgoal move {} {x} {y}", index + 1),
        Edit::ResizeSubgoal { index, radius } => write!(f, "subgoal size {} {radius}", index + 1),
        Edit::SwapSubgoals { first, second } => write!(f, "subgoal swap {} {}", first + 1, second + 1),
        Edit::DeleteSubgoal { index } => write!(f, "subgoal delete {}", index + 1),
        Edit::MoveGoal { position: [x, y] } => write!(f, "goal move {x} {y}"),
        Edit::ResizeGoal { radius } => write!(f, "goal size {radius}"),
        Edit::MoveBall { position: [x, y] } => write!(f, "ball move {x} {y}"),
        Edit::AddTool { kind, position: [x, y], size } => {
            write!(f, "tool add {kind} {x} {y}{}", size.map(|size| format!(" {size}")).unwrap_or_default())
        }
        Edit::MoveTool { index, position: [x, y] } => write!(f, "tool move {} {x} {y}", index + 1),
        Edit::ResizeTool { index, size } => write!(f, "tool size {} {size}", index + 1),
        Edit::DeleteTool { index } => write!(f, "tool delete {}", index + 1),
        Edit::MoveProposal { index, position: [x, y] } => write!(f, "proposal move {} {x} {y}", index + 1),
        Edit::ResizeProposal { index, radius } => write!(f, "proposal size {} {radius}", index + 1),
        Edit::AcceptProposal { index } => write!(f, "proposal accept{}", number(index)),
        Edit::DeleteProposal { index } => write!(f, "proposal delete{}", number(index)),
    }
}
