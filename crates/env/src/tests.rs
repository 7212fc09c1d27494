//! The rules of an episode, each tested at its boundary.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{Action, EndReason, Environment, OBJECT_FEATURES, OBJECT_SLOTS, Placement};
use mge_physics::{BallState, SCREEN, to_normalised};
use mge_task::{self as task, Task};

/// A position far from the path of the ball in these tests.
const ASIDE: Action = [-0.9, 0.9];

/// A task with a ball in the middle of a scene without gravity.
fn task(changes: Value) -> Task {
    let mut task = json!({
        "version": 1, "name": "t",
        "ball": {"position": [0.0, 0.0]},
        "placeable": {"type": "box", "size": 4},
        "goal": {"position": [0.9, -0.9], "radius": 1},
        "rules": {"gravity": [0.0, 0.0]},
    });
    task.as_object_mut().unwrap().extend(changes.as_object().unwrap().clone());
    task::parse(&task.to_string(), "test").unwrap()
}

fn environment(changes: Value) -> Environment {
    Environment::new(Arc::new(task(changes)))
}

/// Normalises a position in units, as task files and actions need it.
fn at(x: f32, y: f32) -> Action {
    to_normalised([x, y])
}

#[test]
fn a_tool_that_the_marker_touches_counts_as_touched() {
    let mut env = Environment::new(Arc::new(task::load("create/Push").unwrap()));
    env.reset(&mut ChaCha8Rng::seed_from_u64(0));
    // Below the marker, far from the target.
    let touched = (0..4).any(|_| env.step([0.6, 0.3]).unwrap().touched == [0]);
    assert!(touched && env.snapshot().placed.len() == 1);
}

#[test]
fn touches_count_until_the_first_stage_is_reached() {
    let ball = json!({"position": at(30.0, 42.0), "velocity": [20.0, 5.0], "friction": 0.0});
    let placeable = json!({"type": "box", "size": 8, "elasticity": 1.0});
    let touched = |subgoals: Value| {
        let mut env = environment(json!({"ball": ball, "placeable": placeable, "subgoals": subgoals}));
        let step = env.step(at(50.0, 44.0)).unwrap();
        (step.touched, step.subgoals)
    };
    assert_eq!(touched(json!([])), (vec![0], vec![]));
    // The subgoal lies before the box.
    assert_eq!(touched(json!([{"position": at(36.0, 44.0), "radius": 1.0}])), (vec![], vec![0]));
    // The subgoal lies on the way back from the box.
    assert_eq!(touched(json!([{"position": at(33.0, 56.0), "radius": 5.0}])), (vec![0], vec![0]));
}

#[test]
fn stages_count_only_in_order() {
    let scene = |in_order: bool| {
        environment(json!({
            "ball": {"position": at(15.0, 42.0), "velocity": [20.0, 0.0]},
            "subgoals": [
                {"position": at(60.0, 42.0), "radius": 1.0},
                {"position": at(35.0, 42.0), "radius": 1.0},
            ],
            "goal": {"position": at(25.0, 42.0), "radius": 1.0},
            "rules": {"gravity": [0.0, 0.0], "in_order": in_order},
        }))
    };
    let mut env = scene(true);
    let first = env.step(ASIDE).unwrap();
    assert_eq!((first.subgoals, first.goal), (vec![], false), "the second subgoal and the goal lie before the first");
    let second = env.step(ASIDE).unwrap();
    assert_eq!((second.subgoals, second.goal), (vec![0], false));
    assert_eq!((env.snapshot().stage(), &env.snapshot().reached[..]), (1, &[true, false][..]));

    let first = scene(false).step(ASIDE).unwrap();
    assert_eq!((first.subgoals, first.goal), (vec![1], true));
}

#[test]
fn a_blocked_action_adds_its_reward() {
    let rewards = json!({"gravity": [0.0, 0.0], "rewards": {"step": 0.5, "blocked": -0.2}});
    let mut env = environment(json!({"ball": {"position": [0.0, 0.0], "velocity": [1.0, 0.0]}, "rules": rewards}));
    for (action, placement, reward) in [
        (ASIDE, Placement::Placed, 0.5),
        (ASIDE, Placement::Overlap, 0.3),
        ([0.0, 0.0], Placement::Collision, 0.3),
        ([f32::NAN, 0.0], Placement::Invalid, 0.3),
    ] {
        let step = env.step(action).unwrap();
        assert_eq!((step.placement, step.reward), (placement, reward), "{action:?}");
    }
}

/// The reason for the end of a task's episode, and its number of actions.
fn end(task: Task) -> (EndReason, usize) {
    let mut env = Environment::new(Arc::new(task));
    let ends = std::iter::from_fn(|| env.step(ASIDE).ok().map(|step| step.end));
    let ends: Vec<_> = ends.collect();
    (ends[ends.len() - 1].unwrap(), ends.len())
}

#[test]
fn a_captured_ball_stands_still_if_the_rules_say_so() {
    let bucket = |capture: bool| {
        task(json!({
            "ball": {"position": at(42.0, 60.0), "velocity": [0.0, -10.0]},
            "tools": [{"type": "bucket", "position": at(42.0, 42.0), "size": 6}],
            "rules": {"max_actions": 5, "capture_is_standstill": capture},
        }))
    };
    assert_eq!(end(bucket(true)), (EndReason::Standstill, 2));
    assert_eq!(end(bucket(false)), (EndReason::MaxActions, 5));
}

#[test]
fn standstill_ends_the_episode_after_still_actions() {
    for actions in [1, 2, 3, 4] {
        let resting = task(json!({
            "ball": {"position": at(42.0, 25.0)},
            "tools": [{"type": "floor", "position": at(42.0, 20.0), "elasticity": 0.0}],
            "rules": {"still_actions": actions},
        }));
        assert_eq!(end(resting), (EndReason::Standstill, actions));
    }
    // An action that ends in motion does not count.
    let falling = task(json!({
        "ball": {"position": at(42.0, 27.0)},
        "tools": [{"type": "floor", "position": at(42.0, 20.0), "elasticity": 0.0}],
        "rules": {"still_actions": 2},
    }));
    assert_eq!(end(falling), (EndReason::Standstill, 3));
}

#[test]
fn the_screen_ends_at_its_edges() {
    let inside = 1e-3;
    for (position, expected) in [
        ([inside, 42.0], None),
        ([0.0, 42.0], Some(EndReason::OutOfBounds)),
        ([SCREEN - inside, 42.0], None),
        ([SCREEN, 42.0], Some(EndReason::OutOfBounds)),
        ([42.0, inside], None),
        ([42.0, 0.0], Some(EndReason::OutOfBounds)),
        ([42.0, SCREEN - inside], None),
        ([42.0, SCREEN], Some(EndReason::OutOfBounds)),
    ] {
        let moving = BallState { velocity: [1.0, 0.0], ..BallState::at_rest(position) };
        let step = environment(json!({})).step_to(ASIDE, moving);
        assert_eq!((step.end, step.terminated), (expected, expected.is_some()), "{position:?}");
    }
}

#[test]
fn start_noise_draws_two_uniform_numbers_and_no_noise_draws_none() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut env = environment(json!({"rules": {"start_noise": 0.25}}));
    for _ in 0..10 {
        let mut same = rng.clone();
        let shift = [same.gen_range(-0.25f32..=0.25), same.gen_range(-0.25f32..=0.25)];
        let observation = env.reset(&mut rng);
        assert_eq!(env.start().shift, shift);
        let start = to_normalised(env.snapshot().ball().position);
        assert!((0..2).all(|axis| (start[axis] - shift[axis]).abs() < 1e-6), "{start:?}");
        assert_eq!(observation[2..4], start);
        assert_eq!(rng, same);
    }
    let before = rng.clone();
    let mut env = environment(json!({}));
    env.reset(&mut rng);
    assert_eq!((env.start().shift, rng), ([0.0; 2], before));
}

/// Normalised positions in the slots of an observation.
fn slots(observation: &[f32]) -> Vec<Action> {
    let objects = observation[..OBJECT_SLOTS * OBJECT_FEATURES].chunks(OBJECT_FEATURES);
    objects.map(|object| [object[2], object[3]]).collect()
}

#[test]
fn if_objects_exceed_slots_the_earliest_placed_tools_are_dropped() {
    let fixed: Vec<Action> = (0..12).map(|index| at(4.0 + 6.5 * index as f32, 4.0)).collect();
    let tools: Vec<Value> = fixed.iter().map(|place| json!({"type": "box", "position": place, "size": 2})).collect();
    let mut env = environment(
        json!({"tools": tools, "placeable": {"type": "box", "size": 2}, "goal": {"position": [-0.9, 0.0], "radius": 1}}),
    );
    let ball = [0.0, 0.0];
    let mut placed = Vec::new();
    for index in 0..5 {
        let place = at(10.0 + 15.0 * index as f32, 75.0);
        let step = env.step_to(place, BallState { velocity: [1.0, 0.0], ..BallState::at_rest([42.0, 42.0]) });
        assert_eq!(step.placement, Placement::Placed);
        placed.push(place);
        let kept = &placed[placed.len().saturating_sub(OBJECT_SLOTS - 1 - fixed.len())..];
        let mut expected = [&[ball], &fixed[..], kept].concat();
        expected.resize(OBJECT_SLOTS, [0.0; 2]);
        let near = |(a, b): (&Action, &Action)| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        let seen = slots(&step.observation);
        assert!(seen.iter().zip(&expected).all(near), "{seen:?}\n{expected:?}");
    }
}
