//! Balls: what they are made of, how they move, and the body in the world.

use rapier2d::prelude::*;

use super::motion::Motion;
use super::tool::Tool;
use super::units::PHYSICS_DT;
use crate::validation::{ValidationError, in_range};

/// Idle steps in a row after which a resting ball falls asleep (0.3 s).
pub(super) const SLEEP_STEPS: u32 = 9;

/// What a ball is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Radius in units.
    pub radius: f32,
    /// Mass; the moment of inertia is that of a disc.
    pub mass: f32,
    /// Elasticity, multiplied with that of what it touches.
    pub elasticity: f32,
    /// Friction coefficient, multiplied with that of what it touches.
    pub friction: f32,
}

impl Default for Ball {
    fn default() -> Self {
        Self { radius: 4.0, mass: 10.0, elasticity: 1.0, friction: 1.0 }
    }
}

impl Ball {
    /// Whether the numbers make a ball that can move in a world.
    ///
    /// # Errors
    /// The first field, by name, whose number is not finite or out of range.
    pub fn check(&self) -> Result<(), ValidationError> {
        in_range(self.radius, "radius", 0.1, 42.0)?;
        in_range(self.mass, "mass", 1e-3, 1e6)?;
        in_range(self.elasticity, "elasticity", 0.0, 1.0)?;
        in_range(self.friction, "friction", 0.0, 100.0)
    }

    fn inertia(&self) -> f32 {
        self.mass * self.radius * self.radius / 2.0
    }
}

/// How a ball moves: units, units/s, radians (not wrapped), radians/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BallState {
    /// Centre.
    pub position: [f32; 2],
    /// Velocity of the centre.
    pub velocity: [f32; 2],
    /// Angle, not wrapped.
    pub angle: f32,
    /// Angular velocity.
    pub angular_velocity: f32,
}

impl BallState {
    /// A ball at rest.
    pub fn at_rest(position: [f32; 2]) -> Self {
        Self { position, ..Self::default() }
    }

    /// Speed of the centre in units/s.
    pub fn speed(&self) -> f32 {
        self.velocity[0].hypot(self.velocity[1])
    }
}

/// A ball in the world.
#[derive(Debug, Clone)]
pub(super) struct Body {
    pub ball: Ball,
    /// rapier's body: pose, velocities and mass properties.
    pub rigid: RigidBody,
    pub shape: SharedShape,
    /// Not wrapped, unlike the rotation of `rigid`.
    pub angle: f32,
    pub bias_velocity: Vector,
    pub bias_angular_velocity: f32,
    /// Idle steps in a row.
    pub idle: u32,
    pub asleep: bool,
    pub captured: bool,
    /// The lowest-known ball of those that hang together; only valid while a step looks
    /// for sleepers.
    pub group: usize,
}

impl Body {
    pub fn new(ball: Ball, state: BallState) -> Self {
        let mut rigid = RigidBodyBuilder::dynamic()
            .pose(Pose::new(state.position.into(), state.angle))
            .linvel(state.velocity.into())
            .angvel(state.angular_velocity)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, ball.mass, ball.inertia()))
            .build();
        rigid.recompute_mass_properties_from_colliders(&ColliderSet::new());
        Self {
            ball,
            rigid,
            shape: SharedShape::ball(ball.radius),
            angle: state.angle,
            bias_velocity: Vector::ZERO,
            bias_angular_velocity: 0.0,
            idle: 0,
            asleep: false,
            captured: false,
            group: 0,
        }
    }

    pub fn state(&self) -> BallState {
        BallState {
            position: self.rigid.translation().into(),
            velocity: self.rigid.linvel().into(),
            angle: self.angle,
            angular_velocity: self.rigid.angvel(),
        }
    }

    /// Integrates the position with the velocities of the previous step.
    pub fn advance(&mut self) {
        let position = self.rigid.translation() + (self.rigid.linvel() + self.bias_velocity) * PHYSICS_DT;
        self.angle += (self.rigid.angvel() + self.bias_angular_velocity) * PHYSICS_DT;
        self.rigid.set_translation(position, false);
        self.bias_velocity = Vector::ZERO;
        self.bias_angular_velocity = 0.0;
    }

    /// Counts one more idle step, or starts again. A ball is idle while its energy is at
    /// most what one step of gravity gives it.
    pub fn count_idle(&mut self, gravity: Vector) {
        let threshold = (gravity * PHYSICS_DT).length_squared();
        let rotation = self.ball.radius * self.ball.radius / 2.0 * self.rigid.angvel().powi(2);
        let is_idle = self.rigid.linvel().length_squared() + rotation <= threshold;
        self.idle = if is_idle { self.idle.saturating_add(1) } else { 0 };
    }

    pub fn wake(&mut self) {
        self.asleep = false;
        self.idle = 0;
    }

    /// Moves the ball to the bucket's centre, at rest, for good.
    pub fn capture(&mut self, bucket: &Tool) {
        self.rigid.set_translation(bucket.position.into(), false);
        self.rigid.set_linvel(Vector::ZERO, false);
        self.idle = 0;
        if !self.captured {
            self.captured = true;
            self.rigid.set_angvel(0.0, false);
            self.angle = 0.0;
        }
    }

    pub fn motion(&self) -> Motion {
        Motion {
            velocity: self.rigid.linvel(),
            angular_velocity: self.rigid.angvel(),
            bias_velocity: self.bias_velocity,
            bias_angular_velocity: self.bias_angular_velocity,
            inverse_mass: 1.0 / self.ball.mass,
            inverse_inertia: 1.0 / self.ball.inertia(),
        }
    }

    pub fn set_motion(&mut self, motion: &Motion) {
        self.rigid.set_linvel(motion.velocity, false);
        self.rigid.set_angvel(motion.angular_velocity, false);
        self.bias_velocity = motion.bias_velocity;
        self.bias_angular_velocity = motion.bias_angular_velocity;
    }
}
