//! Numbers that describe a state and a candidate to the network: about 1 for half a screen, [`VELOCITY_SCALE`], or ten
//! seconds.

use super::effect::Effect;
use super::flight::{Approach, Flight, difference, goal_at, length};
use mge_env::{MARKER, Snapshot, TARGET, VELOCITY_SCALE};
use mge_physics::{BallState, Tool, to_normalised};

/// Features that all candidates in a state share.
pub(super) fn of_state(state: &Snapshot, flight: &Flight) -> Vec<f32> {
    let mut row = Vec::new();
    for path in &flight.paths {
        path.first().into_iter().chain(path.last()).for_each(|ball| motion(ball, &mut row));
    }
    let (task, target, goal) = (&state.task, state.ball().position, goal_at(&state.task, &flight.paths, 0));
    row.extend(position(goal));
    row.extend(difference(goal, target).map(length));
    if task.marker.is_some() {
        row.extend(difference(target, flight.paths[MARKER][0].position).map(length));
    }
    row.extend([state.actions as f32 / task.rules.max_actions as f32, state.placed.len() as f32 / 10.0]);
    let flags = [state.target_moved, state.is_captured(), flight.goal, flight.target_moved];
    row.extend(flags.iter().chain(&state.reached).map(|flag| f32::from(*flag)));
    row.push(flight.subgoals as f32);
    approach(&flight.to_goal, &mut row);
    flight.to_target.iter().for_each(|to_target| approach(to_target, &mut row));
    row
}

/// Adds the features of a tool and its effect; those of the no-op are constant.
pub(super) fn of_candidate(candidate: Option<(&Tool, &Effect)>, row: &mut Vec<f32>) {
    row.push(f32::from(candidate.is_some()));
    let effect = candidate.map_or_else(Effect::default, |(_, effect)| *effect);
    let (centre, halves) = candidate.map_or_else(Default::default, |(tool, _)| (tool.centre(), tool.half_extents()));
    row.extend(position(centre));
    row.extend(halves.map(length));
    row.extend([effect.ball == TARGET, effect.ball == MARKER].map(f32::from));
    row.push(time(effect.step));
    motion(&effect.before, row);
    motion(&effect.after, row);
    row.extend(difference(effect.before.position, centre).map(length));
    approach(&effect.approach, row);
}

fn motion(ball: &BallState, row: &mut Vec<f32>) {
    row.extend(position(ball.position));
    row.extend(velocity(ball.velocity));
}

fn approach(approach: &Approach, row: &mut Vec<f32>) {
    let distance = length(approach.distance);
    row.extend(approach.offset.map(length));
    // The second resolves small distances.
    row.extend([distance.min(2.0), 1.0 / (1.0 + 8.0 * distance), time(approach.step)]);
    row.extend(velocity(approach.velocity));
}

/// A position, clipped to the screen's surroundings.
fn position(units: [f32; 2]) -> [f32; 2] {
    to_normalised(units).map(|value| value.clamp(-1.5, 1.5))
}

fn velocity(units: [f32; 2]) -> [f32; 2] {
    units.map(|value| (value / VELOCITY_SCALE).clamp(-3.0, 3.0))
}

fn time(steps: usize) -> f32 {
    steps as f32 / 300.0
}
