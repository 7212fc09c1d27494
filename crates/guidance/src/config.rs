//! Settings of guidance, and errors in them or in a saved prior.

use educe::Educe;
use serde::{Deserialize, Serialize};

use super::clusters::ClusterCount;
use super::rewarding::Rewarding;
use mge_base::json::SyntaxError;
use mge_base::validation::{Setting, ValidationError, check_settings};

/// How the prior is built.
#[derive(Debug, Clone, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct GuidanceConfig {
    /// Model rollouts for each stage, in one batch.
    #[educe(Default = 600)]
    pub model_rollouts: usize,
    /// More batches follow while fewer rollouts than this are predicted to reach the stage.
    #[educe(Default = 4)]
    pub least_hits: usize,
    /// No more batches follow once a stage has this many rollouts.
    #[educe(Default = 20_000)]
    pub most_model_rollouts: usize,
    /// Actions in a rollout.
    #[educe(Default = 8)]
    pub horizon: usize,
    /// While no rollout reaches a stage even so, they become twice as long, up to this many actions and the task's
    /// maximum.
    #[educe(Default = 8)]
    pub longest_horizon: usize,
    /// Rollouts in the real environment, over all stages (paper: 200 for each task).
    #[educe(Default = 200)]
    pub environment_rollouts: usize,
    /// Which actions of a successful rollout are stored.
    pub rewarding: Rewarding,
    /// Number of clusters for each stage.
    #[educe(Default = ClusterCount { fixed: 3 })]
    pub clusters: ClusterCount,
    /// Least standard deviation of a cluster, normalised.
    #[educe(Default = 0.02)]
    pub std_floor: f32,
    /// Start states of the next stage.
    pub start_states: StartStates,
}

/// The states of the real rollouts from which the next stage's rollouts start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartStates {
    /// The states in which the subgoal was reached; all last states if none was.
    #[default]
    Reached,
    /// The last state of every rollout: the paper's literal reading.
    Last,
}

/// Why a prior cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum GuidanceError {
    /// The text is not an action prior.
    #[error("not an action prior: {0}")]
    Syntax(#[from] SyntaxError),
    /// The prior is of another task or version, or has impossible values.
    #[error("{origin}: {problem}: build it again")]
    Unusable { origin: String, problem: String },
}

/// The numeric settings of [`GuidanceConfig`].
pub const SETTINGS: [Setting; 8] = [
    Setting::count("model_rollouts", 1, 100_000, "model rollouts for each stage"),
    Setting::count("least_hits", 0, 100_000, "rollouts that must reach a stage, otherwise another batch is made"),
    Setting::count("most_model_rollouts", 1, 100_000, "rollouts for each stage after which no batch follows"),
    Setting::count("horizon", 1, 100, "actions in a rollout"),
    Setting::count("longest_horizon", 1, 100, "actions in a rollout at most, while none reaches a stage"),
    Setting::count("environment_rollouts", 1, 100_000, "rollouts in the real environment, over all stages"),
    Setting::count("clusters.fixed", 1, 100, "clusters for each stage"),
    Setting::number("std_floor", 0.0, 1.0, "least standard deviation of a cluster, normalised"),
];

impl GuidanceConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        check_settings(self, &SETTINGS)
    }
}
