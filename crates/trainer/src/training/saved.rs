//! Saving a training in a checkpoint, resuming it, and continuing it with other settings.

use std::sync::Arc;

use serde::Deserialize;

use super::{ACTION_LEN, Training, TrainingState};
use crate::config::RunConfig;
use crate::error::{Result, TrainerError};
use crate::exploration::Attempts;
use crate::hold::Hold;
use crate::prior::build_prior;
use crate::watch::Phase;
use mge_agent::{self as agent, Ddpg, Learner};
use mge_base::json;
use mge_base::stop::Stop;
use mge_env::observation_len;
use mge_guidance::ActionPrior;
use mge_run::{Checkpoint, RunError};

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
    checkpoint.json(PROGRESS_SECTION).map(|WithPrior { prior }| prior)
}

/// The checkpoint section that holds the configuration of the run, as JSON.
const CONFIG_SECTION: &str = "config.json";

/// Checks that a run has the settings with which a checkpoint was saved; it may have been extended since.
///
/// # Errors
/// The first setting that differs.
fn check_settings(config: &RunConfig, checkpoint: &Checkpoint) -> Result<()> {
    // Checkpoints of earlier versions do not have the section.
    if !checkpoint.names().any(|name| name == CONFIG_SECTION) {
        return Ok(());
    }
    let mut saved: RunConfig = checkpoint.json(CONFIG_SECTION)?;
    if config.stop.success.is_none() && saved.extends_to(config.episodes) {
        saved = saved.extended(config.episodes);
    }
    if saved == *config {
        return Ok(());
    }
    let [saved, now] = [&saved, config].map(json::to_value);
    let (saved, now) = (json::leaf_values(&saved), json::leaf_values(&now));
    let differing =
        saved.iter().find(|leaf| !now.contains(leaf)).or_else(|| now.iter().find(|leaf| !saved.contains(leaf)));
    Err(other_settings(differing.map_or("", |(path, _)| path)))
}

/// The error of a run whose settings were changed after it began.
fn other_settings(path: &str) -> TrainerError {
    let remedy = "restore it, or start a new run";
    TrainerError::Refused(format!("the run began with another `{path}` than config.json has now: {remedy}"))
}

/// Whether the lengths of an agent's vectors are those of a run's agent.
fn fits(agent: &Ddpg, config: &RunConfig) -> bool {
    (agent.observation_len(), agent.action_len()) == (observation_len(&config.task), ACTION_LEN)
}

impl Training {
    /// The training from a checkpoint, or from its beginning with new clusters, for which `on_phase` is called.
    ///
    /// # Errors
    /// As [`resume`](Self::resume) and [`new`](Self::new), and when the model cannot be used.
    pub(crate) fn begin(
        config: RunConfig,
        checkpoint: Option<&Checkpoint>,
        on_phase: impl FnMut(Phase),
        stop: &Stop,
    ) -> Result<Self> {
        if let Some(checkpoint) = checkpoint {
            return Self::resume(config, checkpoint);
        }
        // Practice builds them itself.
        let is_built = config.is_guided() && !config.practises();
        let prior = is_built.then(|| build_prior(&config, on_phase, stop)).transpose()?;
        Self::new(config, prior.map(Arc::new))
    }

    /// Resumes a run from a checkpoint; it continues exactly as if it had not been interrupted.
    ///
    /// # Errors
    /// When the checkpoint does not belong to this configuration.
    pub fn resume(config: RunConfig, checkpoint: &Checkpoint) -> Result<Self> {
        config.validate()?;
        config.check_supported()?;
        check_settings(&config, checkpoint)?;
        let learner = Learner::load(&agent::SavedLearner {
            networks: checkpoint.section(NETWORKS_SECTION)?.to_vec(),
            replay: checkpoint.section(REPLAY_SECTION)?.to_vec(),
        })?;
        if !fits(&learner.ddpg, &config) {
            return Err(agent::StateError::ReplayMismatch.into());
        }
        if *learner.ddpg.config() != config.ddpg {
            return Err(other_settings("ddpg"));
        }
        let progress: TrainingState = checkpoint.json(PROGRESS_SECTION)?;
        if progress.seed.is_some_and(|seed| seed != config.seed) {
            return Err(other_settings("seed"));
        }
        Self::assembled(config, learner, progress)
    }

    /// Continues the training with other settings. The learned state and the replay buffer are kept; rewarding actions,
    /// the first success and attempts are discarded if the task changes.
    ///
    /// # Errors
    /// When a setting is out of range, or the learned state cannot be used with it.
    pub(crate) fn forked(self, config: RunConfig, prior: Option<Arc<ActionPrior>>) -> Result<Self> {
        config.validate()?;
        let Self { config: old, mut learner, mut progress, .. } = self;
        if !fits(&learner.ddpg, &config) {
            let reason = "the networks have learned with observations of another length: keep the number of subgoals";
            return Err(TrainerError::Refused(reason.to_owned()));
        }
        learner.reconfigure(&config.ddpg).map_err(|error| error.within("ddpg"))?;
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
            learner.ddpg.release_policy();
        }
        if !old.has_model_of(&config) {
            progress.charge(config.launches());
        }
        progress.seed = Some(config.seed);
        progress.use_prior(prior);
        Self::assembled(config, learner, progress)
    }

    /// The complete state of the run between two episodes.
    ///
    /// # Errors
    /// When the progress cannot be encoded.
    pub fn checkpoint(&self) -> Result<Checkpoint> {
        let saved = self.learner.save();
        let mut checkpoint = Checkpoint::new(self.progress.episode);
        checkpoint.insert(NETWORKS_SECTION, saved.networks)?;
        checkpoint.insert(REPLAY_SECTION, saved.replay)?;
        checkpoint.insert_json(PROGRESS_SECTION, &self.progress)?;
        checkpoint.insert_json(CONFIG_SECTION, &self.config)?;
        Ok(checkpoint)
    }
}
