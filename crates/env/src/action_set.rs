//! The tools an agent can choose from, and their properties as numbers.

use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};

use super::action::Action;
use mge_physics::{NO_OP, Tool, ToolKind, catalogue_tool};

/// An action: a tool of the action set and a position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Index into the action set; 0 if the agent has only the task's own tool.
    pub tool: usize,
    /// Normalised position.
    pub place: Action,
}

impl From<Action> for Choice {
    /// The task's own tool, for an agent without an action set.
    fn from(place: Action) -> Self {
        Self { tool: 0, place }
    }
}

/// Tools with their catalogue numbers; cheap to clone.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ActionSet {
    entries: Arc<[(usize, Option<Tool>)]>,
    /// The [`tool_features`] of all entries; every observation has them.
    features: Arc<[f32]>,
}

impl ActionSet {
    /// Tools by number; None is the no-op, which places nothing.
    pub fn new(entries: impl IntoIterator<Item = (usize, Option<Tool>)>) -> Self {
        let entries: Arc<[(usize, Option<Tool>)]> = entries.into_iter().collect();
        let features = entries.iter().flat_map(|(_, tool)| tool_features(tool.as_ref())).collect();
        Self { entries, features }
    }

    /// Tools of the catalogue; a number outside it is the no-op.
    pub fn of_catalogue(numbers: &[usize]) -> Self {
        // A reset draws a new set, whose angles would take sines and cosines.
        static FEATURES: LazyLock<Vec<[f32; TOOL_FEATURES]>> =
            LazyLock::new(|| (0..=NO_OP).map(|number| tool_features(catalogue_tool(number))).collect());
        let entries = numbers.iter().map(|&number| (number, catalogue_tool(number).copied())).collect();
        let mut features = Vec::with_capacity(numbers.len() * TOOL_FEATURES);
        numbers.iter().for_each(|&number| features.extend(FEATURES[number.min(NO_OP)]));
        Self { entries, features: features.into() }
    }

    /// Number of entries, the no-op included.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The numbers of the tools.
    pub fn numbers(&self) -> impl ExactSizeIterator<Item = usize> {
        self.entries.iter().map(|(number, _)| *number)
    }

    /// The tools at the origin; None is the no-op.
    pub fn tools(&self) -> impl ExactSizeIterator<Item = Option<&Tool>> {
        self.entries.iter().map(|(_, tool)| tool.as_ref())
    }

    /// The [`tool_features`] of all entries, one after the other.
    pub fn features(&self) -> &[f32] {
        &self.features
    }

    /// The entry at an index, if there is one: a tool at the origin, or None for the no-op.
    pub fn get(&self, index: usize) -> Option<Option<&Tool>> {
        self.entries.get(index).map(|(_, tool)| tool.as_ref())
    }
}

/// Numbers that describe a tool: one-hot of its type, in the order of [`ToolKind::ALL`], then
/// [`TOOL_PROPERTIES`].
pub const TOOL_FEATURES: usize = ToolKind::ALL.len() + TOOL_PROPERTIES.len();

/// Names of the numbers that follow a tool's type. Scaling: 1 stands for a size of 20 units, a force of 100, a speed
/// of 10 units/s and a mass of 10; `max_angle` is in units of pi/2; `roll_friction` is the excess over 1.
pub const TOOL_PROPERTIES: [&str; 12] = [
    "size",
    "thickness",
    "cos_angle",
    "sin_angle",
    "elasticity",
    "friction",
    "force",
    "velocity",
    "max_angle",
    "on_left",
    "weight",
    "roll_friction",
];

/// The [`TOOL_FEATURES`] of a tool; properties that its type does not use are 0. The no-op is all zeros.
pub fn tool_features(tool: Option<&Tool>) -> [f32; TOOL_FEATURES] {
    use ToolKind::SeeSaw;
    let mut features = [0.0; TOOL_FEATURES];
    let Some(tool) = tool else { return features };
    let (kinds, properties) = features.split_at_mut(ToolKind::ALL.len());
    kinds[tool.kind.index()] = 1.0;
    let only = |used: bool, value: f64| if used { value as f32 } else { 0.0 };
    properties.copy_from_slice(&[
        (tool.size / 20.0) as f32,
        only(tool.kind.is_segment(), tool.radius),
        pxfm::f_cos(tool.angle) as f32,
        pxfm::f_sin(tool.angle) as f32,
        only(!tool.kind.is_sensor(), tool.elasticity),
        only(!tool.kind.is_sensor(), tool.friction),
        only(tool.kind.has_force(), tool.force / 100.0),
        only(tool.kind.has_velocity(), tool.velocity / 10.0),
        only(tool.kind.has_max_angle(), tool.max_angle / std::f64::consts::FRAC_PI_2),
        only(tool.kind == SeeSaw && tool.on_left, 1.0),
        only(tool.kind == SeeSaw, tool.weight / 10.0),
        only(tool.kind.is_hinged(), tool.roll_friction - 1.0),
    ]);
    features
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_differ_between_catalogue_tools_and_are_zero_for_the_no_op() {
        let mut seen: Vec<_> = (0..NO_OP).map(|number| tool_features(catalogue_tool(number))).collect();
        assert!(seen.iter().flatten().all(|value| value.abs() <= 2.0));
        seen.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert!(seen.windows(2).all(|pair| pair[0] != pair[1]));
        assert_eq!(tool_features(None), [0.0; TOOL_FEATURES]);
    }
}
