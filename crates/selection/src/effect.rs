//! What a tool does to the ball that meets it first.

use super::flight::{Approach, Flight, at, difference, goal_at};
use mge_env::{Snapshot, TARGET};
use mge_physics::{BallState, STEPS_PER_ACTION, Tool, World};

/// Physics steps that are simulated from just before the contact.
const STEPS: usize = 360;

/// The flight of a ball past a tool in an otherwise empty world, from its state just before the contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effect {
    /// Index of the ball that meets the tool first.
    pub ball: usize,
    /// The physics step just before the contact.
    pub step: usize,
    /// The ball then.
    pub before: BallState,
    /// The ball one action later.
    pub after: BallState,
    /// How near the ball then comes to its aim: the goal for the target, the target for another ball.
    pub approach: Approach,
}

impl Effect {
    /// The effect of a tool; None if no ball meets it.
    pub fn of(state: &Snapshot, flight: &Flight, tool: &Tool) -> Option<Self> {
        let contact = |ball: usize| {
            let radius = state.world.ball_material(ball).radius;
            Some((ball, first_contact(&flight.paths[ball], radius, tool)?))
        };
        let (ball, contact) = flight.moving().filter_map(contact).min_by_key(|(_, step)| *step)?;
        let step = contact.saturating_sub(1);
        let before = flight.paths[ball][step];
        let mut world = World::new(state.task.rules.gravity);
        world.add_ball(state.world.ball_material(ball), before);
        world.add_tool(*tool);
        let mut path = vec![before];
        for _ in 0..STEPS {
            world.step();
            path.push(world.ball(0));
        }
        let approach = Approach::of(&path, |passed| match ball {
            TARGET => goal_at(&state.task, &flight.paths, step + passed),
            _ => at(&flight.paths[TARGET], step + passed).position,
        });
        Some(Self { ball, step, before, after: path[STEPS_PER_ACTION as usize], approach })
    }
}

/// The step in which a ball of this radius first touches the tool on its path.
fn first_contact(path: &[BallState], radius: f32, tool: &Tool) -> Option<usize> {
    let (centre, halves) = (tool.centre(), tool.half_extents());
    path.iter().position(|ball| {
        let from_centre = difference(ball.position, centre);
        (0..2).all(|axis| from_centre[axis].abs() < halves[axis] + radius)
            // A plank turns within its bounding box.
            && (tool.kind.is_hinged() || tool.surface(ball.position).0 < radius)
    })
}
