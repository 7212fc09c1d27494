//! The observation by rays: the ball, its next target, and how far the tools are around both. Its length is the same
//! for every task, so one agent can learn on many.

use std::f32::consts::TAU;

use super::action_set::{TOOL_FEATURES, tool_features};
use super::episode::{Snapshot, goal_object};
use super::observation::{BALL_POSITION, VELOCITY_SCALE, bounds};
use mge_physics::{ObjectId, SCREEN, ToolKind, to_normalised, to_units};

/// Number of rays around the ball, and around the next target.
const RAYS: usize = 24;
/// Length of a ray in units: half of the screen.
const RANGE: f32 = SCREEN / 2.0;
/// Velocity and position of the ball; position of the next target and of the goal, both relative to the ball, and
/// their radii; number of stages left.
const POSITIONS: usize = 4 + 6 + 1;
/// Length of an observation by rays.
pub const RAYS_LEN: usize = POSITIONS + TOOL_FEATURES + 2 * RAYS;

/// The observation by rays of an episode. Besides the positions, of which that of the ball has the place of
/// [`BALL_POSITION`], it contains the properties of the task's own tool, then for rays from the ball and from the next
/// target how near the first tool is: 0 if there is none within half of the screen, 1 at the origin of the ray.
/// Positions are normalised. Hinged planks are seen as when they were placed; markers, other balls and boxes are not
/// seen.
pub(super) fn observe_rays(now: &Snapshot) -> Vec<f32> {
    let task = now.task();
    let ball = now.ball();
    let position = to_normalised(ball.position);
    let stage = now.stage();
    let goal = match goal_object(task) {
        ObjectId::Ball(goal) => to_normalised(now.world().ball(goal).position),
        _ => task.goal.position,
    };
    let goal = (goal, task.goal.radius);
    let target = task.subgoals.get(stage).map_or(goal, |subgoal| (subgoal.position, subgoal.radius));
    let mut numbers = Vec::with_capacity(RAYS_LEN);
    numbers.extend(ball.velocity.map(|v| v / VELOCITY_SCALE));
    debug_assert_eq!(numbers.len(), BALL_POSITION);
    numbers.extend(position);
    for ([x, y], radius) in [target, goal] {
        numbers.extend([x - position[0], y - position[1], radius / SCREEN]);
    }
    numbers.push((task.stage_count() - stage.min(task.subgoals.len())) as f32 / 4.0);
    numbers.extend(tool_features(Some(&task.placeable.tool([0.0; 2]))));
    let directions: [[f32; 2]; RAYS] = std::array::from_fn(|ray| {
        let (sin, cos) = pxfm::f_sincosf(TAU * ray as f32 / RAYS as f32);
        [cos, sin]
    });
    for origin in [ball.position, to_units(target.0)] {
        let mut distances = [RANGE; RAYS];
        now.world().tools().for_each(|tool| tool.shorten_rays(origin, &directions, &mut distances));
        numbers.extend(distances.map(|distance| 1.0 - distance / RANGE));
    }
    numbers
}

/// Lower and upper bounds of observations by rays: 0 and 1 for the type of the tool and for rays, infinite for the
/// others.
pub(super) fn rays_bounds() -> [Vec<f32>; 2] {
    let is_unit =
        |index: usize| (POSITIONS..POSITIONS + ToolKind::ALL.len()).contains(&index) || index >= RAYS_LEN - 2 * RAYS;
    bounds((0..RAYS_LEN).map(is_unit))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::Environment;
    use mge_task::{self as task, Form, Task, ToolSpec};

    /// A task with one box, to the right of the ball.
    fn beside_a_box() -> Task {
        let mut task = task::load("task1").unwrap();
        task.tools = vec![ToolSpec { kind: ToolKind::Box, position: [0.4, 0.0], form: Form::default() }];
        task.ball.position = [0.0, 0.0];
        task.subgoals.truncate(1);
        task.subgoals[0].position = [-0.5, 0.25];
        task.goal.position = [0.5, -0.75];
        task
    }

    fn rays(task: &Task) -> Vec<f32> {
        Environment::new(Arc::new(task.clone())).with_rays().observation()
    }

    #[test]
    fn every_task_has_observations_of_the_same_length_with_the_ball_in_the_same_place() {
        for task in task::shipped() {
            let env = Environment::new(Arc::new(task));
            let by_rays = env.clone().with_rays();
            let observation = by_rays.observation();
            assert_eq!(by_rays.observation_len(), RAYS_LEN);
            let [low, high] = by_rays.observation_bounds();
            let is_in = |index: usize| (low[index]..=high[index]).contains(&observation[index]);
            assert!((0..RAYS_LEN).all(is_in), "{observation:?}");
            assert_eq!(observation.len(), RAYS_LEN, "{}", env.task().name);
            assert_eq!(observation[BALL_POSITION..][..2], env.observation()[BALL_POSITION..][..2]);
            assert!(observation.iter().all(|number| number.is_finite()));
        }
    }

    #[test]
    fn targets_are_relative_to_the_ball_and_the_goal_is_the_last_of_them() {
        let mut task = beside_a_box();
        let near = |found: &[f32], expected: &[f32]| {
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}, not {expected:?}");
        };
        let radii = [task.subgoals[0].radius / SCREEN, task.goal.radius / SCREEN];
        let numbers = rays(&task);
        near(&numbers[4..11], &[-0.5, 0.25, radii[0], 0.5, -0.75, radii[1], 0.5]);
        task.subgoals.clear();
        let numbers = rays(&task);
        near(&numbers[4..11], &[0.5, -0.75, radii[1], 0.5, -0.75, radii[1], 0.25]);
    }

    #[test]
    fn a_ray_ends_at_the_first_tool_in_its_way() {
        let mut task = beside_a_box();
        let half = task.tools[0].tool().size as f32 / 2.0;
        let gap = 0.2 * SCREEN - half;
        let numbers = rays(&task);
        let around_ball = &numbers[RAYS_LEN - 2 * RAYS..RAYS_LEN - RAYS];
        assert!((around_ball[0] - (1.0 - gap / RANGE)).abs() < 1e-4, "{around_ball:?}");
        assert_eq!((around_ball[RAYS / 4], around_ball[RAYS / 2]), (0.0, 0.0), "up and left are free");
        // The next tool in the same direction is hidden, one on the other side is not.
        task.tools.push(ToolSpec { position: [0.8, 0.0], ..task.tools[0] });
        task.tools.push(ToolSpec { position: [-0.4, 0.0], ..task.tools[0] });
        let more = rays(&task);
        let around_ball = [around_ball, &more[RAYS_LEN - 2 * RAYS..RAYS_LEN - RAYS]];
        assert_eq!(around_ball[1][0], around_ball[0][0]);
        assert!((around_ball[1][RAYS / 2] - around_ball[0][0]).abs() < 1e-4);
    }
}
