//! rapier's own solver as a model: between a learned network and the true physics.
//!
//! It simulates the ball and the shapes and materials of tools, at CREATE's time step. Except for the
//! bucket, special effects of CREATE's tools are ignored: fans, belts, ladders and cannons let the ball
//! through, funnels are solid, planks do not turn.

use rapier2d::prelude::*;
use rayon::prelude::*;

use super::error::Result;
use super::predictor::Predictor;
use mge_physics::{Ball, BallState, PHYSICS_DT, Tool, ToolKind, exact};
use mge_task::Task;

/// Largest number of physics steps of one prediction, because callers see the ball only at its end.
const MAX_INTERVAL: u32 = 5;

/// Predicts a task's ball with rapier.
#[derive(Debug, Clone, Copy)]
pub struct Rapier {
    interval: u32,
    gravity: [f32; 2],
    ball: Ball,
}

impl Rapier {
    /// A predictor with a task's gravity and ball, and an interval that divides its actions.
    pub fn new(task: &Task) -> Self {
        let steps = task.rules.steps_per_action;
        let interval = (1..=MAX_INTERVAL).rev().find(|interval| steps.is_multiple_of(*interval)).unwrap_or(1);
        Self { interval, ..Self::every(interval, task.rules.gravity, task.ball.material()) }
    }

    /// A predictor with this interval, in physics steps.
    pub(super) fn every(interval: u32, gravity: [f32; 2], ball: Ball) -> Self {
        Self { interval, gravity, ball }
    }

    fn predict(&self, ball: &BallState, tools: &[Tool]) -> BallState {
        let mut world = PhysicsWorld::new();
        let dt = f64::from(PHYSICS_DT);
        let gravity = Vector::from(self.gravity.map(exact));
        world.gravity = gravity;
        world.integration_parameters.dt = dt;
        let seconds = f64::from(self.interval) * dt;
        let reach = exact(self.ball.radius) + (f64::from(ball.speed()) + gravity.length() * seconds) * seconds + 1.0;
        for tool in tools.iter().filter(|tool| !tool.kind.is_sensor()) {
            if f64::from(tool.surface(ball.position).0) < reach {
                let (shape, place) = tool.shape();
                let collider = ColliderBuilder::new(shape).translation(place);
                world.insert_collider(material(collider, tool.elasticity, tool.friction), None);
            }
        }
        // CREATE moves a body before it applies gravity, rapier afterwards, in `parts` substeps.
        let parts = world.integration_parameters.num_solver_iterations as f64;
        let ahead = gravity * dt * (0.5 + 0.5 / parts);
        let velocity = Vector::from(ball.velocity.map(f64::from)) - ahead;
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::from(ball.position.map(f64::from)))
            .linvel(velocity)
            .angvel(ball.angular_velocity.into())
            .can_sleep(false);
        let disc = ColliderBuilder::ball(exact(self.ball.radius)).mass(exact(self.ball.mass));
        let disc = material(disc, exact(self.ball.elasticity), exact(self.ball.friction));
        let (body, _) = world.insert(body, disc);
        for _ in 0..self.interval {
            world.step();
            let place = world.bodies[body].translation();
            if let Some(bucket) = tools.iter().find(|tool| self.captures(tool, place)) {
                return BallState::at_rest(bucket.centre());
            }
        }
        let (place, velocity) = (world.bodies[body].translation(), world.bodies[body].linvel() + ahead);
        let turned = world.bodies[body].rotation().angle() as f32;
        BallState {
            position: [place.x as f32, place.y as f32],
            velocity: [velocity.x as f32, velocity.y as f32],
            angle: ball.angle + turned,
            angular_velocity: world.bodies[body].angvel() as f32,
        }
    }

    /// Whether the tool is a bucket and a ball at `place` touches it from above.
    fn captures(&self, tool: &Tool, place: Vector) -> bool {
        if tool.kind != ToolKind::Bucket {
            return false;
        }
        let apart = place - Vector::from(tool.position);
        let (sin, cos) = pxfm::f_sincos(-tool.angle);
        let (x, y) = (cos * apart.x - sin * apart.y, sin * apart.x + cos * apart.y);
        y > x.abs() && f64::from(tool.surface([place.x as f32, place.y as f32]).0) <= exact(self.ball.radius)
    }
}

/// A collider that combines elasticities and frictions by multiplication.
fn material(collider: ColliderBuilder, elasticity: f64, friction: f64) -> ColliderBuilder {
    collider
        .restitution(elasticity)
        .restitution_combine_rule(CoefficientCombineRule::Multiply)
        .friction(friction)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
}

impl Predictor for Rapier {
    fn interval(&self) -> u32 {
        self.interval
    }

    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>> {
        Ok(balls.par_iter().zip(tools).map(|(ball, tools)| self.predict(ball, tools)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_physics::World;

    /// The ball after an action, according to rapier and to the true physics.
    fn both(tool: Tool, start: BallState) -> [BallState; 2] {
        let mut world = World::new([0.0, -2.0]);
        world.add_tool(tool);
        let ball = world.add_ball(Ball::default(), start);
        (0..40).for_each(|_| world.step());
        let rapier = Rapier::every(5, [0.0, -2.0], Ball::default());
        let mut predicted = start;
        for _ in 0..8 {
            predicted = rapier.advance(&[predicted], &[&[tool]]).unwrap()[0];
        }
        [predicted, world.ball(ball)]
    }

    fn distance([a, b]: [BallState; 2]) -> f32 {
        (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1])
    }

    #[test]
    fn predictions_are_close_to_the_true_physics_in_flight_and_at_tools() {
        let falling = BallState { velocity: [1.0, -6.0], ..BallState::at_rest([42.0, 60.0]) };
        let far = Tool::new(ToolKind::Box, [10.0, 10.0]);
        let apart = distance(both(far, falling));
        assert!(apart < 1e-3, "{apart}");
        for kind in [ToolKind::Box, ToolKind::Square, ToolKind::Floor, ToolKind::Circle, ToolKind::Hexagon] {
            let tool = Tool::new(kind, [43.0, 50.0]);
            let apart = distance(both(tool, falling));
            let missed = distance([both(tool, falling)[0], both(far, falling)[1]]);
            assert!(apart < 1.0 && missed > 3.0, "{kind}: {apart}, {missed}");
        }
    }

    #[test]
    fn a_bucket_captures_from_above_and_a_fan_has_no_effect() {
        let falling = BallState { velocity: [0.0, -8.0], ..BallState::at_rest([42.0, 60.0]) };
        let [predicted, real] = both(Tool::new(ToolKind::Bucket, [42.0, 50.0]), falling);
        assert_eq!(predicted.position, real.position);
        let fan = Tool::new(ToolKind::Fan, [42.0, 50.0]);
        let free = both(Tool::new(ToolKind::Box, [10.0, 10.0]), falling)[0];
        assert_eq!(both(fan, falling)[0], free);
    }
}
