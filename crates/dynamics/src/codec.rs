//! Conversion between states of the ball and the network's targets and outputs.
//! [`Codec::decode`] is the inverse of [`Codec::encode`].

use super::config::{Coordinates, ModelConfig, Targets};
use super::graph::normalised_length;
use mge_env::VELOCITY_SCALE;
use mge_physics::{Ball, BallState, GRAVITY, PHYSICS_DT, SCREEN};

/// Turns pairs of states into targets and outputs into states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Codec {
    targets: Targets,
    coordinates: Coordinates,
    spin: bool,
    /// Time from one prediction to the next, in seconds.
    seconds: f32,
    /// Radius of the ball in units.
    pub(super) radius: f32,
}

impl Codec {
    /// The codec of a model's configuration.
    pub fn new(config: &ModelConfig) -> Self {
        Self {
            targets: config.targets,
            coordinates: config.coordinates,
            spin: config.spin,
            seconds: config.interval as f32 * PHYSICS_DT,
            radius: Ball::default().radius,
        }
    }

    /// Number of outputs of a prediction. Position: x, y. Residual: displacement beyond `v t` (x,
    /// y), change of velocity (x, y), change of spin if it is modelled.
    pub fn outputs(&self) -> usize {
        match self.targets {
            Targets::Position => 2,
            Targets::Residual => 4 + usize::from(self.spin),
        }
    }

    /// Appends the target for a ball that goes from `before` to `after`.
    pub fn encode(&self, before: &BallState, after: &BallState, target: &mut Vec<f32>) {
        match self.targets {
            Targets::Position => {
                let origin = self.origin(before);
                target.extend((0..2).map(|axis| normalised_length(after.position[axis] - origin[axis])));
            }
            Targets::Residual => {
                let straight = |axis: usize| before.position[axis] + before.velocity[axis] * self.seconds;
                target.extend((0..2).map(|axis| normalised_length(after.position[axis] - straight(axis))));
                target.extend((0..2).map(|axis| (after.velocity[axis] - before.velocity[axis]) / VELOCITY_SCALE));
                if self.spin {
                    target.push((after.angular_velocity - before.angular_velocity) / self.spin_scale());
                }
            }
        }
    }

    /// The state that `output` predicts for a ball in state `before`. If only positions are
    /// predicted, the velocity is the mean velocity, corrected for gravity.
    pub fn decode(&self, before: &BallState, output: &[f32]) -> BallState {
        let length = |output: f32| output * SCREEN / 2.0;
        let mut after = *before;
        match self.targets {
            Targets::Position => {
                let origin = self.origin(before);
                for axis in 0..2 {
                    after.position[axis] = origin[axis] + length(output[axis]);
                    after.velocity[axis] = (after.position[axis] - before.position[axis]) / self.seconds
                        + GRAVITY[axis] * self.seconds / 2.0;
                }
            }
            Targets::Residual => {
                for axis in 0..2 {
                    after.position[axis] += before.velocity[axis] * self.seconds + length(output[axis]);
                    after.velocity[axis] += output[2 + axis] * VELOCITY_SCALE;
                }
                if self.spin {
                    after.angular_velocity += output[4] * self.spin_scale();
                }
            }
        }
        after
    }

    fn origin(&self, before: &BallState) -> [f32; 2] {
        match self.coordinates {
            Coordinates::Relative => before.position,
            Coordinates::Absolute => [SCREEN / 2.0; 2],
        }
    }

    /// The spin at which the ball's surface has the speed [`VELOCITY_SCALE`].
    fn spin_scale(&self) -> f32 {
        VELOCITY_SCALE / self.radius
    }
}
