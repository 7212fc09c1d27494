//! Bodies: balls, boxes, their motion, and the ground.

use educe::Educe;
use rapier2d::prelude::*;

use super::direction::rotation;
use super::outline::Outline;
use super::units::DT;
use mge_base::validation::{ValidationError, in_range};

/// Index of the body of everything that does not move.
pub(super) const GROUND: usize = 0;

/// Size and material of a ball, or of a moving box of the same width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Radius in units.
    pub radius: f32,
    /// Mass; the moment of inertia is that of a disc or a square.
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
    /// Checks that the ball can be added to a world.
    ///
    /// # Errors
    /// The first field, by name, whose number is not finite or out of range.
    pub fn check(&self) -> Result<(), ValidationError> {
        in_range(self.radius, "radius", 0.1, 42.0)?;
        in_range(self.mass, "mass", 1e-3, 1e6)?;
        in_range(self.elasticity, "elasticity", 0.0, 1.0)?;
        in_range(self.friction, "friction", 0.0, 100.0)
    }
}

/// Motion of a body: units, units/s, radians (not wrapped), radians/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion<T = f64> {
    /// Centre.
    pub position: [T; 2],
    /// Velocity of the centre.
    pub velocity: [T; 2],
    /// Angle, not wrapped.
    pub angle: T,
    /// Angular velocity.
    pub angular_velocity: T,
}

/// A [`Motion`] in single precision, for networks and screens.
pub type BallState = Motion<f32>;

impl<T: Default> Motion<T> {
    /// A body at rest.
    pub fn at_rest(position: [T; 2]) -> Self {
        Self { position, ..Self::default() }
    }
}

impl BallState {
    /// Speed of the centre in units/s.
    pub fn speed(&self) -> f32 {
        self.velocity[0].hypot(self.velocity[1])
    }
}

impl<T: Copy> Motion<T> {
    /// The motion in another precision.
    fn map<U>(self, convert: impl Fn(T) -> U) -> Motion<U> {
        Motion {
            position: self.position.map(&convert),
            velocity: self.velocity.map(&convert),
            angle: convert(self.angle),
            angular_velocity: convert(self.angular_velocity),
        }
    }
}

impl From<BallState> for Motion {
    fn from(state: BallState) -> Self {
        state.map(f64::from)
    }
}

impl From<Motion> for BallState {
    fn from(motion: Motion) -> Self {
        motion.map(|value| value as f32)
    }
}

/// A body: its motion, the forces on it and its bookkeeping.
#[derive(Debug, Clone, Copy, Educe)]
#[educe(Default)]
pub(super) struct Body {
    pub position: Vector,
    pub velocity: Vector,
    /// Not wrapped.
    pub angle: f64,
    pub spin: f64,
    /// Rotation by the angle; not updated for balls, whose shape does not depend on it.
    rotation: Rotation,
    /// Velocity that removes overlap in the next step; never added to `velocity`.
    pub bias_velocity: Vector,
    pub bias_spin: f64,
    /// Force that acts in this step only.
    pub force: Vector,
    pub mass: f64,
    pub moment: f64,
    pub inverse_mass: f64,
    pub inverse_moment: f64,
    /// How long its energy has been small, in seconds.
    pub idle: f64,
    /// Its shape in its own frame, if it has one, and that shape's index.
    pub outline: Option<Outline>,
    #[educe(Default = u32::MAX)]
    pub shape: u32,
    /// Whether it is round, as a ball: rolling friction applies to it, and its rotation is computed only when something
    /// asks for it.
    pub is_round: bool,
    /// Whether a bucket has captured it.
    pub captured: bool,
    /// The first body of its group and the next body in the group. Awake bodies have these only while a step forms
    /// groups.
    pub root: Option<u32>,
    pub next: Option<u32>,
}

impl Body {
    /// The body of everything that does not move.
    pub fn ground() -> Self {
        let mut ground = Self::new(1.0, 1.0, Motion::default());
        (ground.inverse_mass, ground.inverse_moment) = (0.0, 0.0);
        ground
    }

    pub fn new(mass: f64, moment: f64, motion: Motion) -> Self {
        Self {
            position: motion.position.into(),
            velocity: motion.velocity.into(),
            angle: motion.angle,
            spin: motion.angular_velocity,
            rotation: rotation(motion.angle),
            mass,
            moment,
            inverse_mass: 1.0 / mass,
            inverse_moment: 1.0 / moment,
            ..Self::default()
        }
    }

    pub fn motion(&self) -> Motion {
        Motion {
            position: self.position.into(),
            velocity: self.velocity.into(),
            angle: self.angle,
            angular_velocity: self.spin,
        }
    }

    /// Sets its motion, and resets forces, idle time and capture.
    pub fn set_motion(&mut self, motion: Motion) {
        let Self { outline, shape, is_round, root, next, .. } = *self;
        *self = Self { outline, shape, is_round, root, next, ..Self::new(self.mass, self.moment, motion) };
    }

    pub fn turn_to(&mut self, angle: f64) {
        if angle != self.angle {
            self.angle = angle;
            if !self.is_round {
                self.rotation = rotation(angle);
            }
        }
    }

    /// Moves an outline, whose form in the body's frame is `local`, with the body.
    pub fn place(&self, local: &Outline, outline: &mut Outline) {
        match (&mut *outline, local) {
            // Fast path for most moving shapes: a centred disc does not depend on the rotation.
            (Outline::Disc { centre, .. }, Outline::Disc { centre: local, .. }) if *local == Vector::ZERO => {
                *centre = self.position;
            }
            _ => outline.move_to(local, &self.frame()),
        }
    }

    pub fn frame(&self) -> Pose {
        let rotation = if self.is_round { rotation(self.angle) } else { self.rotation };
        Pose { translation: self.position, rotation }
    }

    pub fn is_asleep(&self) -> bool {
        self.root.is_some()
    }

    /// Integrates the position with the velocities of the previous step.
    pub fn advance(&mut self) {
        self.position += (self.velocity + self.bias_velocity) * DT;
        self.turn_to(self.angle + (self.spin + self.bias_spin) * DT);
        self.bias_velocity = Vector::ZERO;
        self.bias_spin = 0.0;
    }

    /// Applies gravity and the force of this step.
    pub fn accelerate(&mut self, gravity: Vector) {
        self.velocity += (gravity + self.force * self.inverse_mass) * DT;
        self.force = Vector::ZERO;
    }

    /// Adds this step to the idle time, or resets it. A body is idle while its energy is at most what one step of
    /// gravity gives it.
    pub fn count_idle(&mut self, squared_gain: f64) {
        let energy = self.velocity.length_squared() * self.mass + self.spin * self.spin * self.moment;
        self.idle = if energy > self.mass * squared_gain { 0.0 } else { self.idle + DT };
    }

    /// Moves it to `position`, at rest and at angle 0.
    pub fn put_to_rest(&mut self, position: Vector) {
        self.position = position;
        self.velocity = Vector::ZERO;
        self.spin = 0.0;
        self.force = Vector::ZERO;
        self.turn_to(0.0);
        self.idle = 0.0;
    }

    /// Velocity at the end of an arm from the centre.
    pub fn velocity_at(&self, arm: Vector) -> Vector {
        self.velocity + arm.perp() * self.spin
    }

    /// Applies an impulse at the end of an arm.
    pub fn push(&mut self, impulse: Vector, arm: Vector) {
        self.velocity += impulse * self.inverse_mass;
        self.spin += self.inverse_moment * arm.perp_dot(impulse);
    }

    /// Applies a bias impulse at the end of an arm.
    pub fn push_bias(&mut self, impulse: Vector, arm: Vector) {
        self.bias_velocity += impulse * self.inverse_mass;
        self.bias_spin += self.inverse_moment * arm.perp_dot(impulse);
    }
}

/// The one of two bodies that is not `body`.
pub(super) fn other_body(bodies: [u32; 2], body: u32) -> u32 {
    if bodies[0] == body { bodies[1] } else { bodies[0] }
}

/// A shape in the world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// The engine's number of the shape; counts up as shapes are added.
    pub number: u64,
    pub outline: Outline,
    pub bounds: Aabb,
    /// Index of its body.
    pub body: u32,
    /// Position of the body of a shape that does not move.
    pub origin: Vector,
    pub elasticity: f64,
    pub friction: f64,
    pub is_sensor: bool,
    /// The object of the world that it belongs to.
    pub owner: super::touch::ObjectId,
}
