//! Hinges and see-saws: a plank on a pin, with an angle limit and a weight if the type has them.

use rapier2d::prelude::*;

use super::body::{Body, Motion};
use super::direction::direction;
use super::joint::Joint;
use super::tool::Tool;
use super::tool_kind::ToolKind;
use super::world::World;

/// Mass and moment of inertia of a plank of any length.
const MASS: f64 = 10.0;
const MOMENT: f64 = 10_000.0;
/// Distance from the pin of the point that the limit holds.
const LIMIT_ARM: f64 = 1.0;

impl World {
    /// Adds the parts of a tool with a plank, in the engine's order: shape, plank, joints, weight. Returns the
    /// plank's body.
    pub(super) fn add_plank(&mut self, tool: &Tool, owner: super::ObjectId) -> u32 {
        let place = Vector::from(tool.position);
        let (outline, _) = tool.local_outline();
        let mut body = Body::new(MASS, MOMENT, Motion::at_rest(tool.position));
        body.outline = Some(outline);
        let plank = self.add_body(body);
        self.add_moving_shape(plank, outline, [tool.elasticity, tool.friction], owner);
        self.add_joint(Joint::pin(plank, place));
        if tool.kind != ToolKind::Hinge {
            let anchor = direction(tool.tilt()) * -LIMIT_ARM;
            let longest = 2.0 * LIMIT_ARM * direction(tool.max_angle / 2.0).y;
            self.add_joint(Joint::slide(plank, anchor, place - Vector::X * LIMIT_ARM, longest));
        }
        if tool.kind == ToolKind::SeeSaw {
            let weight_position = place + weight_offset(tool);
            let mut weight = Body::new(tool.weight, tool.weight, Motion::at_rest(weight_position.into()));
            weight.is_round = true;
            let weight = self.add_body(weight);
            self.add_joint(Joint::pivot(plank, weight_position - place, weight));
            self.add_joint(Joint::gear(plank, weight));
        }
        plank
    }
}

/// Offset of a see-saw's weight from its centre: at the lower end.
fn weight_offset(tool: &Tool) -> Vector {
    let angle = if tool.on_left { tool.max_angle } else { std::f64::consts::PI - tool.max_angle };
    let along = direction(angle);
    Vector::new(along.x, -along.y) * (3.0 * tool.size / 8.0)
}
