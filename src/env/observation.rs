//! What the agent sees: the padded collection of object feature vectors (paper,
//! section 5.1), then which stage comes next.

use super::description::ObservationPart;
use crate::physics::{BallState, ToolKind, World, to_normalised};
use crate::task::Task;

/// Features of one object: velocity x, y; position x, y; one-hot type (ball, then
/// [`ToolKind::PAPER`]).
pub const OBJECT_FEATURES: usize = 4 + 1 + ToolKind::PAPER.len();
/// Objects in an observation. Of more, the tools placed first drop out.
pub const OBJECT_SLOTS: usize = 16;
/// Place in the observation of the position of the first ball, which starts the task: x, then y.
pub const BALL_POSITION: usize = 2;
/// Velocities are divided by this many units/s.
pub const VELOCITY_SCALE: f32 = 10.0;

/// Length of a task's observation vector: object slots, then a one-hot of the next
/// stage (subgoals in order, then the goal).
pub fn observation_len(task: &Task) -> usize {
    OBJECT_SLOTS * OBJECT_FEATURES + task.stage_count()
}

/// The parts of a task's observations.
pub(super) fn observation_parts(task: &Task) -> Vec<ObservationPart> {
    vec![
        ObservationPart { name: "objects", shape: vec![OBJECT_SLOTS, OBJECT_FEATURES] },
        ObservationPart { name: "stage", shape: vec![task.stage_count()] },
    ]
}

/// Least and greatest values of a task's observations. Positions may leave the screen for a moment
/// and velocities have no bound, so that theirs are infinite; one-hots have.
pub fn observation_bounds(task: &Task) -> [Vec<f32>; 2] {
    let is_one_hot = |index: usize| index >= OBJECT_SLOTS * OBJECT_FEATURES || index % OBJECT_FEATURES >= 4;
    [(f32::NEG_INFINITY, 0.0), (f32::INFINITY, 1.0)].map(|(unbounded, bound)| {
        (0..observation_len(task)).map(|index| if is_one_hot(index) { bound } else { unbounded }).collect()
    })
}

/// Fills `observation` with the balls, the scene's tools, the placed tools, zeros for
/// empty slots, and the one-hot of the next stage.
pub(super) fn observe(world: &World, fixed_tools: usize, stage: usize, stages: usize, observation: &mut Vec<f32>) {
    observation.clear();
    let balls = world.ball_count().min(OBJECT_SLOTS);
    for ball in 0..balls {
        push_ball(&world.ball(ball), observation);
    }
    let free = OBJECT_SLOTS - balls;
    let placed = world.tools().len() - fixed_tools;
    let dropped = (fixed_tools + placed).saturating_sub(free);
    let keep = |index: &usize| *index < fixed_tools || *index >= fixed_tools + dropped;
    for (_, tool) in world.tools().enumerate().filter(|(index, _)| keep(index)).take(free) {
        let [x, y] = to_normalised(tool.centre());
        observation.extend([0.0, 0.0, x, y]);
        push_type(1 + tool.kind.index(), observation);
    }
    observation.resize(OBJECT_SLOTS * OBJECT_FEATURES, 0.0);
    observation.extend((0..stages).map(|index| f32::from(u8::from(index == stage))));
}

fn push_ball(ball: &BallState, observation: &mut Vec<f32>) {
    let [x, y] = to_normalised(ball.position);
    let [vx, vy] = ball.velocity.map(|v| v / VELOCITY_SCALE);
    observation.extend([vx, vy, x, y]);
    push_type(0, observation);
}

fn push_type(index: usize, observation: &mut Vec<f32>) {
    observation.extend((0..OBJECT_FEATURES - 4).map(|slot| f32::from(u8::from(slot == index))));
}
