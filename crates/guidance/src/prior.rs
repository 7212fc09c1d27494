//! The action prior of a task: clusters of rewarding actions for every stage.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::clusters::{Cluster, cluster};
use super::config::{GuidanceConfig, GuidanceError};
use super::rollout::RolloutModel;
use mge_base::atomic::Format;
use mge_base::json;
use mge_dynamics::Result;
use mge_env::{Action, uniform_action};
use mge_task::Task;

/// The clusters of one stage and the data they were made from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StagePrior {
    /// Clusters of rewarding actions, the largest first; empty if the model predicted none.
    pub clusters: Vec<Cluster>,
    /// The stored rewarding actions.
    pub actions: Vec<Action>,
    /// Number of model rollouts.
    pub model_rollouts: usize,
    /// Number of model rollouts predicted to reach the stage.
    pub model_hits: usize,
    /// Actions in a rollout, if longer ones than [`GuidanceConfig::horizon`] were necessary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longer_horizon: Option<usize>,
    /// Number of rollouts in the real environment (0 for the last stage).
    pub environment_rollouts: usize,
    /// Number of real rollouts that reached the stage and can continue from there.
    pub environment_hits: usize,
    /// Actions taken in the real environment: in these rollouts, and in those of the model if that is the true physics.
    /// Not those of practice, which are counted by the training.
    #[serde(default)]
    pub environment_actions: u64,
}

/// All clusters of a task, by stage: the distributions from which exploration samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionPrior {
    /// Version of the file format: [`VERSION`](Self::VERSION).
    pub version: u32,
    /// The task's name.
    pub task: String,
    /// Name of the model that predicted the rollouts.
    pub model: String,
    /// SHA-256 of the model's file, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_sha256: Option<String>,
    /// The seed of the build.
    pub seed: u64,
    /// The settings of the build.
    pub config: GuidanceConfig,
    /// Subgoals in order, then the goal.
    pub stages: Vec<StagePrior>,
}

impl ActionPrior {
    /// The format version that this program reads and writes.
    pub const VERSION: u32 = 1;

    /// Actions taken in the real environment to build it.
    pub fn environment_actions(&self) -> u64 {
        self.stages.iter().map(|stage| stage.environment_actions).sum()
    }

    /// Actions in a rollout towards a stage.
    pub fn horizon(&self, stage: usize) -> usize {
        self.stages.get(stage).and_then(|stage| stage.longer_horizon).unwrap_or(self.config.horizon)
    }

    /// A prior without clusters: every stage samples uniformly.
    pub fn uniform(task: &Task, config: &GuidanceConfig, seed: u64) -> Self {
        Self {
            version: Self::VERSION,
            task: task.name.clone(),
            model: "uniform".to_owned(),
            model_sha256: None,
            seed,
            config: config.clone(),
            stages: vec![StagePrior::default(); task.stage_count()],
        }
    }

    /// The prior with the name and hash of the model that predicts its rollouts.
    pub(super) fn of_model(self, model: &dyn RolloutModel) -> Self {
        Self { model: model.name(), model_sha256: model.sha256(), ..self }
    }

    /// A random action for a stage: a cluster is drawn by weight, then an action from its normal
    /// distribution. Uniform over [-1, 1]^2 if the stage has no cluster.
    pub fn sample(&self, stage: usize, rng: &mut impl Rng) -> Action {
        match self.stages.get(stage) {
            Some(stage) => stage.sample(rng),
            None => uniform_action(rng),
        }
    }

    /// Reads a prior that [`to_json`](Self::to_json) wrote and checks that it belongs to the task.
    ///
    /// # Errors
    /// When the text is not a prior, has another format version or belongs to another task, or
    /// contains values that are impossible for actions.
    pub fn parse(text: &str, origin: &str, task: &Task) -> Result<Self, GuidanceError> {
        let unusable = |problem| Err(GuidanceError::Unusable { origin: origin.to_owned(), problem });
        // Other versions may have other fields, so the version is read first.
        let Header { version } = json::parse(text.as_bytes(), origin)?;
        if version != Self::VERSION {
            let wanted = Self::VERSION;
            return unusable(format!(
                "the action prior has format version {version}, this program reads version {wanted}"
            ));
        }
        let prior: Self = json::parse(text.as_bytes(), origin)?;
        let (found, wanted) = (prior.stages.len(), task.stage_count());
        if prior.task != task.name || found != wanted {
            let Self { task: other, .. } = prior;
            return unusable(format!(
                "the action prior is for {other} with {found} stages, not for {} with {wanted}",
                task.name
            ));
        }
        if let Err(error) = prior.config.validate() {
            return unusable(format!("config.{error}"));
        }
        match prior.stages.iter().position(|stage| !stage.is_possible()) {
            Some(stage) => unusable(format!("the clusters or actions of stage {} are out of range", stage + 1)),
            None => Ok(prior),
        }
    }

    /// The prior with the clusters of one stage rebuilt from other actions, such as those that
    /// turned out to be rewarding in real play.
    ///
    /// # Errors
    /// When an action is not finite.
    pub fn with_actions(&self, stage: usize, actions: &[Action], rng: &ChaCha8Rng) -> Result<Self> {
        let mut refined = self.clone();
        if let Some(stage) = refined.stages.get_mut(stage) {
            stage.clusters = cluster(actions, &self.config, rng)?;
            stage.actions = actions.to_vec();
        }
        Ok(refined)
    }

    /// The format of files of clusters.
    pub const FORMAT: Format<'static> =
        Format { name: "a file of action clusters", is: &|found| serde_json::from_slice::<ActionPrior>(found).is_ok() };

    /// The JSON text of the prior, as it is saved.
    pub fn to_json(&self) -> String {
        mge_base::json::pretty(self)
    }
}

/// The fields common to all format versions.
#[derive(Deserialize)]
struct Header {
    version: u32,
}

impl StagePrior {
    /// Whether all values are possible for actions.
    fn is_possible(&self) -> bool {
        let within = |low: f32, values: &[f32]| values.iter().all(|value| (low..=1.0).contains(value));
        self.clusters.iter().all(|c| within(-1.0, &c.mean) && within(0.0, &c.std) && within(0.0, &[c.weight]))
            && self.actions.iter().all(|action| within(-1.0, action))
    }

    /// A random action for this stage, as in [`ActionPrior::sample`].
    pub fn sample(&self, rng: &mut impl Rng) -> Action {
        let mut share: f32 = rng.r#gen();
        let drawn = self.clusters.iter().find(|cluster| {
            share -= cluster.weight;
            share < 0.0
        });
        // If rounding leaves a remainder, take the last.
        match drawn.or(self.clusters.last()) {
            Some(cluster) => cluster.sample(rng),
            None => uniform_action(rng),
        }
    }
}
