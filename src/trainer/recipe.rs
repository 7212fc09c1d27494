//! The settings that belong to a method: what a run of it has unless something else is asked for.

use std::sync::Arc;

use super::config::RunConfig;
use super::method::Method;
use super::setting::unusual_settings;
use crate::env::BALL_POSITION;
use crate::guidance::EpsilonSchedule;
use crate::nn::Activation;
use crate::task::Task;

impl RunConfig {
    /// The usual configuration of a method for a task.
    pub fn usual(task: Arc<Task>, method: Method) -> Self {
        let mut config = Self { method, ..Self::new(task) };
        if method.is_adaptive() {
            adapt(&mut config);
        }
        config
    }

    /// The configuration with another method. Settings that are the usual ones of the method so far
    /// become those of the other; what was chosen otherwise stays.
    pub fn with_method(&self, method: Method) -> Self {
        let mut config = Self::usual(self.task.clone(), method);
        for (key, value) in unusual_settings(self).iter().filter(|(key, _)| key != "method") {
            // What one configuration holds, another can hold.
            config = config.with_unchecked_setting(key, value).unwrap_or(config);
        }
        config
    }
}

/// The settings of the adaptive methods, from the search that `docs/results.md` describes.
fn adapt(config: &mut RunConfig) {
    // Without clusters the noise explores in their place.
    let (clusters, noise) = if config.method.has_clusters() { (0.5, 0.25) } else { (0.0, 0.75) };
    config.epsilon = EpsilonSchedule::Need { clusters, noise, attempts: 20 };
    config.noise_decay.final_scale = 1.0;
    config.refinement.every = 50;
    config.actor_rate_decay.final_scale = 0.05;
    config.hold_tolerance = Some(0.1);
    let ddpg = &mut config.ddpg;
    (ddpg.tau, ddpg.warmup_steps, ddpg.output_init_bound, ddpg.ou.sigma) = (0.02, 128, 0.1, 0.1);
    (ddpg.imitation.share, ddpg.imitation.weight) = (0.25, 1.0);
    (ddpg.activation, ddpg.action_origin) = (Activation::RmsRelu, Some(BALL_POSITION));
}
