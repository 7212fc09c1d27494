//! The action prior of a task: clusters of rewarding actions for every stage, built
//! from subgoal to subgoal (paper, section 4.2, steps 1 to 4).

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::clusters::{Cluster, ClusterCount, cluster};
use super::rollout::{Rewarding, RolloutModel};
use crate::env::{Action, Environment, Snapshot};
use crate::streams::Stream;
use crate::task::Task;

/// How the prior is built.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GuidanceConfig {
    /// Model rollouts for each stage.
    pub model_rollouts: usize,
    /// Actions in a rollout.
    pub horizon: usize,
    /// Rollouts in the real environment, over all stages (paper: 200 for each task).
    pub environment_rollouts: usize,
    /// Which actions of a successful rollout are stored.
    pub rewarding: Rewarding,
    /// Number of clusters for each stage.
    pub clusters: ClusterCount,
    /// Least standard deviation of a cluster, normalised.
    pub std_floor: f32,
    /// Which states start the next stage.
    pub start_states: StartStates,
}

/// Which states of the real rollouts start the next stage's rollouts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartStates {
    /// The states in which the subgoal was reached; all last states if none was.
    #[default]
    Reached,
    /// The last state of every rollout: the paper's literal reading.
    Last,
}

impl Default for GuidanceConfig {
    fn default() -> Self {
        Self {
            model_rollouts: 600,
            horizon: 8,
            environment_rollouts: 200,
            rewarding: Rewarding::default(),
            clusters: ClusterCount::Fixed(3),
            std_floor: 0.02,
            start_states: StartStates::default(),
        }
    }
}

/// The clusters of one stage and what they were made from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StagePrior {
    /// Clusters of rewarding actions, the largest first; empty if the model predicted none.
    pub clusters: Vec<Cluster>,
    /// The stored rewarding actions.
    pub actions: Vec<Action>,
    /// Model rollouts made.
    pub model_rollouts: usize,
    /// Model rollouts predicted to reach the stage.
    pub model_hits: usize,
    /// Rollouts made in the real environment (none for the last stage).
    pub environment_rollouts: usize,
    /// Real rollouts that reached the stage and can go on from there.
    pub environment_hits: usize,
}

/// All clusters of a task, by stage: the distributions from which exploration samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionPrior {
    /// Format version.
    pub version: u32,
    /// The task's name.
    pub task: String,
    /// What predicted the rollouts.
    pub model: String,
    /// The seed of the build.
    pub seed: u64,
    /// How it was built.
    pub config: GuidanceConfig,
    /// Subgoals in order, then the goal.
    pub stages: Vec<StagePrior>,
}

/// Why a prior cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum GuidanceError {
    /// The text is not an action prior.
    #[error("{origin}:{line}: not an action prior: {message}")]
    Syntax { origin: String, line: usize, message: String },
    /// It was made for another task.
    #[error(
        "{origin}: the action prior is for {found} with {found_stages} stages, not for {wanted} with {wanted_stages}: build it again"
    )]
    OtherTask { origin: String, found: String, found_stages: usize, wanted: String, wanted_stages: usize },
    /// A setting is out of range.
    #[error("{room}.{field}: {message}")]
    Config { room: &'static str, field: &'static str, message: &'static str },
}

impl GuidanceConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), GuidanceError> {
        let error = |field, message| Err(GuidanceError::Config { room: "guidance", field, message });
        match self {
            Self { model_rollouts: 0, .. } => error("model_rollouts", "must be at least 1"),
            Self { horizon: 0, .. } => error("horizon", "must be at least 1"),
            Self { environment_rollouts: 0, .. } => error("environment_rollouts", "must be at least 1"),
            Self { clusters: ClusterCount::Fixed(0), .. } => error("clusters", "must be at least 1"),
            Self { clusters: ClusterCount::Silhouette(0 | 1), .. } => error("clusters", "must be at least 2"),
            Self { std_floor, .. } if !(0.0..=1.0).contains(std_floor) => error("std_floor", "must be from 0 to 1"),
            _ => Ok(()),
        }
    }
}

impl ActionPrior {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    /// A prior without clusters: every stage samples uniformly.
    pub fn uniform(task: &Task, seed: u64) -> Self {
        Self {
            version: Self::VERSION,
            task: task.name.clone(),
            model: "uniform".to_owned(),
            seed,
            config: GuidanceConfig::default(),
            stages: vec![StagePrior::default(); task.stage_count()],
        }
    }

    /// An action for a stage: a cluster drawn by weight, then its normal distribution.
    /// Uniform over [-1, 1]^2 if the stage has no cluster.
    pub fn sample(&self, stage: usize, rng: &mut impl Rng) -> Action {
        match self.stages.get(stage) {
            Some(stage) => stage.sample(rng),
            None => uniform(rng),
        }
    }

    /// Reads a prior and checks that it fits the task.
    ///
    /// # Errors
    /// When the text is no prior, or one of another task.
    pub fn parse(text: &str, origin: &str, task: &Task) -> Result<Self, GuidanceError> {
        let prior: Self = serde_json::from_str(text).map_err(|error| GuidanceError::Syntax {
            origin: origin.to_owned(),
            line: error.line(),
            message: error.to_string(),
        })?;
        let wanted_stages = task.stage_count();
        if prior.task != task.name || prior.stages.len() != wanted_stages {
            return Err(GuidanceError::OtherTask {
                origin: origin.to_owned(),
                found: prior.task,
                found_stages: prior.stages.len(),
                wanted: task.name.clone(),
                wanted_stages,
            });
        }
        Ok(prior)
    }

    /// The prior with the clusters of a stage made from other actions, such as those that
    /// turned out to be rewarding in real play.
    pub fn with_actions(&self, stage: usize, actions: Vec<Action>, rng: &ChaCha8Rng) -> Self {
        let mut refined = self.clone();
        if let Some(stage) = refined.stages.get_mut(stage) {
            stage.clusters = cluster(&actions, self.config.clusters, self.config.std_floor, rng);
            stage.actions = actions;
        }
        refined
    }

    /// The JSON text of the prior, as it is saved.
    pub fn to_json(&self) -> String {
        // Plain structs of numbers and strings always serialise.
        serde_json::to_string_pretty(self).expect("a prior is plain data") + "\n"
    }
}

impl StagePrior {
    /// An action for this stage, as [`ActionPrior::sample`].
    pub fn sample(&self, rng: &mut impl Rng) -> Action {
        let mut share: f32 = rng.r#gen();
        for cluster in &self.clusters {
            share -= cluster.weight;
            if share < 0.0 {
                return cluster.sample(rng);
            }
        }
        match self.clusters.last() {
            Some(cluster) => cluster.sample(rng),
            None => uniform(rng),
        }
    }
}

/// Builds the prior of a task stage by stage. `progress` is called before each stage
/// with its number; returning false stops the build.
///
/// Each stage has random streams of its own, so one stage's size does not shift another's.
pub fn build(
    task: &Arc<Task>,
    model: &dyn RolloutModel,
    model_name: &str,
    config: &GuidanceConfig,
    seed: u64,
    mut progress: impl FnMut(usize) -> bool,
) -> Option<ActionPrior> {
    let stages = task.stage_count();
    let mut env = Environment::new(task.clone());
    env.reset(&mut Stream::PriorStart.of(seed));
    let mut starts = vec![env.snapshot().clone()];
    let mut prior = ActionPrior {
        version: ActionPrior::VERSION,
        task: task.name.clone(),
        model: model_name.to_owned(),
        seed,
        config: config.clone(),
        stages: Vec::new(),
    };
    let environment_rollouts = config.environment_rollouts.div_ceil((stages - 1).max(1));
    for stage in 0..stages {
        if !progress(stage) {
            return None;
        }
        let mut rng = Stream::PriorStage(stage).of(seed);
        let mut built = imagine(task, model, config, &starts, &mut rng);
        if stage + 1 < stages {
            built.environment_rollouts = environment_rollouts;
            let (reached, last) =
                explore(&mut env, &built, stage, config.horizon, &starts, environment_rollouts, &mut rng);
            built.environment_hits = reached.len();
            let wanted = if config.start_states == StartStates::Last || reached.is_empty() { last } else { reached };
            if !wanted.is_empty() {
                starts = wanted;
            }
        }
        prior.stages.push(built);
    }
    Some(prior)
}

/// Step 2: random actions rolled out in the model, the rewarding ones clustered.
fn imagine(
    task: &Arc<Task>,
    model: &dyn RolloutModel,
    config: &GuidanceConfig,
    starts: &[Snapshot],
    rng: &mut ChaCha8Rng,
) -> StagePrior {
    let chosen: Vec<&Snapshot> = (0..config.model_rollouts).map(|_| &starts[rng.gen_range(0..starts.len())]).collect();
    let sequences: Vec<Vec<Action>> =
        chosen.iter().map(|_| (0..config.horizon).map(|_| uniform(rng)).collect()).collect();
    let rollouts = model.rollouts(task, &chosen, &sequences);
    let actions: Vec<Action> = rollouts.iter().flat_map(|rollout| rollout.rewarding(config.rewarding)).collect();
    StagePrior {
        clusters: cluster(&actions, config.clusters, config.std_floor, rng),
        actions,
        model_rollouts: rollouts.len(),
        model_hits: rollouts.iter().filter(|rollout| rollout.hit).count(),
        ..StagePrior::default()
    }
}

/// Step 3: actions from the clusters in the real environment. Returns the states in
/// which the stage was reached and the last states of all rollouts, of those that can go on.
fn explore(
    env: &mut Environment,
    prior: &StagePrior,
    stage: usize,
    horizon: usize,
    starts: &[Snapshot],
    rollouts: usize,
    rng: &mut ChaCha8Rng,
) -> (Vec<Snapshot>, Vec<Snapshot>) {
    let (mut reached, mut last) = (Vec::new(), Vec::new());
    for _ in 0..rollouts {
        env.restore(&starts[rng.gen_range(0..starts.len())]);
        for _ in 0..horizon {
            if env.step(prior.sample(rng)).is_err() || env.snapshot().stage() > stage {
                break;
            }
        }
        let end = env.snapshot();
        if end.end().is_none() {
            last.push(end.clone());
        }
        if end.stage() > stage && end.end().is_none() {
            reached.push(end.clone());
        }
    }
    (reached, last)
}

/// An action drawn uniformly.
pub(super) fn uniform(rng: &mut impl Rng) -> Action {
    [rng.gen_range(-1.0..=1.0), rng.gen_range(-1.0..=1.0)]
}
