//! Errors of trainings.

use super::removed::RemovedSetting;
use mge_agent::{ReplayError, StateError, UpdateError};
use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_env::EpisodeOver;
use mge_guidance::GuidanceError;
use mge_run::RunError;

/// Result of work with trainings.
pub type Result<T, E = TrainerError> = std::result::Result<T, E>;

/// Why a run cannot be trained, continued or forked, or has no clusters.
#[derive(Debug, thiserror::Error)]
pub enum TrainerError {
    /// The run's files cannot be used.
    #[error("{0}")]
    Run(#[from] RunError),
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ValidationError),
    /// The run has settings of an earlier version.
    #[error(transparent)]
    Removed(#[from] RemovedSetting),
    /// The dynamics model cannot be used.
    #[error(transparent)]
    Model(DynamicsError),
    /// The saved clusters of a run are invalid or belong to another task.
    #[error(transparent)]
    Clusters(#[from] GuidanceError),
    /// The environment was not reset.
    #[error(transparent)]
    Episode(#[from] EpisodeOver),
    /// The learner diverged.
    #[error(transparent)]
    Update(#[from] UpdateError),
    /// The replay buffer rejected a transition.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A saved learner cannot be used.
    #[error(transparent)]
    State(#[from] StateError),
    /// It was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// It cannot be done, for the reason that the text gives.
    #[error("{0}")]
    Refused(String),
}

impl From<DynamicsError> for TrainerError {
    fn from(error: DynamicsError) -> Self {
        if let DynamicsError::Stopped(stopped) = error { Self::Stopped(stopped) } else { Self::Model(error) }
    }
}
