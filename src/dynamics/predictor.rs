//! Predictors of the ball's motion: learned models, and the baselines they are compared with.

use super::error::Result;
use super::model::Model;
use crate::physics::{BallState, Tool};

/// Predicts the states of balls among static tools one prediction interval ahead.
pub trait Predictor: Sync {
    /// Physics steps from one prediction to the next; divides those of an action.
    fn interval(&self) -> u32;

    /// The state of each ball one interval later; `tools[i]` surround `balls[i]`.
    ///
    /// # Errors
    /// When it cannot predict a scene, for example because it was never trained on a tool type.
    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>>;
}

impl Predictor for Model {
    fn interval(&self) -> u32 {
        self.config.interval
    }

    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>> {
        let mut graphs = self.builder.empty();
        for (ball, tools) in balls.iter().zip(tools) {
            self.builder.push(&mut graphs, ball, *tools)?;
        }
        Ok(self.predict(&mut graphs, balls))
    }
}
