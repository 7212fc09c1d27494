//! Everything that decides a run: one value, complete, saved with the run.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::agent::{ConfigError, DdpgConfig};
use crate::guidance::{EpsilonSchedule, GuidanceConfig, GuidanceError};
use crate::run::Retention;
use crate::task::Task;

/// The two algorithms of the paper's section 5.3.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Method {
    /// Standard DDPG, the baseline.
    #[serde(rename = "ddpg")]
    Ddpg,
    /// DDPG with model-guided exploration.
    #[default]
    #[serde(rename = "ddpg-mge")]
    DdpgMge,
}

impl Method {
    /// Both methods.
    pub const ALL: [Self; 2] = [Self::Ddpg, Self::DdpgMge];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ddpg => "ddpg",
            Self::DdpgMge => "ddpg-mge",
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || Self::ALL.map(Self::name).join(" or ");
        Self::ALL
            .into_iter()
            .find(|method| method.name() == text)
            .ok_or_else(|| format!("unknown method `{text}`: use {}", known()))
    }
}

/// Where the action clusters come from.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum PriorSource {
    /// `learned`: the shipped dynamics model of the task's tool set.
    #[default]
    Learned,
    /// A dynamics model in a file.
    ModelFile(String),
    /// `true`: the environment's own physics, the upper bound of guidance.
    TruePhysics,
    /// `uniform`: no clusters; uniform random actions in their place.
    Uniform,
}

impl From<String> for PriorSource {
    fn from(text: String) -> Self {
        match text.as_str() {
            "learned" => Self::Learned,
            "true" => Self::TruePhysics,
            "uniform" => Self::Uniform,
            _ => Self::ModelFile(text),
        }
    }
}

impl From<PriorSource> for String {
    fn from(source: PriorSource) -> Self {
        match source {
            PriorSource::Learned => "learned".to_owned(),
            PriorSource::TruePhysics => "true".to_owned(),
            PriorSource::Uniform => "uniform".to_owned(),
            PriorSource::ModelFile(path) => path,
        }
    }
}

/// How often it is decided whether actions come from the clusters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Granularity {
    /// Once for each episode: the measured choice, because then most episodes are purely
    /// the policy's.
    #[default]
    Episode,
    /// Before every action: the paper's literal reading.
    Step,
}

/// How the exploration noise shrinks: linearly to `final_scale` over the first
/// `share` of the episodes. Both methods get the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseDecay {
    /// Last scale of the noise's standard deviation; 1 keeps it constant.
    pub final_scale: f32,
    /// Share of the run's episodes after which it is reached.
    pub share: f32,
}

impl Default for NoiseDecay {
    fn default() -> Self {
        Self { final_scale: 0.1, share: 0.5 }
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
    /// Threshold of epsilon; not used by the baseline.
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
    /// Where the clusters come from.
    #[serde(default)]
    pub prior: PriorSource,
    /// How they are built.
    #[serde(default)]
    pub guidance: GuidanceConfig,
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
        self.ddpg.validate()?;
        self.guidance.validate()?;
        Ok(())
    }

    /// Whether the run uses action clusters at all.
    pub fn is_guided(&self) -> bool {
        self.method == Method::DdpgMge && !self.epsilon.is_zero()
    }
}
