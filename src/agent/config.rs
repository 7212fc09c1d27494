//! The settings of DDPG (paper, section 5.3 and table 2) and what is wrong with them, if anything.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::nn::{Activation, OptimiserKind};

/// Settings of [`Ddpg`](super::Ddpg) and [`Learner`](super::Learner). The defaults are the
/// measured choices; where the paper differs, its value is named and can be set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DdpgConfig {
    /// Linear layers of each network, the output layer included. Paper: 3 of {3, 6, 10}.
    pub layers: usize,
    /// Width of the hidden layers. Paper: 64.
    pub hidden: usize,
    /// Activation of the hidden layers; the actor ends in tanh. The paper does not say.
    pub activation: Activation,
    /// Bound of the uniform initial weights and biases of the output layers. The paper does not
    /// say; 0.003 as in DDPG's own paper.
    pub output_init_bound: f32,
    /// Learning rate of the actor. Paper: 1e-4 of {1e-3, 1e-4, 1e-5}.
    pub actor_learning_rate: f32,
    /// Learning rate of the critic. Paper: 1e-4 of {1e-3, 1e-4, 1e-5}; 1e-3 learns sooner.
    pub critic_learning_rate: f32,
    /// Transitions of an update. Paper: 128 of {32, 64, 128, 256}.
    pub batch_size: usize,
    /// Optimiser of both networks. Paper: Adam of {Adam, SGD, RMSprop}.
    pub optimiser: OptimiserKind,
    /// Discount of future rewards. The paper does not say.
    pub gamma: f32,
    /// Part of the way that the target networks go towards the online ones in an update. The
    /// paper does not say.
    pub tau: f32,
    /// Transitions that the replay buffer holds. The paper does not say.
    pub replay_capacity: usize,
    /// Transitions recorded before the first update. The paper does not say.
    pub warmup_steps: usize,
    /// Updates for every transition recorded after that. The paper does not say.
    pub updates_per_step: usize,
    /// Range `[low, high]` that the critic's target is clamped to, `null` for none. It should
    /// hold every return that can be earned. The paper does not say; without it the critic can
    /// diverge.
    pub target_clamp: Option<[f32; 2]>,
    /// The exploration noise.
    pub ou: OuConfig,
}

/// Parameters of [`OrnsteinUhlenbeck`](super::OrnsteinUhlenbeck).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OuConfig {
    /// Pull towards the mean in a step. Paper: 0.15 of {0.1, 0.15, 0.2}.
    pub theta: f32,
    /// Mean. Paper: 0.0 of {0.0, 0.1, 0.2}.
    pub mu: f32,
    /// Standard deviation of a step's kick. Paper: 0.2 of {0.1, 0.2, 0.4}.
    pub sigma: f32,
}

impl Default for DdpgConfig {
    fn default() -> Self {
        Self {
            layers: 3,
            hidden: 64,
            activation: Activation::Relu,
            output_init_bound: 3e-3,
            actor_learning_rate: 1e-4,
            critic_learning_rate: 1e-3,
            batch_size: 128,
            optimiser: OptimiserKind::Adam,
            gamma: 0.95,
            tau: 0.005,
            replay_capacity: 100_000,
            warmup_steps: 500,
            updates_per_step: 1,
            target_clamp: Some([-1.0, 16.0]),
            ou: OuConfig::default(),
        }
    }
}

impl Default for OuConfig {
    fn default() -> Self {
        Self { theta: 0.15, mu: 0.0, sigma: 0.2 }
    }
}

/// A setting outside of its range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("`{field}` is {value}, but must be {requirement}")]
pub struct ConfigError {
    /// Path of the field, such as `ou.theta`.
    pub field: &'static str,
    /// Its value as text.
    pub value: String,
    /// What is allowed.
    pub requirement: &'static str,
}

impl DdpgConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// Names the first field that is out of its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        count("layers", self.layers, 1, 100, "between 1 and 100")?;
        count("hidden", self.hidden, 1, 4096, "between 1 and 4096")?;
        number("output_init_bound", self.output_init_bound, |x| x > 0.0, "positive")?;
        number("actor_learning_rate", self.actor_learning_rate, |x| x > 0.0, "positive")?;
        number("critic_learning_rate", self.critic_learning_rate, |x| x > 0.0, "positive")?;
        count("batch_size", self.batch_size, 1, 65_536, "between 1 and 65536")?;
        number("gamma", self.gamma, |x| (0.0..=1.0).contains(&x), "between 0 and 1")?;
        number("tau", self.tau, |x| x > 0.0 && x <= 1.0, "above 0 and at most 1")?;
        count("replay_capacity", self.replay_capacity, 1, 100_000_000, "between 1 and 100000000")?;
        count("updates_per_step", self.updates_per_step, 1, 1000, "between 1 and 1000")?;
        if let Some([low, high]) = self.target_clamp
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return Err(ConfigError {
                field: "target_clamp",
                value: format!("[{low}, {high}]"),
                requirement: "two finite numbers, the lower first, or null",
            });
        }
        self.ou.validate()
    }
}

impl OuConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        // From 2 on the process would run away from its mean.
        number("ou.theta", self.theta, |x| x > 0.0 && x < 2.0, "above 0 and below 2")?;
        number("ou.mu", self.mu, |x| (-1.0..=1.0).contains(&x), "between -1 and 1")?;
        number("ou.sigma", self.sigma, |x| x >= 0.0, "0 or positive")
    }
}

fn number(
    field: &'static str,
    value: f32,
    allowed: impl Fn(f32) -> bool,
    requirement: &'static str,
) -> Result<(), ConfigError> {
    if value.is_finite() && allowed(value) {
        return Ok(());
    }
    Err(ConfigError { field, value: value.to_string(), requirement })
}

fn count(
    field: &'static str,
    value: usize,
    least: usize,
    most: usize,
    requirement: &'static str,
) -> Result<(), ConfigError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(ConfigError { field, value: value.to_string(), requirement })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_survive_json() {
        let config = DdpgConfig::default();
        config.validate().unwrap();
        let json = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<DdpgConfig>(&json).unwrap(), config);
    }

    #[test]
    fn the_paper_s_sweep_is_selectable() {
        for (layers, batch_size, rate, optimiser, ou) in [
            (3, 32, "1e-3", "adam", r#"{"theta": 0.1, "mu": 0.1, "sigma": 0.1}"#),
            (6, 64, "1e-4", "sgd", r#"{"theta": 0.2, "mu": 0.2, "sigma": 0.4}"#),
            (10, 256, "1e-5", "rmsprop", "{}"),
        ] {
            let json = format!(
                r#"{{"layers": {layers}, "batch_size": {batch_size}, "actor_learning_rate": {rate},
                     "critic_learning_rate": {rate}, "optimiser": "{optimiser}", "ou": {ou}}}"#
            );
            serde_json::from_str::<DdpgConfig>(&json).unwrap().validate().unwrap();
        }
    }

    #[test]
    fn an_unknown_setting_is_refused() {
        let error = serde_json::from_str::<DdpgConfig>(r#"{"gama": 0.9}"#).unwrap_err();
        assert!(error.to_string().contains("unknown field `gama`"), "{error}");
    }

    #[test]
    fn each_wrong_setting_is_named() {
        for (json, message) in [
            (r#"{"layers": 0}"#, "`layers` is 0, but must be between 1 and 100"),
            (r#"{"hidden": 0}"#, "`hidden` is 0, but must be between 1 and 4096"),
            (r#"{"output_init_bound": 0}"#, "`output_init_bound` is 0, but must be positive"),
            (r#"{"actor_learning_rate": -1}"#, "`actor_learning_rate` is -1, but must be positive"),
            (r#"{"critic_learning_rate": 0}"#, "`critic_learning_rate` is 0, but must be positive"),
            (r#"{"batch_size": 0}"#, "`batch_size` is 0, but must be between 1 and 65536"),
            (r#"{"gamma": 1.5}"#, "`gamma` is 1.5, but must be between 0 and 1"),
            (r#"{"tau": 0}"#, "`tau` is 0, but must be above 0 and at most 1"),
            (r#"{"replay_capacity": 0}"#, "`replay_capacity` is 0, but must be between 1 and 100000000"),
            (r#"{"updates_per_step": 0}"#, "`updates_per_step` is 0, but must be between 1 and 1000"),
            (
                r#"{"target_clamp": [2, 1]}"#,
                "`target_clamp` is [2, 1], but must be two finite numbers, the lower first, or null",
            ),
            (r#"{"ou": {"theta": 2}}"#, "`ou.theta` is 2, but must be above 0 and below 2"),
            (r#"{"ou": {"mu": 3}}"#, "`ou.mu` is 3, but must be between -1 and 1"),
            (r#"{"ou": {"sigma": -1}}"#, "`ou.sigma` is -1, but must be 0 or positive"),
        ] {
            let config: DdpgConfig = serde_json::from_str(json).unwrap();
            assert_eq!(config.validate().unwrap_err().to_string(), message);
        }
        let config = DdpgConfig { gamma: f32::NAN, ..DdpgConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "gamma");
    }
}
