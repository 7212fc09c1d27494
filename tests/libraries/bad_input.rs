//! Invalid scenes, tasks, recorded levels and episodes: each is refused with one clear line that gives the location.

use mge::protocol::{self, Catalogue};
use mge::task;
use serde_json::{Value, json};

/// The record with one change: `parent` is the JSON pointer of the parent, `new` the new value of `key` (`None` removes
/// the key).
fn changed(mut record: Value, parent: &str, key: &str, new: Option<Value>) -> String {
    let parent = record.pointer_mut(parent).expect("the parent exists");
    match (parent, new) {
        (Value::Object(map), Some(new)) => _ = map.insert(key.to_owned(), new),
        (Value::Object(map), None) => _ = map.remove(key),
        (Value::Array(list), Some(new)) => list[key.parse::<usize>().unwrap()] = new,
        _ => panic!("cannot change {key}"),
    }
    // A `Value` cannot hold such numbers, so the cases give them as strings.
    record.to_string().replace("\"1e999\"", "1e999").replace("\"1e300\"", "1e300")
}

/// Asserts that the message is one short line that contains all expected parts.
fn assert_says(message: &str, expected: &[&str]) {
    assert!(!message.contains('\n'), "more than one line: {message}");
    assert!(message.len() < 400, "too long: {message}");
    for part in expected {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

fn scene() -> Value {
    json!({
        "id": "a", "kind": "scene", "steps": 3,
        "tools": [
            {"type": "box", "pos_norm": [0.0, 0.0], "size": 8.0, "elasticity": 0.4, "friction": 1.0},
            {"type": "wall", "pos": [70.0, 42.0], "length": 16.0, "radius": 1.0}
        ],
        "ball": {"radius": 4.0, "mass": 10.0, "elasticity": 1.0, "friction": 1.0},
        "traj": [[42.0, 60.0, 0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0, 0.0, 0.0]],
    })
}

fn simulate(input: &str) -> Result<String, String> {
    let mut output = Vec::new();
    protocol::simulate(input.as_bytes(), &mut output).map_err(|error| error.to_string())?;
    Ok(String::from_utf8(output).unwrap())
}

#[test]
fn a_valid_scene_is_simulated() {
    let output = simulate(&format!("\n{}\n\n", scene())).unwrap();
    let answer: Value = serde_json::from_str(output.trim()).unwrap();
    assert_eq!(answer["id"], "a");
    assert_eq!(answer["traj"].as_array().unwrap().len(), 4);
    assert_eq!(answer["traj"][0], json!([42.0, 60.0, 0.0, 0.0, 0.0, 0.0]));
    assert_eq!((&answer["first_contact"], &answer["captured_step"]), (&Value::Null, &Value::Null));
}

#[test]
fn wrong_scenes() {
    let tool = json!({"type": "box", "pos_norm": [0.9, 0.9], "size": 2.0});
    let many = Value::Array(vec![tool; 10_000]);
    let cases = [
        ("", "ball", None, "ball: is missing: a scene has a `ball` or a `mover`"),
        ("", "mover", Some(scene()["ball"].clone()), "mover: cannot be given together with `ball`"),
        ("/ball", "radius", Some(json!(0.0)), "ball.radius: is 0"),
        ("/ball", "radius", Some(json!(-4.0)), "ball.radius: is -4"),
        ("/ball", "mass", Some(json!("1e999")), "`ball.mass`: number out of range"),
        ("/ball", "mass", Some(json!("1e300")), "ball.mass: is inf"),
        ("/ball", "elasticity", Some(json!(1.5)), "ball.elasticity: is 1.5"),
        ("/ball", "colour", Some(json!("red")), "`ball.colour`: unknown field `colour`"),
        ("", "tools", Some(many), "tools: has 10000 entries"),
        ("", "tools", Some(json!({})), "`tools`: invalid type: map"),
        ("/tools/0", "size", Some(json!(0)), "tools[0].size: is 0"),
        ("/tools/0", "size", None, "tools[0].size: is missing"),
        ("/tools/1", "length", None, "tools[1].length: is missing"),
        ("/tools/1", "length", Some(json!(0)), "tools[1].length: is 0"),
        ("/tools/0", "type", Some(json!("jug")), "tools[0].type: unknown tool `jug`"),
        ("/tools/0", "radius", Some(json!(4.0)), "tools[0].radius: does not belong to a box: remove it"),
        ("/tools/0", "force", Some(json!(4.0)), "tools[0].force: does not belong to a box: remove it"),
        ("/tools/1", "max_angle", Some(json!(0.1)), "tools[1].max_angle: does not belong to a wall: remove it"),
        ("/tools/0", "angel", Some(json!(0.0)), "`tools[0].angel`: unknown field `angel`"),
        ("/tools/0", "pos_norm", None, "tools[0].pos_norm: is missing"),
        ("/tools/0", "pos_norm", Some(json!([0.0])), "`tools[0].pos_norm`: invalid length 1"),
        ("/tools/1/pos", "0", Some(json!("1e300")), "tools[1].position[0]: is 1"),
        ("/traj/0", "1", Some(json!(42.0)), "traj[0]: the ball starts inside tools[0] (box)"),
        ("/traj/0", "1", Some(json!(48.0)), "traj[0]: the ball starts inside tools[0] (box)"),
        ("/traj/0", "2", Some(json!("1e300")), "traj[0][2]: is 1"),
        ("", "traj", Some(json!([])), "traj: has no rows"),
        ("", "steps", Some(json!(0)), "steps: is 0"),
        ("", "steps", Some(json!(4_000_000_000u32)), "steps: is 4000000000"),
        ("", "steps", Some(json!(-1)), "`steps`: invalid value"),
    ];
    for (parent, key, new, expected) in cases {
        let wrong = changed(scene(), parent, key, new);
        let error = simulate(&format!("{}\n\n{wrong}\n", scene())).unwrap_err();
        assert_says(&error, &["stdin:3", expected]);
    }
}

#[test]
fn wrong_lines() {
    let right = scene().to_string();
    for (line, expected) in [
        (&right[..right.len() - 1], "EOF"),
        (&right[..right.len() / 2], "EOF"),
        ("{} {}", "missing field"),
        ("[]", "invalid"),
        ("nonsense", "expected"),
        ("NaN", "expected"),
        (&"[".repeat(100_000), "expected"),
    ] {
        let error = simulate(&format!("{right}\n{line}")).unwrap_err();
        assert_says(&error, &["stdin:2", expected]);
    }
    for end in 1..right.len() {
        let error = simulate(&right[..end]).unwrap_err();
        assert_says(&error, &["stdin:1"]);
    }
    let mut output = Vec::new();
    let error = protocol::simulate(&b"{\"id\": \"\xff\"}"[..], &mut output).unwrap_err();
    assert_says(&error.to_string(), &["stdin:1"]);
}

fn shipped_task() -> Value {
    json!({
        "version": 1, "name": "t",
        "ball": {"position": [0.0, 0.8]},
        "tools": [{"type": "bucket", "position": [0.0, -0.8], "size": 6}, {"type": "wall", "position": [0.8, 0.0]}],
        "placeable": {"type": "box", "size": 8},
        "subgoals": [{"position": [-0.4, 0.2]}],
        "goal": {"position": [-0.6, -0.2]},
        "rules": {"rewards": {}},
    })
}

#[test]
fn wrong_tasks() {
    assert!(task::parse(&shipped_task().to_string(), "file.json").is_ok());
    let many = |entry: Value| Some(Value::Array(vec![entry; 10_000]));
    let cases = [
        ("", "version", Some(json!(2)), "version: is 2"),
        ("", "version", None, "missing field `version`"),
        ("", "name", Some(json!("a/b")), "name: must be"),
        ("", "goal", None, "missing field `goal`"),
        ("", "extra", Some(json!(1)), "`extra`: unknown field `extra`"),
        ("/ball", "radius", Some(json!(0)), "ball.radius: is 0"),
        ("/ball", "mass", Some(json!("1e999")), "`ball.mass`: number out of range"),
        ("/ball", "position", Some(json!([0.0, null])), "`ball.position[1]`: invalid type: null"),
        ("/ball", "position", Some(json!([0.0, 7.0])), "ball.position[1]: is 7"),
        ("/ball", "position", Some(json!([0.0, -0.8])), "ball.position: the ball starts inside tools[0] (bucket)"),
        ("/ball", "position", Some(json!([0.8, 0.1])), "ball.position: the ball starts inside tools[1] (wall)"),
        ("/tools/0", "size", Some(json!(0)), "tools[0].size: is 0"),
        ("/tools/0", "radius", Some(json!(1)), "tools[0].radius: does not belong to a bucket: remove it"),
        ("/tools/0", "radius", Some(json!("x")), "`tools[0].radius`: invalid type: string"),
        ("/tools/0", "sise", Some(json!(1)), "`tools[0].sise`: unknown field `sise`"),
        ("/tools/0", "type", Some(json!("jug")), "`tools[0].type`: unknown variant `jug`"),
        ("/placeable", "length", Some(json!(1)), "`placeable.length`: unknown field `length`"),
        ("/placeable", "vel", Some(json!(1)), "placeable.vel: does not belong to a box: remove it"),
        ("/placeable", "friction", Some(json!(-1)), "placeable.friction: is -1"),
        ("", "tools", many(json!({"type": "box", "position": [0.9, 0.9], "size": 1})), "tools: has 10000 entries"),
        ("", "balls", many(json!({"position": [0.9, 0.9]})), "balls: has 10000 entries"),
        ("", "subgoals", many(json!({"position": [0.9, 0.9]})), "subgoals: has 10000 entries"),
        ("", "marker", Some(json!({"ball": {"position": [0.05, 0.8]}})), "marker.ball.position: overlaps ball"),
        ("", "balls", Some(json!([{"position": [0.05, 0.8]}])), "balls[0].position: overlaps ball"),
        ("/goal", "shape", Some(json!("hole")), "`goal.shape`: unknown variant `hole`"),
        ("/rules", "max_actions", Some(json!(0)), "rules.max_actions: is 0, but must be a whole number from 1 to 1000"),
        ("/rules", "steps_per_action", Some(json!(4_000_000)), "rules.steps_per_action: is 4000000, but must be"),
        ("/rules/rewards", "goal", Some(json!("1e300")), "`rules.rewards.goal`: number out of range"),
        ("/rules", "gravty", Some(json!([0, 0])), "`rules.gravty`: unknown field `gravty`"),
    ];
    for (parent, key, new, expected) in cases {
        let error = task::parse(&changed(shipped_task(), parent, key, new), "file.json").unwrap_err();
        assert_says(&error.to_string(), &["file.json:", expected]);
    }
    let pretty = serde_json::to_string_pretty(&shipped_task()).unwrap();
    let error = task::parse(&pretty[..pretty.len() - 3], "file.json").unwrap_err();
    assert_says(&error.to_string(), &["file.json:", "EOF"]);
    assert!(task::load("no such task").is_err_and(|error| error.to_string().contains("task6")));
}

#[test]
fn wrong_recordings() {
    let records = |text: &str| -> Vec<Value> { text.lines().map(|line| serde_json::from_str(line).unwrap()).collect() };
    let level = records(include_str!("../data/create/levels.jsonl"))[0].clone();
    let mut episode = records(include_str!("../data/create/episodes.jsonl"))[0].clone();
    assert_eq!(level["level"], episode["level"]);
    episode["steps"].as_array_mut().unwrap().truncate(1);
    let play = |level: &str, episode: &str| {
        let mut output = Vec::new();
        let (level, episode, catalogue) = (level.as_bytes(), episode.as_bytes(), Catalogue::of_create());
        let played = protocol::play_episodes(level, "levels.jsonl", &catalogue, episode, &mut output);
        played.map(|()| output.len()).map_err(|error| error.to_string())
    };
    assert!(play(&level.to_string(), &episode.to_string()).unwrap() > 0);
    for (parent, key, new, expected) in [
        ("", "level", Some(json!("Elsewhere")), "stdin:1: level: `Elsewhere` is not among the levels"),
        ("/tool", "type", Some(json!("jug")), "tool.type: unknown tool `jug`"),
        ("/tool", "size", None, "tool.size: is missing"),
        ("/tool", "size", Some(json!(0)), "stdin:1: tool.size: is 0"),
        ("/steps/0", "action", Some(json!([0, null])), "`steps[0].action[1]`: invalid type: null"),
        ("/steps/0", "action", None, "`steps[0]`: missing field `action`"),
    ] {
        let error = play(&level.to_string(), &changed(episode.clone(), parent, key, new)).unwrap_err();
        assert_says(&error, &["stdin:1", expected]);
    }
    for (parent, key, new, expected) in [
        ("/fixed/2", "type", Some(json!("jug")), "jug"),
        ("/fixed/2", "length", None, "level `Buckets`.fixed[2].length: is missing"),
        ("/goal", "type", Some(json!("door")), "level `Buckets`.goal.type: `door`"),
        ("/target", "radius", Some(json!(0)), "ball.radius: is 0"),
        ("/rules", "max_steps", None, "levels.jsonl:1:"),
        ("", "marker", Some(json!({})), "level `Buckets`.marker.pos_norm: is missing"),
    ] {
        let error = play(&changed(level.clone(), parent, key, new), &episode.to_string()).unwrap_err();
        assert_says(&error, &[expected]);
    }
}
