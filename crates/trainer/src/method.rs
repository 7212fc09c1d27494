//! The methods that can be compared, by name.

use serde::{Deserialize, Serialize};

use super::model_file::{ModelFile, RunModel};
use mge_base::by_name;

/// A way of learning, or of acting without learning. All share one loop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Standard DDPG, the baseline.
    Ddpg,
    /// DDPG with model-guided exploration (paper, section 4.3). Serde's default is that of the first run format; the
    /// program's is [`Method::USUAL`].
    #[default]
    DdpgMge,
    /// Epsilon-greedy: uniform random actions instead of the clusters'. Separates the effect
    /// of the clusters from that of epsilon.
    DdpgUniform,
    /// Clusters from the true physics: an upper bound for learned models.
    DdpgMgeTrue,
    /// DDPG with model-generated transitions in its replay buffer, in runs of earlier versions.
    #[serde(rename = "ddpg-model-replay")]
    ModelReplay,
    /// Planning through the model (cross-entropy method), without learning.
    Planning,
    /// DDPG-MGE that explores by need and learns from its own successes.
    DdpgMgeAdaptive,
    /// The same learner with uniform random actions instead of the clusters'.
    DdpgUniformAdaptive,
    /// The same learner with noise as its only exploration.
    DdpgAdaptive,
    /// No learning: guided exploration until an episode succeeds; its actions are then repeated.
    OpenLoop,
}

impl Method {
    /// All methods of this version.
    pub const ALL: [Self; 9] = [
        Self::Ddpg,
        Self::DdpgMge,
        Self::DdpgUniform,
        Self::DdpgMgeTrue,
        Self::Planning,
        Self::DdpgMgeAdaptive,
        Self::DdpgUniformAdaptive,
        Self::DdpgAdaptive,
        Self::OpenLoop,
    ];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// The name used in tables and legends.
    pub fn label(self) -> &'static str {
        self.names().1
    }

    /// Whether the method draws exploratory actions from the action clusters, or uniformly at random in their place.
    pub fn has_clusters(self) -> bool {
        !matches!(self, Self::Ddpg | Self::ModelReplay | Self::Planning | Self::DdpgAdaptive)
    }

    /// Whether a rollout model is consulted during the episodes.
    pub fn consults_model(self) -> bool {
        matches!(self, Self::ModelReplay | Self::Planning)
    }

    /// Whether the method learns a policy.
    pub fn learns(self) -> bool {
        !matches!(self, Self::Planning | Self::OpenLoop)
    }

    /// Whether it explores by need and learns from its own successes.
    pub fn is_adaptive(self) -> bool {
        matches!(self, Self::DdpgMgeAdaptive | Self::DdpgUniformAdaptive | Self::DdpgAdaptive)
    }

    /// Whether it explores by the epsilon schedule.
    pub fn follows_epsilon(self) -> bool {
        (self.has_clusters() && self.learns()) || self.is_adaptive()
    }

    /// The source of rollouts, if the method determines it.
    pub(super) fn fixed_source(self) -> Option<PriorSource> {
        match self {
            Self::DdpgUniform | Self::DdpgUniformAdaptive => Some(PriorSource::Uniform),
            Self::DdpgMgeTrue => Some(PriorSource::TruePhysics),
            _ => None,
        }
    }

    /// Its names in files, and in tables.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Ddpg => ("ddpg", "DDPG"),
            Self::DdpgMge => ("ddpg-mge", "DDPG-MGE"),
            Self::DdpgUniform => ("ddpg-uniform", "DDPG, uniform exploration"),
            Self::DdpgMgeTrue => ("ddpg-mge-true", "DDPG-MGE, true physics"),
            Self::ModelReplay => ("ddpg-model-replay", "DDPG, model replay"),
            Self::Planning => ("planning", "planning"),
            Self::DdpgMgeAdaptive => ("ddpg-mge-adaptive", "adaptive DDPG-MGE"),
            Self::DdpgUniformAdaptive => ("ddpg-uniform-adaptive", "adaptive DDPG, uniform exploration"),
            Self::DdpgAdaptive => ("ddpg-adaptive", "adaptive DDPG"),
            Self::OpenLoop => ("open-loop", "open-loop replay"),
        }
    }
}

by_name!(Method, "method");

/// The source of rollouts, and thus of the action clusters.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum PriorSource {
    /// `learned`: the shipped dynamics model of the task's tool set.
    Learned,
    /// `trained`: a dynamics model that is trained for the task's tools with the seed of the run.
    Trained(RunModel),
    /// A dynamics model in a file.
    ModelFile(ModelFile),
    /// `rapier`: rapier's own solver, an approximation without learning.
    Rapier,
    /// `true`: the environment's own physics, the upper bound of guidance.
    TruePhysics,
    /// `uniform`: no clusters; uniform random actions instead.
    Uniform,
}

impl Default for PriorSource {
    fn default() -> Self {
        Self::Trained(RunModel::default())
    }
}

impl From<String> for PriorSource {
    fn from(text: String) -> Self {
        match text.as_str() {
            "learned" => Self::Learned,
            "trained" => Self::default(),
            "rapier" => Self::Rapier,
            "true" => Self::TruePhysics,
            "uniform" => Self::Uniform,
            _ => Self::ModelFile(text.into()),
        }
    }
}

impl From<PriorSource> for String {
    fn from(source: PriorSource) -> Self {
        match source {
            PriorSource::Learned => "learned".to_owned(),
            PriorSource::Trained(_) => "trained".to_owned(),
            PriorSource::Rapier => "rapier".to_owned(),
            PriorSource::TruePhysics => "true".to_owned(),
            PriorSource::Uniform => "uniform".to_owned(),
            PriorSource::ModelFile(file) => file.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_of_rollouts_round_trip_as_text() {
        for text in ["trained", "learned", "rapier", "true", "uniform", "a.safetensors"] {
            let source = PriorSource::from(text.to_owned());
            assert_eq!(matches!(source, PriorSource::ModelFile(_)), text.ends_with(".safetensors"), "{text}");
            assert_eq!(String::from(source), text);
        }
    }
}
