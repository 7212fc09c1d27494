//! Settings of a dynamics model, its training and the launches it learns from.

use std::str::FromStr;

use derive_more::Display;
use educe::Educe;
use serde::{Deserialize, Serialize};

use super::error::{DynamicsError, Result};
use mge_base::validation::{Setting, ValidationError, check_settings};
use mge_nn::OptimiserKind;
use mge_physics::STEPS_PER_ACTION;

/// Structure, inputs and targets of a dynamics model (paper, sections 4.1 and A.1). The
/// three structural assumptions of section 4.1 are the first three fields.
#[derive(Debug, Clone, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct ModelConfig {
    /// Assumption 1: one edge function for each pair of object types, or one for all.
    pub edge_functions: EdgeFunctions,
    /// Assumption 2: edges only between nearby objects, or between all.
    pub edges: EdgeActivation,
    /// Assumption 3: positions relative to the ball, or absolute positions on the screen.
    pub coordinates: Coordinates,
    /// The distance that edges carry.
    pub geometry: Geometry,
    /// Largest distance of an active edge, in units.
    #[educe(Default = 8.0)]
    pub cutoff: f32,
    /// Physics steps from one prediction to the next.
    #[educe(Default = 5)]
    pub interval: u32,
    /// What the decoder predicts.
    pub targets: Targets,
    /// Tools have all properties of CREATE's tools, and edges carry them; otherwise tools differ in
    /// size only.
    // Models without properties are written in the older format, which had no such field.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub properties: bool,
    /// The ball's spin is part of its state.
    #[educe(Default = true)]
    pub spin: bool,
    /// Dense layers of every edge function and of the node function (table 1).
    #[educe(Default = 17)]
    pub layers: usize,
    /// Hidden size of all networks.
    #[educe(Default = 64)]
    pub width: usize,
    /// Size of messages and of the node embedding.
    #[educe(Default = 20)]
    pub embedding: usize,
}

/// Whether each pair of object types has its own edge function.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeFunctions {
    /// One for each edge type.
    #[default]
    Distinct,
    /// One for all; the one-hot types in its input distinguish them.
    Shared,
}

/// Which edges are active.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeActivation {
    /// Those no longer than the cutoff.
    #[default]
    Dynamic,
    /// All, however far the tool is.
    FullyConnected,
}

/// The origin of positions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Coordinates {
    /// The ball, the reference object.
    #[default]
    Relative,
    /// The middle of the screen.
    Absolute,
}

/// The distance between ball and tool.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Between the centres: the paper's literal reading.
    Centre,
    /// From the ball's centre to the tool's surface, with the nearest point of the
    /// surface and the tool's half extents.
    #[default]
    Surface,
}

/// What the decoder's outputs mean.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Targets {
    /// The next position only: the paper's literal reading.
    Position,
    /// Displacement beyond that of the current velocity, and change of velocity.
    #[default]
    Residual,
}

impl ModelConfig {
    /// The paper's literal reading: predicts the position after a whole action interval, from
    /// centre distances. The cutoff covers the distance that a fast ball moves in that time.
    pub fn literal() -> Self {
        Self {
            geometry: Geometry::Centre,
            cutoff: 40.0,
            interval: STEPS_PER_ACTION,
            targets: Targets::Position,
            spin: false,
            ..Self::default()
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<()> {
        check_settings(self, &MODEL_SETTINGS)?;
        let error = |path, message| Err(ValidationError::new(path, message).into());
        if !STEPS_PER_ACTION.is_multiple_of(self.interval) {
            return error("interval", "must divide the 40 physics steps of an action");
        }
        if self.spin && self.targets == Targets::Position {
            return error("spin", "cannot be predicted when the targets are positions only");
        }
        Ok(())
    }
}

/// The numeric settings of [`ModelConfig`].
pub const MODEL_SETTINGS: [Setting; 5] = [
    Setting::number("cutoff", 1e-3, 1000.0, "largest distance of an active edge, in units"),
    Setting::count("interval", 1, STEPS_PER_ACTION as u64, "physics steps from one prediction to the next"),
    Setting::count("layers", 1, 64, "dense layers of every edge function and of the node function"),
    Setting::count("width", 1, 1024, "hidden size of all networks"),
    Setting::count("embedding", 1, 1024, "size of messages and of the node embedding"),
];

/// The numeric settings of [`TrainConfig`].
pub const TRAIN_SETTINGS: [Setting; 8] = [
    Setting::count("observations", 1, 1_000_000, "one-step observations (launches) for each tool type"),
    Setting::count("validation", 1, 100_000, "launches for each tool type that measure the error"),
    Setting::count("epochs", 1, 10_000_000, "passes over the observations"),
    Setting::count("batch", 1, 65_536, "rows in a batch"),
    Setting::number("learning_rate", 1e-30, 1e30, "learning rate at the start"),
    Setting::number("contact_share", 0.0, 1.0, "share of rows drawn from those close to a contact"),
    Setting::number("bystanders", 0.0, 1.0, "share of rows with a second tool near that the ball does not touch"),
    Setting::count("seed", 0, u64::MAX, "seed of launches, initial weights and batches"),
];

/// How a model is trained (paper, table 1).
#[derive(Debug, Clone, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct TrainConfig {
    /// One-step observations (launches) for each tool type.
    #[educe(Default = 1000)]
    pub observations: usize,
    /// Launches for each tool type that measure the error and are never trained on.
    #[educe(Default = 100)]
    pub validation: usize,
    /// Passes over the observations; each pass uses one row of every observation.
    #[educe(Default = 5000)]
    pub epochs: u32,
    /// Rows in a batch.
    #[educe(Default = 128)]
    pub batch: usize,
    /// Learning rate at the start.
    #[educe(Default = 1e-4)]
    pub learning_rate: f32,
    /// Learning-rate schedule.
    pub schedule: RateSchedule,
    /// Optimiser of all weights.
    pub optimiser: OptimiserKind,
    /// Loss of the normalised outputs.
    pub loss: Loss,
    /// Also train on the mirror image of every launch (left and right swapped).
    #[educe(Default = true)]
    pub mirror: bool,
    /// Share of rows drawn from those close to a contact; the rest is drawn from all.
    #[educe(Default = 0.5)]
    pub contact_share: f32,
    /// Share of rows with a second tool near the ball, which the ball does not touch.
    pub bystanders: f32,
    /// Seed of launches, initial weights and batches.
    pub seed: u64,
}

/// The learning rate as a function of training's progress.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RateSchedule {
    /// Constant.
    Constant,
    /// Half a cosine from the full rate to 0.
    #[default]
    Cosine,
}

/// The loss of one normalised output.
#[derive(Debug, Clone, Copy, Display, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Loss {
    /// `squared`: the squared error.
    #[display("squared")]
    Squared,
    /// `huber:WIDTH`: Huber's loss, half the squared error up to this width and linear beyond.
    #[display("huber:{_0}")]
    Huber(f32),
}

impl Default for Loss {
    fn default() -> Self {
        Self::Huber(0.1)
    }
}

impl Loss {
    /// The loss of one error.
    pub fn of(self, error: f64) -> f64 {
        match self {
            Self::Squared => error * error,
            Self::Huber(width) => {
                let (width, size) = (f64::from(width), error.abs());
                if size < width { size * size / 2.0 } else { width * (size - width / 2.0) }
            }
        }
    }
}

impl From<Loss> for String {
    fn from(loss: Loss) -> Self {
        loss.to_string()
    }
}

impl TryFrom<String> for Loss {
    type Error = DynamicsError;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl FromStr for Loss {
    type Err = DynamicsError;

    fn from_str(text: &str) -> Result<Self> {
        let width = |text: &str| text.parse().ok().filter(|width: &f32| *width > 0.0 && width.is_finite());
        match text.split_once(':') {
            None if text == "squared" => Some(Self::Squared),
            Some(("huber", text)) => width(text).map(Self::Huber),
            _ => None,
        }
        .ok_or_else(wrong_loss)
    }
}

fn wrong_loss() -> DynamicsError {
    ValidationError::new("loss", "must be squared or huber:WIDTH, such as huber:0.1").into()
}

impl TrainConfig {
    /// The paper's literal reading: only observed launches, rows drawn uniformly, squared error,
    /// constant learning rate.
    pub fn literal() -> Self {
        Self {
            schedule: RateSchedule::Constant,
            loss: Loss::Squared,
            mirror: false,
            contact_share: 0.0,
            ..Self::default()
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<()> {
        check_settings(self, &TRAIN_SETTINGS)?;
        match self.loss {
            Loss::Huber(width) if !(width > 0.0 && width.is_finite()) => Err(wrong_loss()),
            Loss::Huber(_) | Loss::Squared => Ok(()),
        }
    }

    /// The learning rate at `progress`, the share of all updates that is done, from 0 to 1.
    pub fn rate(&self, progress: f64) -> f32 {
        match self.schedule {
            RateSchedule::Constant => self.learning_rate,
            RateSchedule::Cosine => {
                (f64::from(self.learning_rate) * 0.5 * (1.0 + (std::f64::consts::PI * progress).cos())) as f32
            }
        }
    }
}
