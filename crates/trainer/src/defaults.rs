//! The default method, and the default settings of each method.

use std::sync::Arc;

use super::config::RunConfig;
use super::method::Method;
use super::setting::non_default_settings;
use mge_env::BALL_POSITION;
use mge_guidance::EpsilonSchedule;
use mge_nn::Activation;
use mge_task::Task;

impl Method {
    /// The default method wherever none is named.
    pub const USUAL: Self = Self::DdpgMgeAdaptive;
}

impl RunConfig {
    /// The default configuration for a task, of the default method.
    pub fn usual_for(task: Arc<Task>) -> Self {
        Self::default_for(task, Method::USUAL)
    }

    /// The default configuration of a method for a task.
    pub fn default_for(task: Arc<Task>, method: Method) -> Self {
        let mut config = Self { method, ..Self::new(task) };
        if method.is_adaptive() {
            adapt(&mut config);
        }
        config
    }

    /// The configuration with another method. Settings with the old method's default value get the new
    /// method's default; other settings stay.
    pub fn with_method(&self, method: Method) -> Self {
        let mut config = Self { prior: self.prior.clone(), ..Self::default_for(self.task.clone(), method) };
        for (key, value) in non_default_settings(self).iter().filter(|(key, _)| !["method", "prior"].contains(&&**key))
        {
            // A value of one configuration is also valid in another.
            config = config.with_unchecked_setting(key, value).unwrap_or(config);
        }
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
