//! Compares physics and environment with recordings of CREATE (`tests/data/create`).

use mge::physics::{NO_OP, ToolSplit, catalogue_tool};
use mge::protocol::{self, Catalogue};
use serde_json::Value;

const LAUNCHES: &str = include_str!("../data/create/launches.jsonl");
const SCENES: &str = include_str!("../data/create/scenes.jsonl");
const LEVELS: &str = include_str!("../data/create/levels.jsonl");
const EPISODES: &str = include_str!("../data/create/episodes.jsonl");

/// Pairs of records and our answers.
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

/// Normalised distance between the positions of two rows.
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

/// The id and the largest error of each record. Asserts that first contacts and captures agree.
fn errors(records: &str) -> Vec<(Value, f64)> {
    let compare = |(theirs, ours): (Value, Value)| {
        let id = &theirs["id"];
        assert_eq!(theirs["first_contact"], ours["first_contact"], "{id}: first contact");
        assert_eq!(theirs["captured_step"], ours["captured_step"], "{id}: capture");
        (id.clone(), largest(&theirs, &ours))
    };
    simulated(records).into_iter().map(compare).collect()
}

#[test]
fn launches_agree_at_every_step() {
    for (id, error) in errors(LAUNCHES) {
        assert!(error < 1e-5, "{id}: {error}");
    }
}

#[test]
fn scenes_agree_at_every_step() {
    let mut errors: Vec<f64> = errors(SCENES).into_iter().map(|(_, error)| error).collect();
    errors.sort_by(f64::total_cmp);
    // A grazing contact may be detected a step earlier or later, which changes positions by up to 1e-3.
    assert!(errors[errors.len() / 2] < 1e-5, "median {}", errors[errors.len() / 2]);
    assert!(errors[errors.len() - 2] < 1e-4, "all but one {}", errors[errors.len() - 2]);
    assert!(errors[errors.len() - 1] < 2e-3, "largest {}", errors[errors.len() - 1]);
}

/// The actions of the episodes, recorded and ours, each with its name. Asserts that rewards and the values of `keys`
/// agree.
fn played(levels: &str, catalogue: &Catalogue, episodes: &str, keys: &[&str]) -> Vec<(String, Value, Value)> {
    let mut answers = Vec::new();
    protocol::play_episodes(levels.as_bytes(), "levels", catalogue, episodes.as_bytes(), &mut answers).unwrap();
    let mut actions = Vec::new();
    for (theirs, ours) in pairs(episodes, &answers) {
        let steps = |record: &Value| record["steps"].as_array().unwrap().clone();
        let (id, theirs, ours) = (&theirs["id"], steps(&theirs), steps(&ours));
        assert_eq!(theirs.len(), ours.len(), "{id}: length");
        for (number, (theirs, ours)) in theirs.into_iter().zip(ours).enumerate() {
            let name = format!("{id}, action {number}");
            for key in keys {
                assert_eq!(theirs[*key], ours[*key], "{name}: {key}");
            }
            let reward = |step: &Value| step["reward"].as_f64().unwrap();
            assert!((reward(&theirs) - reward(&ours)).abs() < 1e-4, "{name}: reward");
            actions.push((name, theirs, ours));
        }
    }
    actions
}

#[test]
fn episodes_agree_in_every_rule() {
    let keys = ["outcome", "goal_hit", "subgoals_hit", "placed_tools"];
    let mut errors = Vec::new();
    for (name, theirs, ours) in played(LEVELS, &Catalogue::of_create(), EPISODES, &keys) {
        let is_over = ours["terminated"] == true || ours["truncated"] == true;
        assert_eq!(theirs["done"], is_over, "{name}: done");
        if is_over {
            let only_limit = theirs["done_reasons"] == serde_json::json!(["max_steps"]);
            assert_eq!(ours["truncated"], only_limit, "{name}: truncated");
        }
        let balls = theirs["balls"].as_object().unwrap();
        errors.extend(balls.iter().map(|(ball, theirs)| distance(theirs, &ours["balls"][ball])));
    }
    errors.sort_by(f64::total_cmp);
    let quantile = |share: f64| errors[(share * errors.len() as f64) as usize];
    assert!(quantile(0.5) < 1e-5, "median {}", quantile(0.5));
    assert!(quantile(0.95) < 1e-3, "95th percentile {}", quantile(0.95));
}

/// Decompresses a file of `data/create/all`: one JSON record per line.
fn all(bytes: &[u8]) -> String {
    // A gzip header has ten bytes, the trailer (checksum and length) eight.
    let body = &bytes[10..bytes.len() - 8];
    String::from_utf8(miniz_oxide::inflate::decompress_to_vec(body).unwrap()).unwrap()
}

/// The largest absolute difference between two rows.
fn difference(theirs: &Value, ours: &Value) -> f64 {
    row(theirs).iter().zip(row(ours)).map(|(theirs, ours)| (theirs - ours).abs()).fold(0.0, f64::max)
}

/// Compares every number of every body at every step, the first contact, sleeping and events.
fn assert_repeated(theirs: &Value, ours: &Value) {
    let id = &theirs["id"];
    let rows = |record: &Value| record.as_array().unwrap().clone();
    let mut bodies = vec![("traj".to_owned(), &theirs["traj"], &ours["traj"])];
    let parts = theirs["parts"].as_object().into_iter().flatten();
    bodies.extend(parts.map(|(name, rows)| (name.clone(), rows, &ours["parts"][name])));
    for (name, theirs, ours) in bodies {
        let (theirs, ours) = (rows(theirs), rows(ours));
        assert_eq!(theirs.len(), ours.len(), "{id}, {name}");
        for (step, (theirs, ours)) in theirs.iter().zip(&ours).enumerate() {
            let error = difference(theirs, ours);
            // Recordings are rounded to five decimals.
            assert!(error < 6e-6, "{id}, {name}, step {step}: {error}");
        }
    }
    assert_eq!(theirs["first_contact"], ours["first_contact"], "{id}: first contact");
    assert_eq!(theirs["sleep_steps"], ours["sleep_steps"], "{id}: sleepers");
    assert_eq!(theirs["events"], ours["events"], "{id}: events");
}

#[test]
fn launches_of_every_type_are_repeated_to_the_last_digit() {
    let launches = all(include_bytes!("../data/create/all/launches.jsonl.gz"));
    simulated(&launches).iter().for_each(|(theirs, ours)| assert_repeated(theirs, ours));
}

#[test]
fn scenes_of_every_type_are_repeated_to_the_last_digit() {
    let scenes = all(include_bytes!("../data/create/all/scenes.jsonl.gz"));
    simulated(&scenes).iter().for_each(|(theirs, ours)| assert_repeated(theirs, ours));
}

#[test]
fn episodes_with_action_sets_agree_in_every_rule() {
    let levels = all(include_bytes!("../data/create/all/levels.jsonl.gz"));
    let episodes = all(include_bytes!("../data/create/all/episodes.jsonl.gz"));
    let tools = all(include_bytes!("../data/create/all/tools.jsonl.gz"));
    let catalogue = Catalogue::read(tools.as_bytes(), "tools").unwrap();
    let keys = ["outcome", "goal_hit", "subgoals_hit", "placed_tools", "done_reasons"];
    played(&levels, &catalogue, &episodes, &keys);
}

#[test]
fn the_catalogue_is_that_of_create() {
    let tools = all(include_bytes!("../data/create/all/tools.jsonl.gz"));
    let mut split = ToolSplit::ALL.map(|_| Vec::new());
    for (number, line) in tools.lines().enumerate() {
        let record: Value = serde_json::from_str(line).unwrap();
        for name in record["split"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()) {
            split[name.parse::<ToolSplit>().unwrap() as usize].push(number);
        }
        let Some(tool) = catalogue_tool(number) else {
            assert_eq!((record["type"].as_str(), number), (Some("no_op"), NO_OP));
            continue;
        };
        assert_eq!(record["type"], tool.kind.name());
        for (name, ours) in [
            (tool.kind.measure(), tool.size),
            ("angle", tool.angle),
            ("elasticity", tool.elasticity),
            ("friction", tool.friction),
            ("force", tool.force),
            ("vel", tool.velocity),
            ("max_angle", tool.max_angle),
            ("ball_mass", tool.weight),
            ("roll_friction", tool.roll_friction),
        ] {
            let theirs = record[name].as_f64().unwrap_or(ours);
            assert_eq!(theirs, ours, "{number}, {name}");
        }
        assert_eq!(record["on_left"].as_bool().unwrap_or(tool.on_left), tool.on_left, "{number}");
    }
    for kind in [ToolSplit::Train, ToolSplit::Validation, ToolSplit::Test] {
        let theirs: Vec<usize> = split[kind as usize].iter().copied().filter(|number| *number != NO_OP).collect();
        assert_eq!(kind.tools(), theirs, "{kind}");
    }
}

#[test]
fn hostile_records_are_refused_with_the_path() {
    let scene = |tool: &str, more: &str| {
        format!(
            "{{\"id\":\"x\",\"tools\":[{tool}],\"mover\":{{\"shape\":\"ball\",\"radius\":4,\"mass\":10,\"elasticity\":1,\
             \"friction\":1}},\"steps\":10,\"traj\":[[42,70,0,0,0,0]]{more}}}"
        )
    };
    let tools = vec!["{\"type\":\"box\",\"size\":5,\"pos\":[1,1]}"; 10_000].join(",");
    for (record, path) in [
        (scene("{\"type\":\"ramp\",\"length\":0,\"pos\":[1,1]}", ""), "tools[0].length"),
        (scene("{\"type\":\"circle\",\"radius\":-1,\"pos\":[1,1]}", ""), "tools[0].radius"),
        (scene("{\"type\":\"cannon\",\"size\":10,\"force\":1e38,\"pos\":[1,1]}", ""), "tools[0].force"),
        (scene("{\"type\":\"fan\",\"size\":10,\"angle\":1e300,\"pos\":[1,1]}", ""), "tools[0].angle"),
        (scene("{\"type\":\"see_saw\",\"length\":10,\"ball_mass\":0,\"pos\":[1,1]}", ""), "tools[0].ball_mass"),
        (scene("{\"type\":\"box\",\"size\":5,\"pos\":[1e9,1]}", ""), "tools[0].position[0]"),
        (scene(&tools, ""), "tools: has 10000"),
        (
            scene("", ",\"others\":[{\"shape\":\"box\",\"size\":0,\"mass\":1,\"elasticity\":0,\"friction\":0}]"),
            "parts.mover1",
        ),
    ] {
        let error = protocol::simulate(record.as_bytes(), &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains(path), "{path}: {error:.300}");
    }
}
