//! The command language: one command, one line.

mod read;
mod verbs;
mod write;

pub use verbs::{Verb, verbs};

use std::path::PathBuf;

use crate::guidance::EpsilonSchedule;
use crate::physics::ToolKind;
use crate::task::Edit;
use crate::trainer::{Method, PriorSource};

/// Something a person can do.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Load a shipped task or a task file.
    Task(String),
    /// Save the edited task.
    Save(Option<PathBuf>),
    /// Take the latest edit back.
    Undo,
    /// Make the undone edit again.
    Redo,
    /// Change the task.
    Edit(Edit),
    /// Let the model propose subgoals.
    Propose(Option<usize>),
    /// Set the master seed.
    Seed(u64),
    /// Choose the algorithm.
    Method(Method),
    /// Set the number of training episodes.
    Episodes(u32),
    /// Set the epsilon threshold.
    Epsilon(EpsilonSchedule),
    /// Set any setting of the run by its JSON path.
    Set { key: String, value: String },
    /// Choose what predicts the rollouts.
    Model(PriorSource),
    /// Train a dynamics model in the background.
    ModelTrain { tools: Vec<ToolKind>, path: PathBuf, epochs: Option<u32> },
    /// End what is being done about a dynamics model.
    ModelStop,
    /// Measure a dynamics model in the background.
    ModelEvaluate(String),
    /// Compute the action clusters anew.
    Clusters(Option<PathBuf>),
    /// Give the action clusters to the running training.
    Guide,
    /// Choose the folder for runs.
    Out(PathBuf),
    /// Start a run.
    Train { folder: Option<PathBuf>, until: Option<u32> },
    /// Pause the run.
    Pause,
    /// Go on with the paused run.
    Resume { until: Option<u32> },
    /// End the run.
    Stop,
    /// Wait for the run or the clusters.
    Wait,
    /// Open a run that is on disk.
    Open(PathBuf),
    /// Act on another run of the session, numbered from 0.
    Watch(usize),
    /// Delete a run from the disk.
    Delete(PathBuf),
    /// Go on with a run from its checkpoint.
    Continue(Option<PathBuf>),
    /// Play the greedy policy of the run.
    Evaluate,
    /// Hand play: place the tool.
    Place([f32; 2]),
    /// Hand play: start again.
    Reset,
    /// Export a figure.
    Figure { kind: FigureKind, path: PathBuf, dpi: Option<u32> },
    /// Fail unless it holds.
    Expect(Expectation),
    /// Save the session so far as a script.
    Record(PathBuf),
    /// Leave.
    Quit,
}

/// A figure of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureKind {
    /// The task's scene.
    Scene,
    /// The action clusters over the scene.
    Clusters,
    /// Rolling success of the session's runs.
    Learning,
    /// Everything logged of the current run.
    Dashboard,
    /// The latest episode, animated.
    Episode,
}

impl FigureKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Scene, Self::Clusters, Self::Learning, Self::Dashboard, Self::Episode];

    /// The name in the language.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Clusters => "clusters",
            Self::Learning => "learning",
            Self::Dashboard => "dashboard",
            Self::Episode => "episode",
        }
    }
}

/// What `expect` can look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Episodes the current run has finished.
    Episodes,
    /// Rolling success of the current run, 0 to 1.
    Success,
    /// Success of the latest greedy evaluation, 0 to 1.
    Greedy,
    /// Action clusters over all stages.
    Clusters,
    /// Subgoals of the task.
    Subgoals,
    /// Proposed subgoals that were neither accepted nor rejected.
    Proposals,
}

impl Quantity {
    const ALL: [Self; 6] =
        [Self::Episodes, Self::Success, Self::Greedy, Self::Clusters, Self::Subgoals, Self::Proposals];

    /// The name in the language.
    pub fn name(self) -> &'static str {
        match self {
            Self::Episodes => "episodes",
            Self::Success => "success",
            Self::Greedy => "greedy",
            Self::Clusters => "clusters",
            Self::Subgoals => "subgoals",
            Self::Proposals => "proposals",
        }
    }
}

/// A comparison that must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The quantity.
    pub quantity: Quantity,
    /// How it is compared.
    pub comparison: Comparison,
    /// With what.
    pub value: f64,
}

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `=`
    Equal,
    /// `>=`
    AtLeast,
    /// `<=`
    AtMost,
}

impl Comparison {
    const ALL: [Self; 3] = [Self::Equal, Self::AtLeast, Self::AtMost];

    /// The sign in the language.
    pub fn sign(self) -> &'static str {
        match self {
            Self::Equal => "=",
            Self::AtLeast => ">=",
            Self::AtMost => "<=",
        }
    }

    /// Whether it holds.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::Equal => left == right,
            Self::AtLeast => left >= right,
            Self::AtMost => left <= right,
        }
    }
}

/// A line that is no command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// No verb of the language.
    #[error("unknown command `{word}`{}", suggestion(nearest))]
    Unknown { word: String, nearest: Option<String> },
    /// The verb takes other arguments.
    #[error("{problem}; usage: {usage}")]
    Usage { problem: String, usage: String },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::read::find_verb;
    use super::*;

    /// One line for every verb.
    const LINES: &[&str] = &[
        "task task1",
        "save 'my tasks/new.json'",
        "undo",
        "redo",
        "subgoal add 0.1 -0.2 5",
        "subgoal move 1 0.5 0.25",
        "subgoal size 2 3.5",
        "subgoal swap 1 2",
        "subgoal delete 1",
        "goal move -0.5 0",
        "goal size 6",
        "ball move 0 0.9",
        "tool add wall 0.5 0.5 30",
        "tool move 1 0 0",
        "tool size 1 9",
        "tool delete 1",
        "propose 2",
        "proposal accept 1",
        "proposal delete",
        "proposal move 2 0.5 -0.25",
        "proposal size 1 3.5",
        "seed 7",
        "method ddpg",
        "episodes 300",
        "epsilon linear:0.5:0:1000",
        "set ddpg.gamma 0.9",
        "model true",
        "model train bucket,box models/mine.safetensors 500",
        "model evaluate bucket-box",
        "model stop",
        "clusters",
        "guide",
        "out runs",
        "train runs/a until 100",
        "pause",
        "resume until 200",
        "stop",
        "wait",
        "open runs/a",
        "watch 2",
        "delete runs/a",
        "continue runs/a",
        "evaluate",
        "place 0.25 -0.5",
        "reset",
        "figure learning curves.png",
        "expect success >= 0.5",
        "record session.mge",
        "quit",
    ];

    #[test]
    fn every_verb_reads_and_writes_the_same_line() {
        for verb in verbs() {
            let line = LINES.iter().find(|line| find_verb(&shell_words::split(line).unwrap()).unwrap().0 == verb);
            let line = line.unwrap_or_else(|| panic!("no line for {}", verb.name));
            let command = Command::parse(line).unwrap().unwrap();
            assert_eq!(&command.to_string(), line);
        }
    }

    #[test]
    fn comments_and_empty_lines_are_nothing() {
        assert_eq!(Command::parse("  # a comment"), Ok(None));
        assert_eq!(Command::parse(""), Ok(None));
    }

    #[test]
    fn mistakes_are_explained() {
        for (line, expected) in [
            ("trian", "did you mean `train`?"),
            ("subgoal mvoe 1 0 0", "did you mean `subgoal move`?"),
            ("subgoal move 0 0 0", "numbers count from 1"),
            ("subgoal move 1 0", "coordinate is missing; usage: subgoal move N X Y"),
            ("propose 0", "`0` is not a number of subgoals from 1 to 9"),
            ("proposal accept 0", "numbers count from 1"),
            ("seed x", "`x` is not a seed"),
            ("epsilon 2", "not within 0 and 1"),
            ("figure pie a.png", "`pie` is not one of scene, clusters"),
            ("undo now", "`now` was not expected"),
            ("task 'a", "a quote is not closed"),
        ] {
            let error = Command::parse(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
