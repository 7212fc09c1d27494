//! The response to contacts in the order and with the constants of CREATE's engine
//! (Chipmunk 7 at a fixed step of 1/30 s): accumulated impulses, separate bias
//! velocities for overlap, elasticity from the velocity before gravity.

use rapier2d::prelude::*;

use super::motion::Motion;
use super::touch::ObjectId;
use super::units::PHYSICS_DT;

/// Iterations of the solver in one step, each over all contacts.
pub(super) const ITERATIONS: usize = 10;
/// Penetration that is left alone, in units; single precision in CREATE's engine too.
const SLOP: f32 = 0.1;
/// Share of the remaining penetration that one step removes: 1 - 0.9^(60 dt). CREATE's engine
/// has 0.9 in single precision, which makes it 0.19000004; the difference is a hundredth of the
/// rounding of a position on the screen.
const BIAS_SHARE: f32 = 0.19;
/// Steps after which a lost contact forgets its accumulated impulses.
const PERSISTENCE: u64 = 3;

/// Geometry of a contact as detection found it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Geometry {
    /// Unit normal from the first ball towards the other object.
    pub normal: Vector,
    /// From the first ball's centre to its surface along the normal.
    pub arm: Vector,
    /// From the other object's centre to its surface; zero for static objects.
    pub other_arm: Vector,
    /// Signed distance of the surfaces, negative when they overlap.
    pub distance: f32,
    /// Product of both elasticities.
    pub elasticity: f32,
    /// Product of both friction coefficients.
    pub friction: f32,
}

/// A contact between a ball and another object, remembered across steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    pub ball: usize,
    /// What it touches: a ball or a tool.
    pub object: ObjectId,
    geometry: Geometry,
    last_seen: u64,
    continued: bool,
    normal_mass: f32,
    tangent_mass: f32,
    target_bias: f32,
    target_bounce: f32,
    normal_impulse: f32,
    tangent_impulse: f32,
    bias_impulse: f32,
}

impl Contact {
    /// A contact that has not been seen yet.
    pub fn new(ball: usize, object: ObjectId) -> Self {
        Self {
            ball,
            object,
            geometry: Geometry::default(),
            last_seen: 0,
            continued: false,
            normal_mass: 0.0,
            tangent_mass: 0.0,
            target_bias: 0.0,
            target_bounce: 0.0,
            normal_impulse: 0.0,
            tangent_impulse: 0.0,
            bias_impulse: 0.0,
        }
    }

    pub fn is_between(&self, ball: usize, object: ObjectId) -> bool {
        self.ball == ball && self.object == object
    }

    /// The second ball, or none when the other object is static.
    fn other(&self) -> Option<usize> {
        match self.object {
            ObjectId::Ball(other) => Some(other),
            ObjectId::Tool(_) | ObjectId::Sensor(_) => None,
        }
    }

    /// Whether detection found the contact in step `step`.
    pub fn is_active(&self, step: u64) -> bool {
        self.last_seen == step
    }

    /// Whether detection missed the contact in step `step`, but not for so long that its
    /// accumulated impulses are lost.
    pub fn is_remembered(&self, step: u64) -> bool {
        self.last_seen < step && step < self.last_seen + PERSISTENCE
    }

    /// Sees the contact again in step `step`. The impulses act again at once only if
    /// it was there in the step before.
    pub fn refresh(&mut self, geometry: Geometry, step: u64) {
        self.continued = self.last_seen + 1 == step;
        self.geometry = geometry;
        self.last_seen = step;
    }

    /// Effective masses, target bias velocity and target bounce, from the velocities
    /// before this step's gravity.
    pub fn prepare(&mut self, motions: &[Motion]) {
        let Geometry { normal, arm, other_arm, distance, elasticity, .. } = self.geometry;
        let (ball, other) = (self.ball, self.other());
        let inverse_mass = |direction: Vector| {
            motions[ball].inverse_effective_mass(arm, direction)
                + other.map_or(0.0, |other| motions[other].inverse_effective_mass(other_arm, direction))
        };
        self.normal_mass = 1.0 / inverse_mass(normal);
        self.tangent_mass = 1.0 / inverse_mass(normal.perp());
        self.target_bias = BIAS_SHARE * (-(distance + SLOP)).max(0.0) / PHYSICS_DT;
        self.target_bounce = elasticity * self.relative_velocity(motions).dot(normal);
        self.bias_impulse = 0.0;
    }

    /// Applies the impulses of the step before again.
    pub fn warm_start(&self, motions: &mut [Motion]) {
        if self.continued {
            self.push(motions, self.normal_impulse, self.tangent_impulse);
        }
    }

    /// One iteration: bias, normal and friction impulse towards their targets.
    pub fn solve(&mut self, motions: &mut [Motion]) {
        let Geometry { normal, arm, other_arm, friction, .. } = self.geometry;
        let velocity = self.relative_velocity(motions);
        let other_bias = self.other().map_or(Vector::ZERO, |other| motions[other].bias_at(other_arm));
        let bias = (other_bias - motions[self.ball].bias_at(arm)).dot(normal);

        let old_bias = self.bias_impulse;
        self.bias_impulse = (old_bias + (self.target_bias - bias) * self.normal_mass).max(0.0);
        let old_normal = self.normal_impulse;
        let change = -(self.target_bounce + velocity.dot(normal)) * self.normal_mass;
        self.normal_impulse = (old_normal + change).max(0.0);
        let limit = friction * self.normal_impulse;
        let old_tangent = self.tangent_impulse;
        let change = -velocity.dot(normal.perp()) * self.tangent_mass;
        self.tangent_impulse = (old_tangent + change).max(-limit).min(limit);

        let impulse = normal * (self.bias_impulse - old_bias);
        motions[self.ball].push_bias(-impulse, arm);
        if let Some(other) = self.other() {
            motions[other].push_bias(impulse, other_arm);
        }
        self.push(motions, self.normal_impulse - old_normal, self.tangent_impulse - old_tangent);
    }

    fn push(&self, motions: &mut [Motion], along_normal: f32, along_tangent: f32) {
        let Geometry { normal, arm, other_arm, .. } = self.geometry;
        let impulse = normal * along_normal + normal.perp() * along_tangent;
        motions[self.ball].push(-impulse, arm);
        if let Some(other) = self.other() {
            motions[other].push(impulse, other_arm);
        }
    }

    /// Velocity of the other object relative to the ball at the contact.
    fn relative_velocity(&self, motions: &[Motion]) -> Vector {
        let other = self.other().map_or(Vector::ZERO, |other| motions[other].at(self.geometry.other_arm));
        other - motions[self.ball].at(self.geometry.arm)
    }
}
