//! What tools do to the bodies that touch them.
//!
//! A rule moves a body at once, but the body's shape stays where it was until the next step's
//! detection. To move a body resets its idle time.

use rapier2d::prelude::Vector;

use super::body::Body;
use super::outline::direction;
use super::tool::Tool;
use super::tool_kind::ToolKind;

/// Half the width of a cannon, of which its muzzle is that far.
const MUZZLE: [f64; 2] = [5.0, 3.65];

/// A tool as the rules see it: with the places that they compare.
#[derive(Debug)]
pub(super) struct Actor {
    pub tool: Tool,
    /// Bucket and funnel: corners, in the order in which CREATE makes them.
    pub corners: Vec<Vector>,
}

impl Tool {
    /// The direction in which it drives bodies, as a unit vector; none for tools that drive none.
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

/// What a tool does to a body. The answer is whether the contact goes on.
pub(super) type Rule = fn(&Actor, &mut Body) -> bool;

/// Cannon: takes the body to its muzzle and throws it.
pub(super) fn fire(cannon: &Actor, body: &mut Body) -> bool {
    let Tool { position, angle, force, .. } = cannon.tool;
    let aim = direction(angle);
    body.put_to_rest(Vector::from(position) + aim * Vector::from(MUZZLE));
    body.velocity += (aim * force) * body.inverse_mass;
    false
}

/// Fan: a force on the centre, which acts in this step.
pub(super) fn blow(fan: &Actor, body: &mut Body) -> bool {
    let local = direction(fan.tool.angle - body.angle) * fan.tool.force;
    body.force += body.frame().vector(local);
    body.idle = 0.0;
    false
}

/// Belt: its own velocity.
pub(super) fn carry(belt: &Actor, body: &mut Body) -> bool {
    body.velocity = Vector::new(belt.tool.velocity, 0.0);
    body.idle = 0.0;
    false
}

/// Ladder: up along it, four times as fast to the side.
pub(super) fn climb(ladder: &Actor, body: &mut Body) -> bool {
    let Tool { velocity, angle, .. } = ladder.tool;
    let along = direction(angle);
    body.velocity = Vector::new(4.0 * velocity * along.x, velocity * along.y);
    body.idle = 0.0;
    false
}

/// Funnel: a body that is farther from the nozzle than from the two upper corners is put on
/// the nozzle; against others it is solid.
pub(super) fn swallow(funnel: &Actor, body: &mut Body) -> bool {
    let [left, nozzle, right] = [0, 1, 2].map(|corner| (body.position - funnel.corners[corner]).length());
    let is_inside = nozzle > left && nozzle > right;
    if is_inside {
        body.put_to_rest(funnel.corners[1]);
    }
    !is_inside
}

/// Bucket: a body nearer to both upper corners than to both lower ones is captured for
/// good; against others the bucket is solid.
pub(super) fn capture(bucket: &Actor, body: &mut Body) -> bool {
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

/// Plank: rolling friction brakes balls. The answer is whether it does.
pub(super) fn brake(plank: &Actor, body: &mut Body) -> bool {
    let friction = plank.tool.roll_friction;
    let brakes = body.is_ball && friction > 1.0;
    if brakes {
        let kept = 1.0 - (friction - 1.0);
        body.spin *= kept;
        body.velocity *= kept;
    }
    brakes
}
