//! Why a command could not be carried out.

use super::command::Expect;
use crate::env::EpisodeOver;
use crate::run::RunError;
use crate::task::TaskError;
use crate::trainer::SettingError;
use crate::validation::ValidationError;

/// A command that could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The task file.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// An edit or a configuration that is out of range.
    #[error(transparent)]
    Invalid(#[from] ValidationError),
    /// A setting.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A run's files, and those that a command writes.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A saved agent.
    #[error(transparent)]
    Agent(#[from] crate::agent::StateError),
    /// Hand play.
    #[error("the episode is over: `reset` begins another")]
    Episode(#[from] EpisodeOver),
    /// What was waited for was given up, because a signal asked for it.
    #[error("interrupted; `mge resume` continues what was being trained")]
    Interrupted,
    /// No run to act on.
    #[error("there is no run: `train` begins one, `open FOLDER` opens one")]
    NoRun,
    /// The run is not being trained here.
    #[error("the run is not being trained by this program: `continue` goes on with it")]
    NotActive,
    /// Only files can be shared with the process that trains the run.
    #[error("{0} is trained by another process, which cannot be given clusters")]
    NotHere(String),
    /// The run waits for its turn.
    #[error("{0} waits for a free core: `stop` takes it out of the queue")]
    Queued(String),
    /// The run is being trained.
    #[error("{0} is being trained: `stop` it, or wait for its end, first")]
    Busy(String),
    /// No run of the session has the number.
    #[error("the session has no run {0}")]
    NoSuchRun(usize),
    /// Nothing to undo or redo.
    #[error("there is nothing to {0}")]
    Nothing(&'static str),
    /// The task was not loaded from a file.
    #[error("{0} is a shipped task: name the file to save to, such as `save my-task.json`")]
    NoFile(String),
    /// No clusters yet.
    #[error("there are no action clusters: `clusters` computes them")]
    NoClusters,
    /// A computation failed.
    #[error("{0}")]
    Failed(String),
    /// The system has no more threads.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// An expectation does not hold.
    #[error("expected {} {} {}, but it is {found}", expected.quantity.name(), expected.comparison.sign(), expected.value)]
    Expectation { expected: Expect, found: f64 },
}
