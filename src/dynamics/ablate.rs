//! What each structural assumption of section 4.1 is worth: the whole model and three
//! models with one assumption switched off, trained on the same launches.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::config::{Coordinates, EdgeActivation, EdgeFunctions, ModelConfig, TrainConfig};
use super::error::DynamicsError;
use super::evaluate::{Evaluation, EvaluationConfig, evaluate};
use super::train::{Ended, Progress};
use super::train_to_file::{TrainedModel, train_to_file};
use crate::physics::ToolKind;
use crate::task::Task;

/// A model with at most one structural assumption switched off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Variant {
    /// `full`: all three assumptions.
    Full,
    /// `shared-edges`: one edge function for all pairs of object types.
    SharedEdges,
    /// `fully-connected`: all edges always active.
    FullyConnected,
    /// `absolute`: positions on the screen, not relative to the ball.
    Absolute,
}

impl Variant {
    /// The four variants.
    pub const ALL: [Variant; 4] = [Self::Full, Self::SharedEdges, Self::FullyConnected, Self::Absolute];

    /// Name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::SharedEdges => "shared-edges",
            Self::FullyConnected => "fully-connected",
            Self::Absolute => "absolute",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::SharedEdges => "shared edge function",
            Self::FullyConnected => "fully connected",
            Self::Absolute => "absolute coordinates",
        }
    }

    /// The configuration with this assumption switched off.
    pub fn apply(self, mut config: ModelConfig) -> ModelConfig {
        match self {
            Self::Full => {}
            Self::SharedEdges => config.edge_functions = EdgeFunctions::Shared,
            Self::FullyConnected => config.edges = EdgeActivation::FullyConnected,
            Self::Absolute => config.coordinates = Coordinates::Absolute,
        }
        config
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Variant {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|variant| variant.name() == text);
        found.ok_or_else(|| format!("unknown variant `{text}`: use {}", known()))
    }
}

/// One trained and evaluated variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ablated {
    /// Which assumption is off.
    pub variant: Variant,
    /// Seed of the launches, of the initial weights and of the batches.
    pub seed: u64,
    /// Why the training ended before all epochs were done, if it did.
    pub failure: Option<String>,
    /// Its errors on what it never saw.
    pub evaluation: Evaluation,
}

/// What all variants have in common.
#[derive(Debug, Clone, Copy)]
pub struct Ablation<'a> {
    /// The model with all assumptions.
    pub model: &'a ModelConfig,
    /// Its training; the seed is that of a variant.
    pub training: &'a TrainConfig,
    /// The tool set.
    pub tools: &'a [ToolKind],
    /// Tasks whose scenes are predicted.
    pub tasks: &'a [Task],
    /// The evaluation.
    pub evaluation: &'a EvaluationConfig,
    /// The command that makes the models again.
    pub command: &'a str,
}

impl Ablation<'_> {
    /// Trains a variant into the file `path` and evaluates it. Variants with one seed learn from
    /// the same launches and are evaluated on the same ones. A training that diverges saves its last
    /// good state and gives the reason. `on_progress` is called after every epoch; if it returns
    /// false, the training stops, and nothing is returned.
    ///
    /// # Errors
    /// As [`train_to_file`] and [`evaluate()`].
    pub fn run(
        &self,
        variant: Variant,
        seed: u64,
        path: &Path,
        on_progress: impl FnMut(&Progress) -> bool,
    ) -> Result<Option<(TrainedModel, Ablated)>, DynamicsError> {
        let (config, settings) = (variant.apply(self.model.clone()), TrainConfig { seed, ..self.training.clone() });
        let trained = train_to_file(path, config, settings, self.tools, self.command, on_progress)?;
        if trained.ended == Ended::Stopped {
            return Ok(None);
        }
        let failure = trained.divergence();
        if failure.is_some() {
            trained.model().save(path)?;
        }
        let evaluation = evaluate(trained.model(), self.tasks, self.evaluation)?;
        Ok(Some((trained, Ablated { variant, seed, failure, evaluation })))
    }
}
