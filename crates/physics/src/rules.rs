//! Effects of tools on the bodies that touch them.
//!
//! A rule moves a body at once, but the body's shape stays in place until the next step's detection. Moving a body
//! resets its idle time.

use rapier2d::prelude::Vector;

use super::body::Body;
use super::direction::{direction, tool_direction};
use super::tool::Tool;
use super::tool_kind::ToolKind;

/// Offset of a cannon's muzzle from its centre, scaled by the direction in which it points.
const MUZZLE: [f64; 2] = [5.0, 3.65];

/// A tool with the corners that the rules compare.
#[derive(Debug)]
pub(super) struct RuleTool {
    pub tool: Tool,
    /// Corners of a bucket or funnel, in the order in which CREATE creates them.
    pub corners: Vec<Vector>,
}

impl Tool {
    /// The direction in which it drives bodies, as a unit vector; None for tools that drive none.
    pub fn drive(&self) -> Option<[f64; 2]> {
        let along = match self.kind {
            ToolKind::Cannon | ToolKind::Fan => direction(self.angle) * self.force.signum(),
            ToolKind::Belt => Vector::new(self.velocity.signum(), 0.0),
            ToolKind::Ladder => direction(self.angle) * self.velocity.signum(),
            _ => return None,
        };
        Some(along.into())
    }
}

/// The effect of a tool on a body. Before the solver, the result says whether the contact is kept; after it, whether
/// the rule changed the body.
pub(super) type Rule = fn(&RuleTool, &mut Body) -> bool;

/// Cannon: moves the body to its muzzle and fires it.
pub(super) fn fire(cannon: &RuleTool, body: &mut Body) -> bool {
    let Tool { position, angle, force, .. } = cannon.tool;
    let aim = tool_direction(angle);
    body.put_to_rest(Vector::from(position) + aim * Vector::from(MUZZLE));
    body.velocity += (aim * force) * body.inverse_mass;
    false
}

/// Fan: applies a force to the body's centre for this step.
pub(super) fn blow(fan: &RuleTool, body: &mut Body) -> bool {
    let local = tool_direction(fan.tool.angle - body.angle) * fan.tool.force;
    body.force += body.frame().rotation * local;
    body.idle = 0.0;
    false
}

/// Belt: sets the body's velocity to its own.
pub(super) fn carry(belt: &RuleTool, body: &mut Body) -> bool {
    body.velocity = Vector::new(belt.tool.velocity, 0.0);
    body.idle = 0.0;
    false
}

/// Ladder: sets a velocity along the ladder, with the horizontal part four times as large.
pub(super) fn climb(ladder: &RuleTool, body: &mut Body) -> bool {
    let Tool { velocity, angle, .. } = ladder.tool;
    let along = tool_direction(angle);
    body.velocity = Vector::new(4.0 * velocity * along.x, velocity * along.y);
    body.idle = 0.0;
    false
}

/// Funnel: a body that is farther from the nozzle than from both upper corners is moved to the nozzle; for others the
/// funnel is solid.
pub(super) fn swallow(funnel: &RuleTool, body: &mut Body) -> bool {
    let [left, nozzle, right] = [0, 1, 2].map(|corner| (body.position - funnel.corners[corner]).length());
    let is_inside = nozzle > left && nozzle > right;
    if is_inside {
        body.put_to_rest(funnel.corners[1]);
    }
    !is_inside
}

/// Bucket: a body nearer to both upper corners than to both lower ones is captured permanently; for others the bucket
/// is solid.
pub(super) fn capture(bucket: &RuleTool, body: &mut Body) -> bool {
    let centre = Vector::from(bucket.tool.position);
    if body.captured {
        body.position = centre;
        body.velocity = Vector::ZERO;
        body.force = Vector::ZERO;
        body.idle = 0.0;
        return false;
    }
    let [d1, d2, d3, d4] = [0, 1, 2, 3].map(|corner| (body.position - bucket.corners[corner]).length());
    let is_above = d1 < d2 && d1 < d3 && d4 < d2 && d4 < d3;
    if is_above {
        body.put_to_rest(centre);
        body.captured = true;
    }
    !is_above
}

/// Plank: rolling friction slows balls. Returns whether it did.
pub(super) fn brake(plank: &RuleTool, body: &mut Body) -> bool {
    let friction = plank.tool.roll_friction;
    let brakes = body.is_round && friction > 1.0;
    if brakes {
        let kept = 1.0 - (friction - 1.0);
        body.spin *= kept;
        body.velocity *= kept;
    }
    brakes
}
