//! Errors of commands.

use std::path::PathBuf;

use super::command::Expect;
use mge_base::validation::ValidationError;
use mge_env::EpisodeOver;
use mge_run::RunError;
use mge_task::TaskError;
use mge_trainer::{RemovedSetting, SettingError, SettingsFileError, TrainerError};

/// Why a command could not be executed.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A task file cannot be read or written.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// An edit or a configuration is out of range.
    #[error(transparent)]
    Invalid(#[from] ValidationError),
    /// A setting is unknown or invalid.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A file of settings cannot be used.
    #[error(transparent)]
    SettingsFile(#[from] SettingsFileError),
    /// A setting of a file is out of range.
    #[error("{}: {problem}", file.display())]
    OfFile { file: PathBuf, problem: ValidationError },
    /// A file of a run, or one that a command writes, cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A run cannot be created.
    #[error(transparent)]
    Training(#[from] TrainerError),
    /// The run has settings of an earlier version.
    #[error(transparent)]
    Removed(#[from] RemovedSetting),
    /// A saved agent cannot be loaded.
    #[error(transparent)]
    Agent(#[from] mge_agent::StateError),
    /// The episode of hand play is over.
    #[error("the episode is over: `reset` begins another")]
    Episode(#[from] EpisodeOver),
    /// The wait was interrupted by a signal.
    #[error("interrupted; `mge resume` continues what was being trained")]
    Interrupted,
    /// No run to act on.
    #[error("there is no run: `train` starts one, `open FOLDER` opens one")]
    NoRun,
    /// The run is not being trained here.
    #[error("{0} is not being trained: `continue` resumes one that is not finished")]
    NotActive(String),
    /// The run is trained by another process, which can only be reached through files.
    #[error("{0} is trained by another process, which cannot be given clusters")]
    TrainedElsewhere(String),
    /// The run is queued.
    #[error("{0} waits for a free core: `stop` takes it out of the queue")]
    Queued(String),
    /// The run is being trained.
    #[error("{0} is being trained: `stop` it, or wait for its end, first")]
    Busy(String),
    /// The run is paused.
    #[error("{0} is paused: `stop` it first, or `resume` it")]
    Paused(String),
    /// All episodes of the run are done.
    #[error("{run} is finished after {episodes} episodes: `episodes` sets more, and `continue` then trains them")]
    Finished { run: String, episodes: u64 },
    /// No run of the session has the number.
    #[error("the session has no run {0}")]
    NoSuchRun(usize),
    /// Nothing to undo or redo.
    #[error("there is nothing to {0}")]
    Nothing(&'static str),
    /// The task was not loaded from a file.
    #[error("{0} has no file: name one to save to, such as `save my-task.json`")]
    NoFile(String),
    /// Another program wrote the task's file.
    #[error("{} was changed by another program: `task FILE` loads it, `save FILE` replaces it", .0.display())]
    ChangedOutside(PathBuf),
    /// There are no clusters yet.
    #[error("there are no action clusters: `clusters` computes them")]
    NoClusters,
    /// A computation failed.
    #[error("{0}")]
    Failed(String),
    /// No thread can be started.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// An expectation does not hold.
    #[error("expected {} {} {}, but it is {found}", expected.quantity, expected.comparison, expected.value)]
    Expectation { expected: Expect, found: f64 },
}
