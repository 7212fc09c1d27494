//! The observation: the padded collection of object feature vectors (paper, section 5.1), then a one-hot of the next
//! stage.

use super::episode::Snapshot;
use mge_physics::{BallState, Tool, ToolKind, to_normalised};
use mge_task::Task;

/// Features of one object: velocity x, y; position x, y; one-hot type (ball, then
/// [`ToolKind::PAPER`]).
pub const OBJECT_FEATURES: usize = 4 + 1 + ToolKind::PAPER.len();
/// Object slots in an observation. If there are more objects, the earliest placed tools are dropped.
pub const OBJECT_SLOTS: usize = 16;
/// Velocities are divided by this many units/s.
pub const VELOCITY_SCALE: f32 = 10.0;

/// A part of an observation vector.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ObservationPart {
    /// `objects`, `progress` and `tools`, or `objects` and `stage` if the agent has only the task's own tool.
    pub name: &'static str,
    /// Its shape; the parts are concatenated.
    pub shape: Vec<usize>,
}

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

/// Lower and upper bounds of a task's observations: infinite for positions, which may leave the screen for a moment,
/// and for velocities; 0 and 1 for one-hots.
pub fn observation_bounds(task: &Task) -> [Vec<f32>; 2] {
    let is_one_hot = |index: usize| index >= OBJECT_SLOTS * OBJECT_FEATURES || index % OBJECT_FEATURES >= 4;
    bounds((0..observation_len(task)).map(is_one_hot))
}

/// Lower and upper bounds of numbers: 0 and 1 for flags, infinite for the others.
pub(super) fn bounds(are_flags: impl Iterator<Item = bool> + Clone) -> [Vec<f32>; 2] {
    [(f32::NEG_INFINITY, 0.0), (f32::INFINITY, 1.0)]
        .map(|(open, bound)| are_flags.clone().map(|is_flag| if is_flag { bound } else { open }).collect())
}

/// Writes to `observation`, which has exactly the observation's length: the balls, the scene's tools, the placed
/// tools, zeros for empty slots, and the one-hot of the next stage.
pub(super) fn observe(now: &Snapshot, observation: &mut [f32]) {
    let world = &now.world;
    observation.fill(0.0);
    let (objects, stages) = observation.split_at_mut(OBJECT_SLOTS * OBJECT_FEATURES);
    if let Some(next) = stages.get_mut(now.stage()) {
        *next = 1.0;
    }
    let (slots, _) = objects.as_chunks_mut::<OBJECT_FEATURES>();
    let balls = world.ball_count().min(OBJECT_SLOTS);
    let (of_balls, of_tools) = slots.split_at_mut(balls);
    for (ball, slot) in of_balls.iter_mut().enumerate() {
        write_ball(&world.ball(ball), slot);
    }
    let kept = kept_tools(now, of_tools.len());
    for (slot, (_, tool)) in of_tools.iter_mut().zip(kept) {
        let [x, y] = to_normalised(tool.centre());
        (slot[2], slot[3]) = (x, y);
        // Tool types beyond the paper's have no one-hot entry.
        if let Some(kind) = slot.get_mut(5 + tool.kind.index()) {
            *kind = 1.0;
        }
    }
}

/// The tools of the scene, then those placed by the agent, with their indices; the earliest placed are dropped if there
/// are more than `slots`.
pub(super) fn kept_tools(now: &Snapshot, slots: usize) -> impl Iterator<Item = (usize, &Tool)> {
    let (world, fixed) = (&now.world, now.task.tools.len());
    let dropped = world.tools().len().saturating_sub(slots);
    world.tools().enumerate().filter(move |(index, _)| *index < fixed || *index >= fixed + dropped)
}

fn write_ball(ball: &BallState, slot: &mut [f32; OBJECT_FEATURES]) {
    let [x, y] = to_normalised(ball.position);
    let [vx, vy] = ball.velocity.map(|v| v / VELOCITY_SCALE);
    [slot[0], slot[1], slot[2], slot[3], slot[4]] = [vx, vy, x, y, 1.0];
}
