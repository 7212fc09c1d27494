//! CREATE's rules, tested with one small level each.

use std::sync::Arc;

use mge::env::{Choice, EndReason, Environment, Placement, uniform_action};
use mge::physics::{Motion, ToolSplit};
use mge::protocol::{StepLine, replay};
use mge::task::{self, Rules, Task};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// A box placed here affects nothing; a second box overlaps it.
const ASIDE: [f32; 2] = [-0.9, 0.9];
/// Height of a ball's centre above the middle of the floor on which it lies, normalised.
const ABOVE: f64 = 0.11;

/// A task with CREATE's rules and a falling target that does not reach the goal, with some changes.
fn level(changes: Value) -> Task {
    let mut level = json!({
        "version": 1, "name": "Own", "ball": {"position": [0.0, 0.8]}, "placeable": {"type": "box"},
        "goal": {"position": [0.8, -0.8], "shape": "star"}, "rules": Rules::of_create(),
    });
    for (name, value) in changes.as_object().unwrap() {
        match (&mut level[name], value) {
            (Value::Object(before), Value::Object(changes)) => before.extend(changes.clone()),
            (before, value) => *before = value.clone(),
        }
    }
    task::parse(&level.to_string(), "own").unwrap()
}

fn play(task: Task, actions: usize) -> Vec<StepLine> {
    replay(Arc::new(task), std::iter::repeat_n(ASIDE, actions)).collect()
}

fn rewards(lines: &[StepLine]) -> Vec<f32> {
    lines.iter().map(|line| (line.reward * 1000.0).round() / 1000.0).collect()
}

/// The normalised height of a ball that started at `from` (normalised) and has fallen freely for
/// `actions` actions.
fn fallen(from: f32, actions: f32) -> f32 {
    let steps = 40.0 * actions;
    from - 2.0 / 84.0 * (2.0 / 900.0 * steps * (steps - 1.0) / 2.0)
}

#[test]
fn placements_near_earlier_ones_are_blocked_and_the_last_action_truncates() {
    let task = level(json!({"rules": {"max_actions": 3, "overlap_threshold": 0.5}}));
    let lines: Vec<_> = replay(Arc::new(task), [[-0.5, 0.0], [-0.1, 0.0], [0.5, 0.0], [0.0, 0.0]]).collect();
    let outcomes: Vec<_> = lines.iter().map(|line| line.outcome).collect();
    assert_eq!(outcomes, [Placement::Placed, Placement::Overlap, Placement::Placed]);
    let ends: Vec<_> = lines.iter().map(|line| (line.terminated, line.truncated)).collect();
    assert_eq!(ends, [(false, false), (false, false), (false, true)]);
}

#[test]
fn blocked_placements_lose_the_reward_of_a_step() {
    let task = level(json!({"subgoals": [{"position": [-0.5, -0.5], "radius": 3.0}]}));
    let actions = [[0.0, 0.8], [0.8, -0.8], [-0.5, -0.4], [-0.5, 0.5], [-0.3, 0.6], [-7.0, 0.5], [-1.0, 0.4]];
    let lines: Vec<_> = replay(Arc::new(task), actions).collect();
    let outcomes: Vec<_> = lines.iter().map(|line| line.outcome).collect();
    use Placement::{Collision, Overlap, Placed};
    assert_eq!(outcomes, [Collision, Collision, Collision, Placed, Overlap, Placed, Overlap]);
    assert_eq!(rewards(&lines), [0.0, 0.0, 0.0, 0.01, 0.0, 0.01, 0.0]);
    assert_eq!(lines.last().unwrap().placed_tools, 2);
}

#[test]
fn the_goal_counts_once_in_passing_and_does_not_end_the_episode() {
    // In free fall the ball is above the goal after four actions and below it after five.
    let task = level(
        json!({"goal": {"position": [0.0, fallen(0.8, 4.55)]}, "tools": [{"type": "wall", "position": [0.9, 0.0]}]}),
    );
    let lines = play(task, 20);
    let rewards = rewards(&lines);
    assert_eq!(rewards, [0.01, 0.0, 0.0, 0.0, 9.9, 0.0, 0.0]);
    assert!(!lines[3].goal_hit && lines[4].goal_hit && !lines[4].terminated);
    assert!(lines[6].terminated && !lines[6].truncated);
}

#[test]
fn subgoals_count_in_any_order_but_only_at_the_end_of_an_action() {
    let heights = [4.55, 4.0, 3.0].map(|actions| fallen(0.8, actions));
    let task = level(json!({"subgoals": heights.map(|height| json!({"position": [0.0, height], "radius": 3.0}))}));
    let lines = play(task, 6);
    let hits: Vec<_> = lines.iter().map(|line| line.subgoals_hit.clone()).collect();
    assert_eq!(hits, [vec![], vec![], vec![2], vec![1, 2], vec![1, 2], vec![1, 2]]);
    assert_eq!(rewards(&lines), [0.01, 0.0, 1.9, 1.9, 0.0, 0.0]);
}

#[test]
fn a_goal_that_moves_is_reached_by_contact() {
    let task = level(json!({
        "goal": {"position": [0.0, 0.2 + ABOVE], "shape": "ball"},
        "tools": [{"type": "floor", "position": [0.0, 0.2], "radius": 0.0}],
    }));
    let lines = play(task, 3);
    assert_eq!(lines.iter().map(|line| line.goal_hit).collect::<Vec<_>>(), [false, false, true]);
    assert_eq!(rewards(&lines), [0.01, 0.0, 9.9]);
    assert_eq!(lines[0].balls.keys().collect::<Vec<_>>(), ["goal_ball", "target"]);
}

#[test]
fn a_basket_detects_the_ball_and_lets_it_through() {
    let ball = json!({"radius": 3.5});
    let basket = json!({"position": [0.0, fallen(0.8, 3.0)], "shape": "basket", "radius": 5.0});
    let (lines, free) = (play(level(json!({"goal": basket, "ball": ball})), 4), play(level(json!({"ball": ball})), 4));
    assert!(!lines[0].goal_hit && lines[2].goal_hit && !free[3].goal_hit);
    assert_eq!(lines[3].balls, free[3].balls);
}

#[test]
fn the_goal_of_a_marker_level_waits_for_the_target_to_move() {
    let marker = json!({
        "marker": {"ball": {"position": [-0.5, 0.8]}}, "goal": {"position": [0.0, fallen(0.8, 2.6)]},
    });
    // The target counts as moved at the end of the second action, in which it also touches the goal.
    let lines = play(level(marker.clone()), 4);
    assert_eq!(rewards(&lines), [0.01, 1.0, 9.9, 0.0]);
    let mut must_hit = marker.clone();
    must_hit["marker"]["must_hit"] = json!(true);
    assert_eq!(rewards(&play(level(must_hit.clone()), 4)), [0.01, 0.0, 0.0, 0.0]);
    // A marker that falls on the resting target sets it in motion.
    must_hit["marker"]["ball"] = json!({"position": [0.02, 0.5]});
    must_hit["tools"] = json!([{"type": "floor", "position": [0.0, 0.0], "size": 8, "radius": 0.0}]);
    must_hit["ball"] = json!({"position": [0.0, ABOVE]});
    let lines = play(level(must_hit), 12);
    let moved: f32 = rewards(&lines).iter().sum();
    assert!((0.9..1.1).contains(&moved), "{:?}", rewards(&lines));
}

#[test]
fn a_lost_marker_ends_the_episode_unless_the_target_has_moved() {
    let marker = |must_hit: bool| {
        let marker = json!({"ball": {"position": [-0.5, -0.9]}, "must_hit": must_hit});
        level(json!({"marker": marker, "ball": {"position": [0.5, 0.8]}}))
    };
    assert_eq!(play(marker(false), 3).len(), 3);
    let mut environment = Environment::new(Arc::new(marker(true)));
    assert!(environment.step(ASIDE).unwrap().end.is_none());
    let last = environment.step(ASIDE).unwrap();
    assert_eq!((last.end, last.terminated), (Some(EndReason::MarkerOut), true));
}

#[test]
fn the_marker_has_subgoals_of_its_own() {
    let subgoals = json!([{"position": [-0.5, fallen(0.8, 3.0)], "radius": 3.0}]);
    let marker = json!({"ball": {"position": [-0.5, 0.8]}, "must_hit": true, "subgoals": subgoals});
    let task = level(json!({"marker": marker}));
    let lines = play(task, 4);
    assert_eq!(rewards(&lines), [0.01, 0.0, 1.9, 0.0]);
    assert!(lines[3].subgoals_hit.is_empty());
}

#[test]
fn other_balls_move_too() {
    let lines = play(level(json!({"balls": [{"position": [0.5, 0.8], "mass": 1, "radius": 2}]})), 1);
    let [_, y, _, vy, ..] = lines[0].balls["ball0"];
    let fallen = f64::from((fallen(0.8, 1.0) + 1.0) * 42.0);
    assert!((y - fallen).abs() < 1e-3 && (vy + 80.0 / 30.0).abs() < 1e-4);
}

#[test]
fn standstill_in_two_actions_ends_the_episode() {
    let task = level(json!({
        "ball": {"position": [0.0, ABOVE]},
        "tools": [{"type": "floor", "position": [0, 0], "radius": 0.0, "elasticity": 0}],
    }));
    let mut environment = Environment::new(Arc::new(task));
    assert!(environment.step(ASIDE).unwrap().end.is_none());
    let last = environment.step(ASIDE).unwrap();
    assert_eq!((last.end, last.terminated, last.truncated), (Some(EndReason::Standstill), true, false));
    assert!(environment.step(ASIDE).is_err());
}

#[test]
fn leaving_the_screen_ends_the_episode() {
    let mut environment = Environment::new(Arc::new(level(json!({}))));
    let ends: Vec<_> = (0..7).map(|_| environment.step(ASIDE).unwrap().end).collect();
    assert_eq!(ends[..6], [None; 6]);
    assert_eq!(ends[6], Some(EndReason::OutOfBounds));
}

/// A digest of all motions in 300 random actions with any of CREATE's tools.
fn digest(level: &str) -> u32 {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let task = task::load(&format!("create/{level}")).unwrap();
    let mut env = Environment::new(Arc::new(task)).with_tools(ToolSplit::All);
    env.reset(&mut rng);
    let mut digest = 0;
    for _ in 0..300 {
        let choice = Choice { tool: rng.gen_range(0..40), place: uniform_action(&mut rng) };
        let step = env.step_watched(choice, |world| {
            let balls = (0..world.ball_count()).map(|ball| world.motion(ball));
            let planks = (0..world.tools().len()).flat_map(|tool| <[_; 2]>::from(world.plank(tool))).flatten();
            for Motion { position: [x, y], velocity: [u, v], angle, angular_velocity } in balls.chain(planks) {
                for number in [x, y, u, v, angle, angular_velocity] {
                    digest = crc32c::crc32c_append(digest, &number.to_le_bytes());
                }
            }
        });
        if step.unwrap().end.is_some() {
            env.reset(&mut rng);
        }
    }
    digest
}

/// Recorded runs are replayed from their actions, so a change of the last bit changes them. If the physics is changed
/// on purpose, take the new digests from the message.
#[test]
fn motions_are_the_same_to_the_last_bit() {
    let expected = [
        ("Basket", 3_792_483_789),
        ("Belt", 594_621_679),
        ("Buckets", 2_840_682_536),
        ("Cannon", 1_306_718_508),
        ("Collide", 364_132_163),
        ("Funnel", 2_002_931_975),
        ("GoalTest", 177_157_002),
        ("Ladder", 3_063_347_638),
        ("Moving", 1_659_100_855),
        ("Navigate", 1_860_299_508),
        ("Obstacle", 3_010_426_784),
        ("Push", 1_736_016_987),
        ("Seesaw", 3_680_515_681),
    ];
    assert_eq!(expected.map(|(level, _)| (level, digest(level))), expected);
}
