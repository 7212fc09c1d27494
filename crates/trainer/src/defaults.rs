//! The default settings of each method.

use std::sync::Arc;

use super::config::RunConfig;
use super::method::{Method, PriorSource};
use super::parts::Observation;
use super::setting::non_default_settings;
use mge_agent::DdpgConfig;
use mge_env::{BALL_POSITION, TARGET_POSITION};
use mge_guidance::{ClusterCount, EpsilonSchedule, GuidanceConfig};
use mge_nn::Activation;
use mge_physics::ToolSplit;
use mge_task::{Task, TaskError, load_all};

impl Method {
    /// The default method wherever none is named, for an agent that chooses among `tools`, if given.
    pub fn usual(tools: Option<ToolSplit>) -> Self {
        if tools.is_some() { Self::DdpgUniformAdaptive } else { Self::DdpgMgeAdaptive }
    }
}

impl RunConfig {
    /// The default configuration for a task, of the default method.
    pub fn usual_for(task: Arc<Task>) -> Self {
        Self::default_for(task, Method::usual(None))
    }

    /// The default configuration of a method for a task.
    pub fn default_for(task: Arc<Task>, method: Method) -> Self {
        Self::default_with(task, method, None)
    }

    /// The default configuration of a method for a task, with an agent that chooses among `tools`, if given.
    pub fn default_with(task: Arc<Task>, method: Method, tools: Option<ToolSplit>) -> Self {
        let mut config = Self { method, tools, ..Self::new(task) };
        if method.is_adaptive() {
            adapt(&mut config);
        }
        if tools.is_some() {
            // Observations are many times as long, so limit the memory and the time of an update.
            (config.ddpg.replay_capacity, config.ddpg.hidden) = (50_000, DdpgConfig::default().hidden);
            config.ddpg.action_origin = config.ddpg.action_origin.map(|_| TARGET_POSITION);
            config.refinement.every = 0;
            config.prior = PriorSource::TruePhysics;
            // Rewarding actions are more diverse than with a single tool.
            (config.guidance.model_rollouts, config.guidance.clusters) = (5000, ClusterCount::Fixed(10));
            config.guidance.longest_horizon = GuidanceConfig::default().longest_horizon;
        }
        config
    }

    /// The configuration with another method. Settings with the old method's default value get the new
    /// method's default; other settings stay.
    pub fn with_method(&self, method: Method) -> Self {
        self.changed_to(method, self.tools)
    }

    /// The configuration with an agent that chooses among other tools, or uses the task's own. Settings change as
    /// in [`with_method`](Self::with_method).
    pub fn with_tools(&self, tools: Option<ToolSplit>) -> Self {
        self.changed_to(self.method, tools)
    }

    /// The configuration with the tasks of these task files and folders, separated by commas, as further tasks. The
    /// agent then observes by rays and no policy is held, as several tasks require. A task with the name of the run's
    /// own is left out.
    ///
    /// # Errors
    /// When a file is not a valid task, or a folder has none.
    pub fn with_more_tasks(&self, from: &str) -> Result<Self, TaskError> {
        let mut config = Self { more_tasks: from.to_owned(), further_tasks: Vec::new(), ..self.clone() };
        for place in from.split(',').map(str::trim).filter(|place| !place.is_empty()) {
            for task in load_all(place)? {
                // Folders usually contain the run's task itself, which may have been edited since.
                if task.name != self.task.name {
                    config.further_tasks.push(Arc::new(task));
                }
            }
        }
        config.share();
        Ok(config)
    }

    /// Sets what several tasks require.
    fn share(&mut self) {
        if !self.further_tasks.is_empty() {
            (self.observation, self.hold_tolerance) = (Observation::Rays, None);
            // The scores of evaluations are comparable if each plays every task.
            self.evaluation.episodes = self.evaluation.episodes.max(self.tasks().count() as u32);
        }
    }

    fn changed_to(&self, method: Method, tools: Option<ToolSplit>) -> Self {
        let mut config = Self::default_with(self.task.clone(), method, tools);
        (config.more_tasks, config.further_tasks) = (self.more_tasks.clone(), self.further_tasks.clone());
        let is_other = |key: &str| !["method", "tools", "more_tasks", "prior"].contains(&key);
        if self.prior != Self::default_with(self.task.clone(), self.method, self.tools).prior {
            config.prior = self.prior.clone();
        }
        for (key, value) in non_default_settings(self).iter().filter(|(key, _)| is_other(key)) {
            // A value of one configuration is also valid in another.
            config = config.with_unchecked_setting(key, value).unwrap_or(config);
        }
        config.share();
        config
    }
}

/// The settings of the adaptive methods, from the search that `docs/results.md` describes.
fn adapt(config: &mut RunConfig) {
    // Without clusters, stronger noise takes over their share of the exploration.
    let (clusters, noise, sigma) = if config.method.has_clusters() { (0.5, 0.25, 0.1) } else { (0.0, 0.75, 0.3) };
    config.epsilon = EpsilonSchedule::Need { clusters, noise, attempts: 20 };
    config.noise_decay.final_scale = 1.0;
    (config.refinement.every, config.refinement.least) = (50, 8);
    config.practice.rollouts = 200;
    // Longer than the episodes of most tasks, which limit it too.
    config.guidance.longest_horizon = 32;
    (config.hold_tolerance, config.mastered_update_interval) = (Some(0.1), 4);
    let ddpg = &mut config.ddpg;
    (ddpg.tau, ddpg.warmup_steps, ddpg.output_init_bound, ddpg.ou.sigma) = (0.02, 128, 0.1, sigma);
    (ddpg.imitation.share, ddpg.imitation.weight) = (0.25, 1.0);
    (ddpg.hidden, ddpg.activation, ddpg.action_origin) = (128, Activation::RmsRelu, Some(BALL_POSITION));
}
