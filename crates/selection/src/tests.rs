//! Tests of policies on CREATE's levels, and of what they know.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::decision::Decision;
use super::flight::NO_OP;
use super::*;
use mge_base::atomic::Target;
use mge_env::{Choice, Environment, Placement};
use mge_physics::{PHYSICS_DT, Tool, ToolKind, ToolSplit};
use mge_task::{Task, load};

const LEVEL: &str = "create/Moving-random";

fn level(name: &str) -> Arc<Task> {
    Arc::new(load(name).unwrap())
}

fn settings(episodes: usize) -> Settings {
    Settings { episodes, candidates: 32, seed: 3 }
}

/// A task in which nothing but the ball exists that could touch it, and the ball starts at the upper left.
fn empty() -> Arc<Task> {
    let mut task = load("task1").unwrap();
    task.tools.clear();
    task.ball.position = [-0.9, 0.5];
    task.ball.velocity = [5.0, 2.0];
    Arc::new(task)
}

#[test]
fn a_policy_beats_random_play_with_tools_that_it_has_never_seen() {
    let task = level(LEVEL);
    let policy = train(&task, settings(60), |_| ()).unwrap();
    let play = |policy| evaluate(&task, ToolSplit::Test, policy, settings(40), |_| ());
    let (trained, random) = (play(Some(&policy)), play(None));
    assert_eq!((trained.episodes, random.episodes), (40, 40));
    assert!(trained.successes >= 24 && random.successes <= 4, "{trained:?} {random:?}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let task = level(LEVEL);
    let mut played = Vec::new();
    let [first, again] = [0, 1].map(|_| train(&task, settings(6), |episode| played.push(episode)).unwrap().to_bytes());
    assert!(first == again);
    assert_eq!(played, [1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6]);
    assert!(first != train(&task, Settings { seed: 4, ..settings(6) }, |_| ()).unwrap().to_bytes());
}

#[test]
fn a_saved_policy_plays_as_the_trained_one_and_what_is_none_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.safetensors");
    let task = level(LEVEL);
    let policy = train(&task, settings(6), |_| ()).unwrap();
    policy.save(&Target::from(&path)).unwrap();
    let loaded = Policy::load(&path, &task).unwrap();
    let play = |policy| evaluate(&task, ToolSplit::Test, Some(policy), settings(4), |_| ());
    assert_eq!((play(&loaded), loaded.settings), (play(&policy), settings(6)));

    let refused = |task: &str, reason: &str| {
        let error = Policy::load(&path, &level(task)).unwrap_err().to_string();
        assert!(error.contains(reason) && !error.contains('\n'), "{error}");
    };
    refused("create/Push-random", "its task is `Moving-random`, not `Push-random`");
    let bytes = policy.to_bytes();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    refused(LEVEL, "policy.safetensors: ");
    std::fs::write(&path, mge_nn::TensorFile::default().to_bytes()).unwrap();
    refused(LEVEL, "not a policy");
    let error = policy.save(&Target::from(&path)).unwrap_err().to_string();
    assert!(error.contains("is not a policy"), "{error}");
}

#[test]
fn a_ball_in_an_empty_world_flies_along_the_parabola() {
    let env = Environment::new(empty());
    let flight = Flight::after(&env, NO_OP);
    let start = &flight.paths[0][0];
    let gravity = env.task().rules.gravity;
    for step in [1, 20, 40, 80] {
        let t = step as f32 * PHYSICS_DT;
        let fall = |axis: usize| start.position[axis] + start.velocity[axis] * t + gravity[axis] * t * t / 2.0;
        let found = flight.paths[0][step].position;
        // The engine's step is coarse: its error grows with time.
        let error = (found[0] - fall(0)).hypot(found[1] - fall(1));
        assert!(error < 0.04 * t + 1e-3, "step {step}: {error}");
    }
    assert!(!flight.goal && flight.to_goal.distance > 0.0);
}

#[test]
fn an_effect_is_what_the_tool_does_in_the_scene() {
    let env = Environment::new(empty());
    let (state, flight) = (env.snapshot(), Flight::after(&env, NO_OP));
    let passed = flight.paths[0][60].position.map(f64::from);
    let floor = Tool::new(ToolKind::Floor, [passed[0], passed[1] - 10.0]);
    let effect = Effect::of(state, &flight, &floor).unwrap();
    assert_eq!(effect.ball, 0);
    let mut world = state.world.clone();
    world.add_tool(floor);
    // One action later; there is nothing else in this scene.
    (0..effect.step + 40).for_each(|_| world.step());
    let (found, real) = (effect.after.position, world.ball(0).position);
    assert!((found[0] - real[0]).hypot(found[1] - real[1]) < 0.1, "{found:?} {real:?}");
    assert!(found[1] - flight.paths[0][effect.step + 40].position[1] > 1.0, "it bounces");
    assert!(Effect::of(state, &flight, &floor.at([80.0, 80.0])).is_none());
}

#[test]
fn candidates_are_tools_of_the_set_that_may_be_placed() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut env = Environment::new(level(LEVEL)).with_tools(ToolSplit::Test);
    env.reset(&mut rng);
    let (state, set) = (env.snapshot(), env.action_set().unwrap());
    let choices = Decision::new(&env, 30, &mut rng).choices;
    assert!(choices.len() > 15 && choices.len() <= 30 && choices[0] == NO_OP);
    for Choice { tool, place } in &choices[1..] {
        let tool = set.get(*tool).unwrap().unwrap();
        assert_eq!(state.check_tool(tool, *place), Placement::Placed);
    }
}
