//! The default method, and the default settings of each method.

use std::sync::{Arc, LazyLock};

use super::config::RunConfig;
use super::method::{Method, PriorSource};
use super::setting::non_default_settings;
use super::settings_file;
use mge_guidance::EpsilonSchedule;
use mge_task::{Task, shipped};

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

/// A configuration with the settings of the adaptive methods, from the search that `docs/results.md` describes.
pub(super) static ADAPTIVE: LazyLock<RunConfig> = LazyLock::new(|| {
    let task = shipped().into_iter().next().expect("there are shipped tasks");
    let mut settings = settings_file::parsed(settings_file::ADAPTIVE.as_bytes(), "adaptive").expect("a valid file");
    settings.retain(|(path, _)| path != "method");
    RunConfig::new(Arc::new(task)).with_settings(&settings).expect("valid settings")
});

/// Gives a configuration the settings of the adaptive methods.
fn adapt(config: &mut RunConfig) {
    *config = RunConfig { task: config.task.clone(), method: config.method, ..ADAPTIVE.clone() };
    // Without guidance, rewards are found only by exploring more, and without any clusters by stronger noise.
    if config.method.fixed_source() == Some(PriorSource::Uniform) {
        config.epsilon = EpsilonSchedule::Need { clusters: 0.5, noise: 0.25, attempts: 20 };
    } else if !config.method.has_clusters() {
        config.epsilon = EpsilonSchedule::Need { clusters: 0.0, noise: 0.75, attempts: 20 };
        config.ddpg.ou.sigma = 0.3;
    }
}
