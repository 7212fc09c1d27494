//! Saving a training in a checkpoint, resuming it, and continuing it with other settings.

use std::sync::Arc;

use serde::Deserialize;

use super::{Training, TrainingError, TrainingState};
use crate::config::RunConfig;
use crate::exploration::Attempts;
use crate::hold::Hold;
use crate::tools::Space;
use mge_agent::{self as agent, Ddpg, Learner};
use mge_base::json;
use mge_guidance::ActionPrior;
use mge_run::{Checkpoint, RunError};

/// The checkpoint section that holds the networks, as a safetensors file.
pub const NETWORKS_SECTION: &str = "learner.safetensors";
const REPLAY_SECTION: &str = "replay.bin";
/// The checkpoint section that holds counters, streams, schedule and action prior, as JSON.
pub const PROGRESS_SECTION: &str = "progress.json";

/// The action priors in use when a checkpoint was saved, of all tasks that had one.
///
/// # Errors
/// When the checkpoint's progress section is missing or malformed.
pub fn priors_at(checkpoint: &Checkpoint) -> Result<Vec<Arc<ActionPrior>>, RunError> {
    #[derive(Deserialize)]
    struct WithPrior {
        prior: Option<Arc<ActionPrior>>,
        #[serde(default)]
        further: Vec<WithPrior>,
    }
    let WithPrior { prior, further } = checkpoint.json(PROGRESS_SECTION)?;
    Ok(prior.into_iter().chain(further.into_iter().filter_map(|state| state.prior)).collect())
}

/// The checkpoint section that holds the configuration of the run, as JSON.
pub const CONFIG_SECTION: &str = "config.json";

/// Checks that a run has the settings with which a checkpoint was saved; it may have been extended since.
///
/// # Errors
/// The first setting that differs.
pub fn check_settings(config: &RunConfig, checkpoint: &Checkpoint) -> Result<(), TrainingError> {
    // Checkpoints of earlier versions do not have the section.
    if !checkpoint.names().any(|name| name == CONFIG_SECTION) {
        return Ok(());
    }
    let mut saved: RunConfig = checkpoint.json(CONFIG_SECTION)?;
    if saved.episodes < config.episodes {
        saved = saved.extended(config.episodes);
    }
    if saved == *config {
        return Ok(());
    }
    let [saved, now] = [&saved, config].map(json::as_written);
    let (saved, now) = (json::leaves(&saved), json::leaves(&now));
    let differing =
        saved.iter().find(|leaf| !now.contains(leaf)).or_else(|| now.iter().find(|leaf| !saved.contains(leaf)));
    Err(TrainingError::OtherSettings(differing.map_or_else(String::new, |(path, _)| path.clone())))
}

/// Whether an agent's vectors and options match those of a run's agent.
fn fits(agent: &Ddpg, config: &RunConfig) -> bool {
    let space = Space::of(config);
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
        check_settings(&config, checkpoint)?;
        let learner = Learner::load(&agent::SavedLearner {
            networks: checkpoint.section(NETWORKS_SECTION)?.to_vec(),
            replay: checkpoint.section(REPLAY_SECTION)?.to_vec(),
        })?;
        if !fits(learner.ddpg(), &config) {
            return Err(agent::StateError::ReplayMismatch.into());
        }
        if *learner.ddpg().config() != config.ddpg {
            return Err(TrainingError::OtherSettings("ddpg".to_owned()));
        }
        let progress: TrainingState = checkpoint.json(PROGRESS_SECTION)?;
        if progress.seed.is_some_and(|seed| seed != config.seed) {
            return Err(TrainingError::OtherSettings("seed".to_owned()));
        }
        if progress.further.len() != config.further_tasks.len() {
            return Err(agent::StateError::ReplayMismatch.into());
        }
        Self::assembled(config, learner, progress)
    }

    /// Continues the training with other settings. The learned state and the replay buffer are kept; rewarding actions,
    /// the first success and attempts are discarded if the task changes. `priors` are those of the tasks, in their
    /// order.
    ///
    /// # Errors
    /// When a setting is out of range, or the learned state cannot be used with it.
    pub(crate) fn forked(
        self,
        config: RunConfig,
        priors: Vec<Option<Arc<ActionPrior>>>,
    ) -> Result<Self, TrainingError> {
        config.validate()?;
        let Self { config: old, mut learner, mut progress, .. } = self;
        if !fits(learner.ddpg(), &config) {
            return Err(TrainingError::OtherObservations);
        }
        if config.further_tasks.is_empty() {
            progress.further.clear();
        } else if config.further_tasks != old.further_tasks {
            return Err(TrainingError::OtherTasks);
        }
        learner.reconfigure(&config.ddpg).map_err(|error| error.within("ddpg"))?;
        // A schedule changed during the run stays in use unless the fork sets another.
        if config.epsilon != old.epsilon {
            progress.epsilon = config.epsilon.clone();
            progress.further.iter_mut().for_each(|state| state.attempts = Attempts::default());
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
        progress.seed = Some(config.seed);
        let mut priors = priors.into_iter();
        progress.prior = priors.next().flatten();
        progress.further.iter_mut().zip(priors).for_each(|(state, prior)| state.prior = prior);
        Self::assembled(config, learner, progress)
    }

    /// Replaces the networks and their optimisers by those of another training with the same settings of the learner.
    ///
    /// # Errors
    /// When the agent observes something else, or has other settings.
    pub fn adopt(&mut self, mut agent: Ddpg) -> Result<(), TrainingError> {
        if !fits(&agent, &self.config) {
            return Err(TrainingError::OtherObservations);
        }
        if *agent.config() != self.config.ddpg {
            return Err(TrainingError::OtherSettings("ddpg".to_owned()));
        }
        agent.set_candidates(self.config.tool_candidates);
        *self.learner.ddpg_mut() = agent;
        Ok(())
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
        checkpoint.insert_json(CONFIG_SECTION, &self.config)?;
        Ok(checkpoint)
    }
}
