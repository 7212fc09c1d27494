//! The schema of task files.

use educe::Educe;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::objects::{BallSpec, BoxSpec, Goal, Marker, Region};
use super::part::{Part, Shift};
use super::rules::Rules;
use super::tools::{Form, Placeable, ToolSpec};
use mge_physics::ToolKind;

/// The format version that this program reads and writes.
pub const VERSION: u32 = 1;

/// A puzzle: scene, placeable tool, subgoals, goal and rules. Deserialising validates it, so that every task read
/// from a file is playable. The default is an empty scene.
#[derive(Debug, Clone, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
// Derives `Task::deserialize` without validation, which the trait implementation below calls.
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Task {
    /// Format version, [`VERSION`].
    #[educe(Default = VERSION)]
    pub version: u32,
    /// Short name, as on the command line.
    pub name: String,
    /// A description in one sentence.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// The target ball.
    #[educe(Default(expression = BallSpec::at([0.0, 0.8])))]
    pub ball: BallSpec,
    /// A second ball that must set the target ball in motion (CREATE's marker levels).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<Marker>,
    /// Other moving balls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub balls: Vec<BallSpec>,
    /// Moving boxes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxSpec>,
    /// Static tools of the scene.
    #[serde(default)]
    pub tools: Vec<ToolSpec>,
    /// The tool the agent places.
    #[educe(Default(expression = Placeable { kind: ToolKind::Box, form: Form::default() }))]
    pub placeable: Placeable,
    /// Regions the ball must reach before the goal, in order.
    #[serde(default)]
    pub subgoals: Vec<Region>,
    /// Actions in the real environment of the searches that proposed subgoals; every run on the task is charged for
    /// them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub search_actions: u64,
    /// The final goal.
    #[educe(Default(expression = Goal::at([0.0, -0.8])))]
    pub goal: Goal,
    /// Limits, rewards and termination.
    #[serde(default)]
    pub rules: Rules,
    /// The order in which the parts are added to the world, if it is not the default: target, marker, goal, balls,
    /// boxes, subgoals, the marker's subgoals, tools. The solving order of simultaneous contacts of a ball depends on
    /// it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<Part>,
    /// Random shifts of parts, drawn in every episode.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shifts: Vec<Shift>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(actions: &u64) -> bool {
    *actions == 0
}

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let task = Self::deserialize(deserializer)?;
        task.validate().map_err(D::Error::custom)?;
        Ok(task)
    }
}

impl Serialize for Task {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl Task {
    /// Subgoals in order, then the goal: the stages of guidance.
    pub fn stages(&self) -> Vec<Region> {
        self.subgoals.iter().copied().chain([self.goal.region()]).collect()
    }

    /// Number of [stages](Self::stages): the subgoals and the goal.
    pub fn stage_count(&self) -> usize {
        self.subgoals.len() + 1
    }

    /// The distinct tool types of the scene and the agent, in the order of [`ToolKind::ALL`]: the tool set that a
    /// dynamics model of this task must cover.
    pub fn tool_set(&self) -> Vec<ToolKind> {
        let used = |kind: &ToolKind| self.placeable.kind == *kind || self.tools.iter().any(|tool| tool.kind == *kind);
        ToolKind::ALL.into_iter().filter(used).collect()
    }
}
