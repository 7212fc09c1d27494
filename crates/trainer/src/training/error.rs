//! Errors of training.

use crate::prior::PriorError;
use crate::removed::RemovedSetting;
use mge_agent as agent;
use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_env::EpisodeOver;
use mge_run::RunError;

/// Why training cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ValidationError),
    /// The run has settings of an earlier version.
    #[error(transparent)]
    Removed(#[from] RemovedSetting),
    /// The model that the method consults cannot be used.
    #[error(transparent)]
    Model(PriorError),
    /// The environment was not reset.
    #[error(transparent)]
    Episode(#[from] EpisodeOver),
    /// The learner diverged.
    #[error(transparent)]
    Update(#[from] agent::UpdateError),
    /// The replay buffer rejected a transition.
    #[error(transparent)]
    Replay(#[from] agent::ReplayError),
    /// A saved learner cannot be used.
    #[error(transparent)]
    State(#[from] agent::StateError),
    /// A checkpoint cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The settings were changed after the run began.
    #[error("the run began with another `{0}` than config.json has now: restore it, or start a new run")]
    OtherSettings(String),
    /// The checkpoint from which a fork continues is missing.
    #[error("the run is a fork, and the checkpoint from which it continues is missing: fork the other run again")]
    MissingForkCheckpoint,
    /// The lengths of observations differ because the number of subgoals changed.
    #[error("the networks have learned with observations of another length: keep the number of subgoals")]
    OtherObservations,
    /// A stop abandoned the episode.
    #[error("stopped in the middle of an episode")]
    Stopped,
}

impl From<Stopped> for TrainingError {
    fn from(_: Stopped) -> Self {
        Self::Stopped
    }
}

impl From<DynamicsError> for TrainingError {
    fn from(error: DynamicsError) -> Self {
        PriorError::from(error).into()
    }
}

impl From<PriorError> for TrainingError {
    fn from(error: PriorError) -> Self {
        if error.is_stopped() { Self::Stopped } else { Self::Model(error) }
    }
}
