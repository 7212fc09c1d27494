//! An action and its outcome.

use rand::Rng;
use serde::{Deserialize, Serialize, Serializer};

/// A tool placement: normalised x and y in [-1, 1].
pub type Action = [f32; 2];

/// An action drawn uniformly from [-1, 1] x [-1, 1].
pub fn uniform_action(rng: &mut impl Rng) -> Action {
    [rng.gen_range(-1.0..=1.0), rng.gen_range(-1.0..=1.0)]
}

/// Whether an action's tool was placed, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// The tool was placed.
    Placed,
    /// Too near a tool placed earlier in the episode.
    Overlap,
    /// Its shape would touch something.
    Collision,
    /// The action is not a pair of finite numbers.
    Invalid,
    /// The action asked for no tool.
    NoOp,
}

/// Why an episode is over; of several reasons the first here is given. Logs, JSON and Python have its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EndReason {
    /// The goal was reached (terminated).
    Goal,
    /// The target ball's centre left the screen (terminated).
    OutOfBounds,
    /// The marker ball left the screen before the target moved (terminated).
    MarkerOut,
    /// Nothing moves (terminated).
    Standstill,
    /// The maximum number of actions was reached (truncated).
    MaxActions,
}

mge_base::by_name!(EndReason, "end of an episode", {
    Goal = "goal", OutOfBounds = "left the screen", MarkerOut = "marker left the screen",
    Standstill = "standstill", MaxActions = "out of actions"
});

impl Serialize for EndReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The outcome of one action.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The observation after the action.
    pub observation: Vec<f32>,
    /// Sum of the reward terms that applied.
    pub reward: f32,
    /// The task itself ended the episode.
    pub terminated: bool,
    /// The maximum number of actions ended the episode.
    pub truncated: bool,
    /// The reason, if the episode is over.
    pub end: Option<EndReason>,
    /// Whether the tool was placed, and if not, why.
    pub placement: Placement,
    /// Subgoals reached in this action.
    pub subgoals: Vec<usize>,
    /// The goal was reached in this action.
    pub goal: bool,
    /// Tools placed by the agent (by order of placement) that a ball or box touched in this action before the first of
    /// `subgoals` or the goal was reached. The marker, for example, can push the target.
    pub touched: Vec<usize>,
}

impl Step {
    /// Whether a subgoal or the goal was reached in this action.
    pub fn reached_stage(&self) -> bool {
        self.goal || !self.subgoals.is_empty()
    }
}

/// `step` was called after the episode was over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the episode is over: reset the environment before the next step")]
pub struct EpisodeOver;
