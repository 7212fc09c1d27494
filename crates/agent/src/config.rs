//! The settings of DDPG (paper, section 5.3 and table 2) and their validation.

use educe::Educe;
use serde::{Deserialize, Serialize};

use super::replay::MAX_CAPACITY;
use mge_base::validation::{Range, Setting, ValidationError, check_settings};
use mge_nn::{Activation, OptimiserKind};

/// Settings of [`Ddpg`](super::Ddpg) and [`Learner`](super::Learner). The defaults were chosen by
/// measurement; where the paper differs, its value is given and can be set.
#[derive(Clone, Debug, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(default, deny_unknown_fields)]
pub struct DdpgConfig {
    /// Linear layers of each network, including the output layer. Paper: 3 of {3, 6, 10}.
    #[educe(Default = 3)]
    pub layers: usize,
    /// Width of the hidden layers. Paper: 64.
    #[educe(Default = 64)]
    pub hidden: usize,
    /// Activation of the hidden layers; the actor ends in tanh. Not given in the paper.
    #[educe(Default = Activation::Relu)]
    pub activation: Activation,
    /// Index in the observation of the point that actions are measured from; `null` to measure them
    /// from 0. If set, the networks' action inputs and outputs are relative to that point.
    pub action_origin: Option<usize>,
    /// Bound of the uniform initial weights and biases of the output layers. Not given in the paper;
    /// 0.003 as in the original DDPG paper.
    #[educe(Default = 3e-3)]
    pub output_init_bound: f32,
    /// Learning rate of the actor. Paper: 1e-4 of {1e-3, 1e-4, 1e-5}.
    #[educe(Default = 1e-4)]
    pub actor_learning_rate: f32,
    /// Learning rate of the critic. Paper: 1e-4 of {1e-3, 1e-4, 1e-5}; 1e-3 learns faster.
    #[educe(Default = 1e-3)]
    pub critic_learning_rate: f32,
    /// Transitions per update. Paper: 128 of {32, 64, 128, 256}.
    #[educe(Default = 128)]
    pub batch_size: usize,
    /// Optimiser of both networks. Paper: Adam of {Adam, SGD, RMSprop}.
    pub optimiser: OptimiserKind,
    /// Discount factor. Not given in the paper.
    #[educe(Default = 0.95)]
    pub gamma: f32,
    /// Fraction by which the target networks move towards the online networks in each update. Not
    /// given in the paper.
    #[educe(Default = 0.005)]
    pub tau: f32,
    /// Capacity of the replay buffer, in transitions. Not given in the paper.
    #[educe(Default = 100_000)]
    pub replay_capacity: usize,
    /// Transitions recorded before the first update. Not given in the paper.
    #[educe(Default = 500)]
    pub warmup_steps: usize,
    /// Updates per recorded transition after the warm-up. Not given in the paper.
    #[educe(Default = 1)]
    pub updates_per_step: usize,
    /// Range `[low, high]` that the critic's target is clamped to, `null` for none. It should
    /// contain every possible return. Not given in the paper; without it the critic can diverge.
    #[educe(Default = Some([-1.0, 16.0]))]
    pub target_clamp: Option<[f32; 2]>,
    /// The exploration noise.
    pub ou: OuConfig,
    /// Imitation of segments that reached their stage.
    pub imitation: ImitationConfig,
}

/// Imitation of segments: the transitions of an episode between one reached stage and the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImitationConfig {
    /// Share of a minibatch that is drawn from segments that reached their stage, with equal
    /// probability for every stage; 0 for none.
    pub share: f32,
    /// Weight of imitating the segments' actions in the actor's loss, for actions that the critic
    /// values more than the actor's own (Q filter, Nair et al., 2018); 0 for none.
    pub weight: f32,
}

/// Parameters of [`OrnsteinUhlenbeck`](super::OrnsteinUhlenbeck).
#[derive(Clone, Copy, Debug, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(default, deny_unknown_fields)]
pub struct OuConfig {
    /// Rate of return to the mean, per step. Paper: 0.15 of {0.1, 0.15, 0.2}.
    #[educe(Default = 0.15)]
    pub theta: f32,
    /// Mean. Paper: 0.0 of {0.0, 0.1, 0.2}.
    pub mu: f32,
    /// Standard deviation of the random increment, per step. Paper: 0.2 of {0.1, 0.2, 0.4}.
    #[educe(Default = 0.2)]
    pub sigma: f32,
}

/// The numeric settings of [`DdpgConfig`].
pub const SETTINGS: [Setting; 18] = [
    Setting::count("layers", 1, 32, "linear layers of each network, the output layer included"),
    Setting::count("hidden", 1, 1024, "width of the hidden layers"),
    Setting::new("action_origin", Range::CountOrNull(0, 1 << 20), "place in the observation of the origin of actions"),
    Setting::number("output_init_bound", 1e-9, 10.0, "bound of the initial weights and biases of the output layers"),
    Setting::number("actor_learning_rate", 1e-12, 1e3, "learning rate of the actor"),
    Setting::number("critic_learning_rate", 1e-12, 1e3, "learning rate of the critic"),
    Setting::count("batch_size", 1, 65_536, "transitions of an update"),
    Setting::number("gamma", 0.0, 1.0, "discount of future rewards"),
    Setting::number("tau", 1e-6, 1.0, "share by which an update moves the target networks to the online networks"),
    Setting::count("replay_capacity", 1, MAX_CAPACITY as u64, "transitions that the replay buffer holds"),
    Setting::count("warmup_steps", 0, 1_000_000_000, "transitions recorded before the first update"),
    Setting::count(
        "updates_per_step",
        1,
        1000,
        "updates for every transition recorded after that; with exploration by need at most, in proportion to the need",
    ),
    Setting::new("target_clamp", Range::IntervalOrNull(-1e9, 1e9), "range to which the critic's target is clamped"),
    // From 2 on, the process diverges from its mean.
    Setting::number("ou.theta", 1e-6, 1.999, "pull of the exploration noise towards its mean in a step"),
    Setting::number("ou.mu", -1.0, 1.0, "mean of the exploration noise"),
    Setting::number("ou.sigma", 0.0, 10.0, "standard deviation of a step's random increment of the exploration noise"),
    Setting::number("imitation.share", 0.0, 1.0, "share of a minibatch from segments that reached their stage"),
    Setting::number("imitation.weight", 0.0, 1000.0, "weight of the imitation of their actions in the actor's loss"),
];

impl DdpgConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// Names the first setting that is out of its range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        check_settings(self, &SETTINGS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_round_trip_through_json() {
        let config = DdpgConfig::default();
        config.validate().unwrap();
        let json = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<DdpgConfig>(&json).unwrap(), config);
    }

    #[test]
    fn the_paper_s_sweep_values_are_accepted() {
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
            (r#"{"layers": 0}"#, "layers: is 0, but must be a whole number from 1 to 32"),
            (r#"{"hidden": 1025}"#, "hidden: is 1025, but must be a whole number from 1 to 1024"),
            (r#"{"output_init_bound": 0}"#, "output_init_bound: is 0, but must be a number from 1e-9 to 10"),
            (r#"{"actor_learning_rate": -1}"#, "actor_learning_rate: is -1, but must be a number from 1e-12 to 1000"),
            (r#"{"batch_size": 0}"#, "batch_size: is 0, but must be a whole number from 1 to 65536"),
            (r#"{"gamma": 1.5}"#, "gamma: is 1.5, but must be a number from 0 to 1"),
            (r#"{"tau": 0}"#, "tau: is 0, but must be a number from 1e-6 to 1"),
            (r#"{"replay_capacity": 0}"#, "replay_capacity: is 0, but must be a whole number from 1 to 10000000"),
            (
                r#"{"target_clamp": [2, 1]}"#,
                "target_clamp: is [2, 1], but must be two numbers from -1e9 to 1e9, the lower first, or none",
            ),
            (r#"{"ou": {"theta": 2}}"#, "ou.theta: is 2, but must be a number from 1e-6 to 1.999"),
            (r#"{"ou": {"sigma": -1}}"#, "ou.sigma: is -1, but must be a number from 0 to 10"),
        ] {
            let config: DdpgConfig = serde_json::from_str(json).unwrap();
            assert_eq!(config.validate().unwrap_err().to_string(), message);
        }
        let config = DdpgConfig { gamma: f32::NAN, ..DdpgConfig::default() };
        assert_eq!(config.validate().unwrap_err().path, "gamma");
    }
}
