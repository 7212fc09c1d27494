//! Velocities of a ball while the solver applies impulses.

use rapier2d::prelude::*;

/// Velocities of one ball while impulses act, with its inverse mass and inertia.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    pub velocity: Vector,
    pub angular_velocity: f32,
    pub bias_velocity: Vector,
    pub bias_angular_velocity: f32,
    pub inverse_mass: f32,
    pub inverse_inertia: f32,
}

impl Motion {
    /// Velocity at the end of an arm from the centre.
    pub fn at(&self, arm: Vector) -> Vector {
        self.velocity + arm.perp() * self.angular_velocity
    }

    /// Bias velocity at the end of an arm from the centre.
    pub fn bias_at(&self, arm: Vector) -> Vector {
        self.bias_velocity + arm.perp() * self.bias_angular_velocity
    }

    /// Applies an impulse at the end of an arm.
    pub fn push(&mut self, impulse: Vector, arm: Vector) {
        self.velocity += impulse * self.inverse_mass;
        self.angular_velocity += arm.perp_dot(impulse) * self.inverse_inertia;
    }

    /// Applies a bias impulse at the end of an arm.
    pub fn push_bias(&mut self, impulse: Vector, arm: Vector) {
        self.bias_velocity += impulse * self.inverse_mass;
        self.bias_angular_velocity += arm.perp_dot(impulse) * self.inverse_inertia;
    }

    /// Inverse of the mass that an impulse in this direction at the end of an arm meets.
    pub fn inverse_effective_mass(&self, arm: Vector, direction: Vector) -> f32 {
        self.inverse_mass + self.inverse_inertia * arm.perp_dot(direction).powi(2)
    }
}
