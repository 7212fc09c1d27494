//! Settings of an agent.

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
            "target_clamp: is [2, 1], but must be two numbers from -1e9 to 1e9, the lower first, or null",
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
