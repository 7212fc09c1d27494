//! Everything that decides a run: one value, complete, saved with the run.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::method::{Method, PriorSource};
use crate::agent::{ConfigError, DdpgConfig};
use crate::guidance::{EpsilonSchedule, GuidanceConfig, GuidanceError, PlannerConfig};
use crate::run::Retention;
use crate::task::Task;

/// How often it is decided whether actions come from the clusters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Granularity {
    /// Once for each episode.
    Episode,
    /// Once for each stage, at the start of an episode and whenever a subgoal is reached: the
    /// measured choice, because clusters of a late stage then follow a policy that gets there.
    #[default]
    Stage,
    /// Before every action: the paper's literal reading.
    Step,
}

/// How the exploration noise shrinks: linearly, so that nothing would be left of it after
/// the first `share` of the episodes, but never below `final_scale`. Both methods get the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseDecay {
    /// Least scale of the noise's standard deviation; 1 keeps it constant.
    pub final_scale: f32,
    /// Share of the run's episodes after which the scale would be 0.
    pub share: f32,
}

impl Default for NoiseDecay {
    fn default() -> Self {
        Self { final_scale: 0.0, share: 0.5 }
    }
}

impl NoiseDecay {
    /// Scale of the noise in an episode, counted from 0, of a run of `episodes`.
    pub fn scale(&self, episode: u32, episodes: u32) -> f32 {
        let span = (self.share * episodes as f32).max(1.0);
        (1.0 - episode as f32 / span).max(self.final_scale)
    }
}

/// How the greedy policy is evaluated during training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Evaluation {
    /// Episodes of training between evaluations; 0 for none.
    pub every: u32,
    /// Episodes without noise; one is enough for a task without start noise.
    pub episodes: u32,
}

impl Default for Evaluation {
    fn default() -> Self {
        Self { every: 50, episodes: 1 }
    }
}

/// How clusters follow the agent's own rewarding actions as training goes on (the
/// paper's future work). Off by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Refinement {
    /// Episodes between refinements; 0 for none.
    pub every: u32,
    /// Own rewarding actions of a stage before its clusters are made from them alone.
    pub least: usize,
    /// Own rewarding actions of a stage that are kept, the newest.
    pub most: usize,
}

impl Default for Refinement {
    fn default() -> Self {
        Self { every: 0, least: 30, most: 200 }
    }
}

/// What [`Method::ModelReplay`] imagines after each episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModelReplay {
    /// Imagined rollouts, each from a state of the episode.
    pub rollouts: usize,
    /// Actions in a rollout, the actor's with noise.
    pub horizon: usize,
}

impl Default for ModelReplay {
    fn default() -> Self {
        Self { rollouts: 2, horizon: 5 }
    }
}

/// One training, completely described.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// The task, whole, so that a run does not depend on a file that may change.
    pub task: Arc<Task>,
    /// Algorithm.
    #[serde(default)]
    pub method: Method,
    /// Master seed.
    #[serde(default)]
    pub seed: u64,
    /// Episodes to train.
    #[serde(default = "default_episodes")]
    pub episodes: u32,
    /// Threshold of epsilon; not used by methods without clusters.
    #[serde(default = "default_epsilon")]
    pub epsilon: EpsilonSchedule,
    /// When epsilon is drawn.
    #[serde(default)]
    pub granularity: Granularity,
    /// Annealing of the exploration noise.
    #[serde(default)]
    pub noise_decay: NoiseDecay,
    /// The learner.
    #[serde(default)]
    pub ddpg: DdpgConfig,
    /// Where clusters, plans and imagined transitions come from, unless the method says it.
    #[serde(default)]
    pub prior: PriorSource,
    /// How they are built.
    #[serde(default)]
    pub guidance: GuidanceConfig,
    /// Whether clusters are refined during training.
    #[serde(default)]
    pub refinement: Refinement,
    /// What is imagined into the replay buffer, by the method that does so.
    #[serde(default)]
    pub model_replay: ModelReplay,
    /// How actions are planned, by the method that does so.
    #[serde(default)]
    pub planner: PlannerConfig,
    /// Greedy evaluation.
    #[serde(default)]
    pub evaluation: Evaluation,
    /// Which checkpoints are kept.
    #[serde(default)]
    pub checkpoints: Retention,
}

fn default_episodes() -> u32 {
    2000
}

fn default_epsilon() -> EpsilonSchedule {
    EpsilonSchedule::Linear { from: 0.5, to: 0.0, episodes: 1000 }
}

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RunConfigError {
    /// Of the run itself.
    #[error("`{field}` must be {requirement}")]
    Run { field: &'static str, requirement: &'static str },
    /// Of the learner.
    #[error("ddpg: {0}")]
    Ddpg(#[from] ConfigError),
    /// Of guidance.
    #[error(transparent)]
    Guidance(#[from] GuidanceError),
}

impl RunConfig {
    /// The default configuration for a task.
    pub fn new(task: Arc<Task>) -> Self {
        Self {
            task,
            method: Method::default(),
            seed: 0,
            episodes: default_episodes(),
            epsilon: default_epsilon(),
            granularity: Granularity::default(),
            noise_decay: NoiseDecay::default(),
            ddpg: DdpgConfig::default(),
            prior: PriorSource::default(),
            guidance: GuidanceConfig::default(),
            refinement: Refinement::default(),
            model_replay: ModelReplay::default(),
            planner: PlannerConfig::default(),
            evaluation: Evaluation::default(),
            checkpoints: Retention::default(),
        }
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), RunConfigError> {
        let error = |field, requirement| Err(RunConfigError::Run { field, requirement });
        if self.episodes == 0 {
            return error("episodes", "at least 1");
        }
        if !(0.0..=1.0).contains(&self.noise_decay.final_scale) {
            return error("noise_decay.final_scale", "from 0 to 1");
        }
        if !(0.0..=1.0).contains(&self.noise_decay.share) {
            return error("noise_decay.share", "from 0 to 1");
        }
        if self.evaluation.every > 0 && self.evaluation.episodes == 0 {
            return error("evaluation.episodes", "at least 1");
        }
        if self.refinement.every > 0 && self.refinement.most < self.refinement.least.max(1) {
            return error("refinement.most", "at least 1 and at least refinement.least");
        }
        if self.model_replay.rollouts == 0 || self.model_replay.horizon == 0 {
            return error("model_replay.rollouts and model_replay.horizon", "at least 1");
        }
        self.ddpg.validate()?;
        self.guidance.validate()?;
        self.planner.validate()?;
        Ok(())
    }

    /// Whether the run uses action clusters at all.
    pub fn is_guided(&self) -> bool {
        self.method.has_clusters() && !self.epsilon.is_zero()
    }

    /// Where the run's clusters, plans or imagined transitions come from.
    pub fn rollout_source(&self) -> PriorSource {
        self.method.fixed_source().unwrap_or_else(|| self.prior.clone())
    }
}
