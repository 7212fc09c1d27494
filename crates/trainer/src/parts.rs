//! Groups of settings of a training.

use std::fmt;
use std::sync::Arc;

use educe::Educe;
use serde::{Deserialize, Serialize};

use mge_task::Task;

/// How often epsilon is drawn to decide whether actions come from the clusters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Granularity {
    /// Once per episode.
    Episode,
    /// Once per stage: at the start of an episode and whenever a subgoal is reached. Chosen by
    /// measurement: clusters of a late stage can then follow a policy that reaches it.
    #[default]
    Stage,
    /// Before every action: the paper's literal reading.
    Step,
}

/// Annealing of the exploration noise: its scale falls linearly from 1 towards 0 over the first
/// `share` of the episodes, but not below `final_scale`. It is the same for all methods.
#[derive(Debug, Clone, Copy, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseDecay {
    /// Least scale of the noise's standard deviation; 1 keeps it constant.
    pub final_scale: f32,
    /// Share of the run's episodes, rounded to whole ones, after which the scale would be 0.
    #[educe(Default = 0.5)]
    pub share: f32,
}

impl NoiseDecay {
    /// Scale of the noise in an episode, counted from 0, of a run of `episodes` episodes.
    pub fn scale(&self, episode: u32, episodes: u32) -> f32 {
        let until = (self.share * episodes as f32).round().max(1.0);
        (1.0 - episode as f32 / until).max(self.final_scale)
    }
}

/// Evaluation of the greedy policy during training.
#[derive(Debug, Clone, Copy, Educe, PartialEq, Eq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Evaluation {
    /// Episodes of training between evaluations; 0 for none.
    #[educe(Default = 50)]
    pub every: u32,
    /// Episodes of an evaluation; one is enough for a task without start noise.
    #[educe(Default = 1)]
    pub episodes: u32,
}

/// When a run ends before its last episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StopRule {
    /// Success rate of the last 100 episodes at which the run is finished; none to play all episodes.
    pub success: Option<f64>,
    /// Minutes after which a process that trains the run stops it, as a user would; none for no limit.
    pub minutes: Option<f64>,
}

/// Refinement of clusters from the agent's own rewarding actions during training (the
/// paper's future work). Off by default.
#[derive(Debug, Clone, Copy, Educe, PartialEq, Eq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Refinement {
    /// Episodes between refinements; 0 for none.
    pub every: u32,
    /// Number of own rewarding actions of a stage from which on its clusters are built from these only.
    #[educe(Default = 30)]
    pub least: usize,
    /// Maximum number of own rewarding actions kept per stage; the newest are kept.
    #[educe(Default = 200)]
    pub most: usize,
}

/// Rollouts from stage to stage in the real environment before the first episode.
#[derive(Debug, Clone, Copy, Educe, PartialEq, Eq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Practice {
    /// Maximum number of rollouts towards a stage; 0 for no practice.
    pub rollouts: u32,
    /// Number of rollouts that reach a stage after which no further round follows.
    #[educe(Default = 40)]
    pub enough: u32,
}

/// The origin of a fork.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fork {
    /// Name of the other run's folder.
    pub run: String,
    /// Number of episodes that it shares with the other run.
    pub episode: u32,
    /// Settings that were changed at the fork, as `KEY=VALUE`.
    pub changes: Vec<String>,
    /// Other tasks on which earlier episodes were played, the earliest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<PastTask>,
}

/// The task of the first episodes of a fork.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PastTask {
    /// The last episode on this task.
    pub until: u32,
    /// The task.
    pub task: Arc<Task>,
}

impl fmt::Display for Fork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "forked from {} at episode {}", self.run, self.episode)?;
        if self.changes.is_empty() { Ok(()) } else { write!(f, " with {}", self.changes.join(", ")) }
    }
}
