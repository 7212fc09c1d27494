//! The command language: one command, one line.

mod read;
mod write;

use std::path::PathBuf;

use crate::guidance::EpsilonSchedule;
use crate::physics::ToolKind;
use crate::task::Edit;
use crate::trainer::{Method, PriorSource};

/// A verb of the language, for help, completion and the manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verb {
    /// The words it begins with.
    pub name: &'static str,
    /// What follows them.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
}

/// Every verb there is.
pub const VERBS: &[Verb] = &[
    verb("task", "NAME|FILE", "load a shipped task or a task file"),
    verb("save", "[FILE]", "save the edited task"),
    verb("undo", "", "take the latest edit back"),
    verb("redo", "", "make the undone edit again"),
    verb("subgoal add", "X Y [RADIUS]", "append a subgoal"),
    verb("subgoal move", "N X Y", "move subgoal N (from 1) to normalised X Y"),
    verb("subgoal size", "N RADIUS", "resize a subgoal, in units"),
    verb("subgoal swap", "N M", "exchange two subgoals in the order"),
    verb("subgoal delete", "N", "delete a subgoal"),
    verb("goal move", "X Y", "move the goal"),
    verb("goal size", "RADIUS", "resize the goal, in units"),
    verb("ball move", "X Y", "move the ball's start"),
    verb("tool add", "TYPE X Y [SIZE]", "add a static tool: bucket, square, box, wall or floor"),
    verb("tool move", "N X Y", "move a static tool (from 1)"),
    verb("tool size", "N SIZE", "resize a static tool, in units"),
    verb("tool delete", "N", "delete a static tool"),
    verb(
        "propose",
        "[N]",
        "let the model propose N subgoals in the background, as many as the task has if N is left out",
    ),
    verb("proposal accept", "[N]", "append a proposed subgoal to the task's own; without N, take all in place of them"),
    verb("proposal delete", "[N]", "reject a proposed subgoal, or all of them"),
    verb("proposal move", "N X Y", "move proposed subgoal N (from 1)"),
    verb("proposal size", "N RADIUS", "resize a proposed subgoal, in units"),
    verb("seed", "N", "set the master seed"),
    verb("method", "NAME", "choose the method: ddpg, ddpg-mge, or one to compare them with"),
    verb("episodes", "N", "set the number of training episodes"),
    verb("epsilon", "SPEC", "set the epsilon threshold; a running training takes it at its next episode"),
    verb("set", "KEY VALUE", "set any setting of the run by its JSON path, such as ddpg.critic_learning_rate 1e-4"),
    verb("model train", "TYPE,... FILE [EPOCHS]", "train a dynamics model of these tool types, in the background"),
    verb("model evaluate", "FILE|NAME", "measure a dynamics model on fresh launches and unseen scenes"),
    verb("model stop", "", "end the training or evaluation of a dynamics model; nothing of it is kept"),
    verb("model", "learned|true|uniform|FILE", "choose what predicts the rollouts behind the clusters"),
    verb("clusters", "[FILE]", "compute the action clusters anew, and save them to a file"),
    verb("guide", "", "give the action clusters to the running training"),
    verb("out", "FOLDER", "choose the folder for runs"),
    verb("train", "[FOLDER] [until N]", "start a run, or queue it; with `until`, pause it after N episodes"),
    verb("pause", "", "pause the run"),
    verb("resume", "[until N]", "go on with the paused run"),
    verb("stop", "", "save a checkpoint and end the run"),
    verb("wait", "", "wait until the run pauses or ends, or the clusters are there"),
    verb("open", "FOLDER", "open a run that is on disk"),
    verb("watch", "N", "act on run N of the session, counted from 1 in the order they began"),
    verb("delete", "FOLDER", "delete a run that nobody works on, with all its files"),
    verb("continue", "[FOLDER]", "go on with a run from its checkpoint"),
    verb("evaluate", "", "play the greedy policy of the run"),
    verb("place", "X Y", "hand play: place the tool and let the world run"),
    verb("reset", "", "hand play: start again"),
    verb("figure", "KIND FILE [DPI]", "export a figure: scene, clusters, learning, dashboard or episode"),
    verb("expect", "WHAT OP VALUE", "fail the script unless it holds, such as expect success >= 0.5"),
    verb("record", "FILE", "save the session so far as a script"),
    verb("quit", "", "leave; a running training is checkpointed first"),
];

const fn verb(name: &'static str, arguments: &'static str, help: &'static str) -> Verb {
    Verb { name, arguments, help }
}

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
        for verb in VERBS {
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
