//! Predictors of the ball's motion (learned models, and the baselines they are compared with) and their errors.

use serde::{Deserialize, Serialize};

use super::error::Result;
use super::model::Model;
use mge_base::stop::Stop;
use mge_physics::{BallState, Tool, to_normalised};

/// Predicts the states of balls among static tools one prediction interval ahead.
pub trait Predictor: Sync {
    /// Physics steps from one prediction to the next; divides those of an action.
    fn interval(&self) -> u32;

    /// The state of each ball one interval later; `tools[i]` surround `balls[i]`.
    ///
    /// # Errors
    /// When it cannot predict a scene, for example because it was never trained on a tool type.
    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>>;

    /// As [`advance`](Self::advance), unless `stop` is requested meanwhile.
    ///
    /// # Errors
    /// As [`advance`](Self::advance), and when `stop` is requested.
    fn advance_until(&self, stop: &Stop, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>> {
        let mut next = Vec::with_capacity(balls.len());
        for (balls, tools) in balls.chunks(PREDICTIONS_PER_STOP_CHECK).zip(tools.chunks(PREDICTIONS_PER_STOP_CHECK)) {
            stop.check()?;
            next.extend(self.advance(balls, tools)?);
        }
        Ok(next)
    }
}

/// Number of predictions between two checks for a stop request.
const PREDICTIONS_PER_STOP_CHECK: usize = 2500;

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

/// Distances between predicted and true positions, normalised.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Number of predictions.
    pub count: usize,
    /// Mean of the distances; 0 without predictions.
    pub mean: f64,
    /// Median of the distances; 0 without predictions.
    pub median: f64,
}

impl Errors {
    pub(super) fn of(mut distances: Vec<f64>) -> Self {
        let count = distances.len();
        if count == 0 {
            return Self::default();
        }
        distances.sort_by(f64::total_cmp);
        let median = (distances[(count - 1) / 2] + distances[count / 2]) / 2.0;
        Self { count, mean: distances.iter().sum::<f64>() / count as f64, median }
    }

    pub(super) fn between<'a>(pairs: impl Iterator<Item = (&'a BallState, &'a BallState)>) -> Self {
        Self::of(pairs.map(|(predicted, real)| distance(predicted, real)).collect())
    }
}

pub(super) fn distance(predicted: &BallState, real: &BallState) -> f64 {
    let [a, b] = [predicted, real].map(|ball| to_normalised(ball.position));
    f64::from(a[0] - b[0]).hypot(f64::from(a[1] - b[1]))
}
