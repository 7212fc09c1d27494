//! Errors of commands.

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
    /// A file of a run, or one that a command writes, cannot be read or written.
    #[error("{0}")]
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
    /// All episodes of the run are done.
    #[error(
        "{run} is finished after {episodes} episodes{by}: `episodes N` sets more, and `continue` then trains them; \
             `until` only pauses"
    )]
    Finished { run: String, episodes: u64, by: String },
    /// There are no clusters yet.
    #[error("there are no action clusters: `clusters` computes them")]
    NoClusters,
    /// A computation failed.
    #[error("{0}")]
    Failed(String),
}

impl From<String> for SessionError {
    fn from(reason: String) -> Self {
        Self::Failed(reason)
    }
}
