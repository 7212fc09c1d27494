//! What each structural assumption of section 4.1 is worth: the whole model and three
//! models with one assumption switched off, trained on the same launches.

use serde::{Deserialize, Serialize};

use super::config::{Coordinates, EdgeActivation, EdgeFunctions, ModelConfig, TrainConfig};
use super::error::DynamicsError;
use super::evaluate::{Evaluation, EvaluationConfig, evaluate};
use super::train::{Ended, Progress, Training};
use crate::physics::ToolKind;
use crate::task::Task;

/// A model with at most one structural assumption switched off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// All three assumptions.
    Full,
    /// One edge function for all pairs of object types.
    SharedEdges,
    /// All edges always active.
    FullyConnected,
    /// Positions on the screen, not relative to the ball.
    AbsoluteCoordinates,
}

impl Variant {
    /// The four variants.
    pub const ALL: [Variant; 4] = [Self::Full, Self::SharedEdges, Self::FullyConnected, Self::AbsoluteCoordinates];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::SharedEdges => "shared edge function",
            Self::FullyConnected => "fully connected",
            Self::AbsoluteCoordinates => "absolute coordinates",
        }
    }

    /// The configuration with this assumption switched off.
    pub fn apply(self, mut config: ModelConfig) -> ModelConfig {
        match self {
            Self::Full => {}
            Self::SharedEdges => config.edge_functions = EdgeFunctions::Shared,
            Self::FullyConnected => config.edges = EdgeActivation::FullyConnected,
            Self::AbsoluteCoordinates => config.coordinates = Coordinates::Absolute,
        }
        config
    }
}

/// One trained and evaluated variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ablated {
    /// Which assumption is off.
    pub variant: Variant,
    /// Seed of the launches, of the initial weights and of the batches.
    pub seed: u64,
    /// How the training ended, if not by doing all epochs.
    pub failure: Option<String>,
    /// Its errors on what it never saw.
    pub evaluation: Evaluation,
}

/// Trains and evaluates all variants with each of `seeds`. Variants of one seed learn from
/// the same launches and are evaluated on the same ones. `watch` sees every epoch's
/// progress; when it returns false, the results so far are returned.
///
/// # Errors
/// When a setting or the tool set is not usable.
pub fn ablate(
    config: &ModelConfig,
    training: &TrainConfig,
    tools: &[ToolKind],
    seeds: &[u64],
    tasks: &[Task],
    evaluation: &EvaluationConfig,
    mut watch: impl FnMut(Variant, u64, &Progress) -> bool,
) -> Result<Vec<Ablated>, DynamicsError> {
    let mut results = Vec::new();
    for &seed in seeds {
        for variant in Variant::ALL {
            let settings = TrainConfig { seed, ..training.clone() };
            let mut training = Training::new(variant.apply(config.clone()), settings, tools, "mge dynamics ablate")?;
            let failure = match training.run(|_, progress| watch(variant, seed, progress)) {
                Ended::Done => None,
                Ended::Stopped => return Ok(results),
                Ended::Diverged { reason, .. } => Some(reason),
            };
            let evaluation = evaluate(training.model(), tasks, evaluation)?;
            results.push(Ablated { variant, seed, failure, evaluation });
        }
    }
    Ok(results)
}
