//! Physics and environment against measurements of CREATE (`tests/data/create`).

use std::io::BufReader;

use mge::protocol;
use serde_json::Value;

const LAUNCHES: &str = include_str!("data/create/launches.jsonl");
const SCENES: &str = include_str!("data/create/scenes.jsonl");
const LEVELS: &str = include_str!("data/create/levels.jsonl");
const EPISODES: &str = include_str!("data/create/episodes.jsonl");

/// The records with our answers beside them.
fn pairs(records: &str, answers: &[u8]) -> Vec<(Value, Value)> {
    let parse = |text: &str| -> Vec<Value> { text.lines().map(|line| serde_json::from_str(line).unwrap()).collect() };
    let (records, answers) = (parse(records), parse(std::str::from_utf8(answers).unwrap()));
    assert_eq!(records.len(), answers.len());
    let pairs: Vec<_> = records.into_iter().zip(answers).collect();
    assert!(pairs.iter().all(|(theirs, ours)| theirs["id"] == ours["id"]));
    pairs
}

fn simulated(records: &str) -> Vec<(Value, Value)> {
    let mut answers = Vec::new();
    protocol::simulate(records.as_bytes(), &mut answers).unwrap();
    pairs(records, &answers)
}

fn row(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Normalised distance of the positions of two rows.
fn distance(theirs: &Value, ours: &Value) -> f64 {
    let (theirs, ours) = (row(theirs), row(ours));
    (theirs[0] - ours[0]).hypot(theirs[1] - ours[1]) * 2.0 / 84.0
}

/// The largest distance along a trajectory.
fn largest(theirs: &Value, ours: &Value) -> f64 {
    let rows = |record: &Value| record["traj"].as_array().unwrap().clone();
    let (theirs, ours) = (rows(theirs), rows(ours));
    assert_eq!(theirs.len(), ours.len());
    theirs.iter().zip(&ours).map(|(theirs, ours)| distance(theirs, ours)).fold(0.0, f64::max)
}

#[test]
fn launches_agree_at_every_step() {
    for (theirs, ours) in simulated(LAUNCHES) {
        let id = &theirs["id"];
        assert_eq!(theirs["first_contact"], ours["first_contact"], "{id}: first contact");
        assert_eq!(theirs["captured_step"], ours["captured_step"], "{id}: capture");
        let error = largest(&theirs, &ours);
        assert!(error < 1e-5, "{id}: {error}");
    }
}

#[test]
fn scenes_agree_at_every_step() {
    let mut errors = Vec::new();
    for (theirs, ours) in simulated(SCENES) {
        let id = &theirs["id"];
        assert_eq!(theirs["first_contact"], ours["first_contact"], "{id}: first contact");
        assert_eq!(theirs["captured_step"], ours["captured_step"], "{id}: capture");
        errors.push(largest(&theirs, &ours));
    }
    errors.sort_by(f64::total_cmp);
    // A grazing contact can be found a step earlier or later, which is worth up to 1e-3.
    assert!(errors[errors.len() / 2] < 1e-5, "median {}", errors[errors.len() / 2]);
    assert!(errors[errors.len() - 2] < 1e-4, "all but one {}", errors[errors.len() - 2]);
    assert!(errors[errors.len() - 1] < 2e-3, "largest {}", errors[errors.len() - 1]);
}

#[test]
fn episodes_agree_in_every_rule() {
    let mut answers = Vec::new();
    protocol::play_episodes(LEVELS.as_bytes(), "levels", BufReader::new(EPISODES.as_bytes()), &mut answers).unwrap();
    let mut errors = Vec::new();
    for (theirs, ours) in pairs(EPISODES, &answers) {
        let steps = |record: &Value| record["steps"].as_array().unwrap().clone();
        let (id, theirs, ours) = (theirs["id"].clone(), steps(&theirs), steps(&ours));
        assert_eq!(theirs.len(), ours.len(), "{id}: length");
        for (number, (theirs, ours)) in theirs.iter().zip(&ours).enumerate() {
            for key in ["outcome", "goal_hit", "subgoals_hit", "placed_tools"] {
                assert_eq!(theirs[key], ours[key], "{id}, action {number}: {key}");
            }
            let reward = |step: &Value| step["reward"].as_f64().unwrap();
            assert!((reward(theirs) - reward(ours)).abs() < 1e-4, "{id}, action {number}: reward");
            let is_over = ours["terminated"] == true || ours["truncated"] == true;
            assert_eq!(theirs["done"], is_over, "{id}, action {number}: done");
            if is_over {
                let only_limit = theirs["done_reasons"] == serde_json::json!(["max_steps"]);
                assert_eq!(ours["truncated"], only_limit, "{id}: truncated");
            }
            let names = theirs["balls"].as_object().unwrap();
            errors.extend(names.iter().map(|(name, theirs)| distance(theirs, &ours["balls"][name])));
        }
    }
    errors.sort_by(f64::total_cmp);
    let quantile = |share: f64| errors[(share * errors.len() as f64) as usize];
    assert!(quantile(0.5) < 1e-5, "median {}", quantile(0.5));
    assert!(quantile(0.95) < 1e-3, "95th percentile {}", quantile(0.95));
}
