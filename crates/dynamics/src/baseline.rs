//! The baseline with which a model's errors are compared.

use super::error::Result;
use super::predictor::Predictor;
use mge_physics::{BallState, GRAVITY, PHYSICS_DT, Tool};

/// Free flight: constant horizontal velocity, gravity, no tool has any effect.
#[derive(Debug, Clone, Copy)]
pub struct ConstantVelocity {
    /// Physics steps from one prediction to the next.
    pub interval: u32,
}

impl Predictor for ConstantVelocity {
    fn interval(&self) -> u32 {
        self.interval
    }

    fn advance(&self, balls: &[BallState], _: &[&[Tool]]) -> Result<Vec<BallState>> {
        let steps = self.interval as f32;
        let seconds = steps * PHYSICS_DT;
        // Positions move before gravity acts, so a step only includes the gravity of earlier steps.
        let fall = PHYSICS_DT * PHYSICS_DT * steps * (steps - 1.0) / 2.0;
        let fly = |ball: &BallState| BallState {
            position: std::array::from_fn(|axis| {
                ball.position[axis] + ball.velocity[axis] * seconds + GRAVITY[axis] * fall
            }),
            velocity: std::array::from_fn(|axis| ball.velocity[axis] + GRAVITY[axis] * seconds),
            ..*ball
        };
        Ok(balls.iter().map(fly).collect())
    }
}
