//! Saving a training in a checkpoint, resuming it, and continuing it with other settings.

use std::sync::Arc;

use serde::Deserialize;

use super::{Training, TrainingError};
use crate::agent::{self, Learner};
use crate::guidance::ActionPrior;
use crate::run::{Checkpoint, RunError};
use crate::trainer::config::RunConfig;
use crate::trainer::exploration::Attempts;
use crate::trainer::hold::Hold;
use crate::trainer::tools::Space;

/// The checkpoint section that holds the networks, as a safetensors file.
pub const NETWORKS_SECTION: &str = "learner.safetensors";
const REPLAY_SECTION: &str = "replay.bin";
/// The checkpoint section that holds counters, streams, schedule and action prior, as JSON.
pub const PROGRESS_SECTION: &str = "progress.json";

/// The action prior in use when a checkpoint was saved, if there was one.
///
/// # Errors
/// When the checkpoint's progress section is missing or malformed.
pub fn prior_at(checkpoint: &Checkpoint) -> Result<Option<Arc<ActionPrior>>, RunError> {
    #[derive(Deserialize)]
    struct WithPrior {
        prior: Option<Arc<ActionPrior>>,
    }
    Ok(checkpoint.json::<WithPrior>(PROGRESS_SECTION)?.prior)
}

/// Whether a learner's vectors and options match those of a run's agent.
fn fits(learner: &Learner, config: &RunConfig) -> bool {
    let (agent, space) = (learner.ddpg(), Space::of(config));
    (agent.observation_len(), agent.action_len()) == (space.observation, space.action)
        && agent.options().is_some() == space.options.is_some()
}

impl Training {
    /// Resumes a run from a checkpoint; it continues exactly as if it had not been interrupted.
    ///
    /// # Errors
    /// When the checkpoint does not belong to this configuration.
    pub fn resume(config: RunConfig, checkpoint: &Checkpoint) -> Result<Self, TrainingError> {
        config.validate()?;
        let learner = Learner::load(&agent::Checkpoint {
            networks: checkpoint.section(NETWORKS_SECTION)?.to_vec(),
            replay: checkpoint.section(REPLAY_SECTION)?.to_vec(),
        })?;
        if !fits(&learner, &config) {
            return Err(agent::StateError::Foreign.into());
        }
        if *learner.ddpg().config() != config.ddpg {
            return Err(TrainingError::OtherSettings);
        }
        Self::assembled(config, learner, checkpoint.json(PROGRESS_SECTION)?)
    }

    /// Continues the training with other settings. The learned state and the replay buffer are kept; rewarding actions,
    /// the first success and attempts are discarded if the task changes.
    ///
    /// # Errors
    /// When a setting is out of range, or the learned state cannot be used with it.
    pub(in crate::trainer) fn forked(
        self,
        config: RunConfig,
        prior: Option<Arc<ActionPrior>>,
    ) -> Result<Self, TrainingError> {
        config.validate()?;
        let Self { config: old, mut learner, mut progress, .. } = self;
        if !fits(&learner, &config) {
            return Err(TrainingError::OtherObservations);
        }
        learner.change(&config.ddpg).map_err(|error| error.within("ddpg"))?;
        // A schedule changed during the run stays in use unless the fork sets another.
        if config.epsilon != old.epsilon {
            progress.epsilon = config.epsilon.clone();
        }
        if config.task != old.task {
            progress.rewarding.clear();
            progress.first_success = None;
        }
        if config.epsilon != old.epsilon || config.task != old.task {
            // Discard the outcomes of attempts and the policies held because of them.
            (progress.attempts, progress.hold) = (Attempts::default(), Hold::default());
            learner.ddpg_mut().release_policy();
        }
        progress.prior = prior;
        Self::assembled(config, learner, progress)
    }

    /// The complete state of the run between two episodes.
    ///
    /// # Errors
    /// When the progress cannot be encoded.
    pub fn checkpoint(&self) -> Result<Checkpoint, TrainingError> {
        let saved = self.learner.save();
        let mut checkpoint = Checkpoint::new(self.progress.episode);
        checkpoint.insert(NETWORKS_SECTION, saved.networks)?;
        checkpoint.insert(REPLAY_SECTION, saved.replay)?;
        checkpoint.insert_json(PROGRESS_SECTION, &self.progress)?;
        Ok(checkpoint)
    }
}
