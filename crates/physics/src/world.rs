//! The world: bodies, tools and sensors.

use std::sync::Arc;

use educe::Educe;
use rapier2d::prelude::{BoundingVolume, Pose, Vector};

use super::body::{Ball, BallState, Body, GROUND, Motion, Shape};
use super::broad::{BroadPhase, Candidate, Extent};
use super::closest::Side;
use super::collide::collide;
use super::contact::Contact;
use super::joint::Joint;
use super::outline::Outline;
use super::rules::RuleTool;
use super::tool::Tool;
use super::tool_kind::{STAR_TURN, regular};
use super::touch::{ObjectId, Touch};
use super::units::exact;

/// A static region that detects balls and exerts no force.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensor {
    /// A disc: centre and radius in units.
    Circle { position: [f64; 2], radius: f64 },
    /// The hull of CREATE's star: a pentagon with one corner straight up; centre to corner.
    Star { position: [f64; 2], radius: f64 },
    /// An axis-aligned square: centre and side.
    Square { position: [f64; 2], side: f64 },
}

/// Bodies, tools and sensors under gravity. Cloning takes a snapshot; assigning the
/// clone back restores it exactly, and reuses allocations: snapshots are restored by the thousand.
#[derive(Debug, Educe)]
#[educe(Clone, Default)]
pub struct World {
    pub(super) gravity: Vector,
    /// The ground, then bodies in the order in which they were added.
    #[educe(Default = vec![Body::ground()])]
    pub(super) bodies: Vec<Body>,
    pub(super) shapes: Vec<Shape>,
    /// Number of the next shape.
    next_number: u64,
    pub(super) joints: Vec<Joint>,
    /// Awake bodies and active joints, in the engine's order.
    pub(super) awake: Vec<u32>,
    pub(super) active_joints: Vec<u32>,
    pub(super) broad: BroadPhase,
    /// Contacts, including remembered ones and free slots.
    pub(super) contacts: Vec<Contact>,
    pub(super) free_contacts: Vec<u32>,
    /// The contacts of the latest step in solving order.
    pub(super) order: Vec<u32>,
    /// Number of contact links made so far.
    pub(super) links: u64,
    pub(super) step: u64,
    /// Bodies of balls and boxes, with size and material: a box has those of a ball of the same width.
    balls: Vec<(u32, Ball)>,
    pub(super) tools: Vec<Arc<RuleTool>>,
    /// Shapes of tools and sensors; None for removed sensors.
    tool_shapes: Vec<u32>,
    sensors: Vec<Option<u32>>,
    /// All touches found in the latest step, in the order of detection.
    pub touches: Vec<Touch>,
    /// The balls that a cannon, funnel or bucket moved in the latest step, with the tool.
    pub moved: Vec<Touch>,
    /// Scratch buffer of a step.
    pub(super) candidates: Vec<Candidate>,
}

impl World {
    /// An empty world; gravity in units per second squared.
    pub fn new(gravity: [f32; 2]) -> Self {
        Self { gravity: Vector::from(gravity.map(exact)), ..Self::default() }
    }

    /// Adds a ball and returns its index.
    pub fn add_ball(&mut self, ball: Ball, motion: impl Into<Motion>) -> usize {
        let (mass, radius) = (exact(ball.mass), exact(ball.radius));
        let mut body = Body::new(mass, mass * (0.5 * (radius * radius)), motion.into());
        body.is_round = true;
        self.add_mover(body, Outline::disc(radius), ball)
    }

    /// Adds a moving box as wide as a ball and returns its index; balls and boxes share one numbering.
    pub fn add_box(&mut self, ball: Ball, motion: impl Into<Motion>) -> usize {
        let (mass, side) = (exact(ball.mass), 2.0 * exact(ball.radius));
        let body = Body::new(mass, mass * (1.0 / 12.0) * (side * side + side * side), motion.into());
        self.add_mover(body, Outline::rectangle(side, side), ball)
    }

    fn add_mover(&mut self, mut body: Body, outline: Outline, ball: Ball) -> usize {
        body.outline = Some(outline);
        let body = self.add_body(body);
        let index = self.balls.len();
        self.balls.push((body, ball));
        let material = [ball.elasticity, ball.friction].map(exact);
        self.add_moving_shape(body, outline, material, ObjectId::Ball(index));
        index
    }

    /// Adds a tool and returns its index. As in CREATE, this wakes nothing.
    pub fn add_tool(&mut self, tool: Tool) -> usize {
        let index = self.tools.len();
        let owner = ObjectId::Tool(index);
        self.tools.push(Arc::new(RuleTool { tool, corners: tool.corners() }));
        let shape = self.shapes.len() as u32;
        if tool.kind.is_hinged() {
            self.add_plank(&tool, owner);
        } else {
            let (outline, frame) = tool.local_outline();
            let material = [tool.elasticity, tool.friction];
            self.add_resting_shape(outline, &frame, material, tool.kind.is_sensor(), owner);
        }
        self.tool_shapes.push(shape);
        index
    }

    /// Accounts for a rejected tool: in CREATE it uses up a shape number, on which the order of contacts depends.
    pub fn reject_tool(&mut self, tool: &Tool) {
        if tool.kind.is_hinged() {
            self.broad.make_room();
        }
        self.next_number += 1;
    }

    /// Adds a sensor and returns its index.
    pub fn add_sensor(&mut self, sensor: &Sensor) -> usize {
        let (outline, position) = sensor.outline();
        let frame = Pose::from_translation(position.into());
        let index = self.sensors.len();
        let shape = self.add_resting_shape(outline, &frame, [0.0; 2], true, ObjectId::Sensor(index));
        self.sensors.push(Some(shape));
        index
    }

    /// Removes a sensor; the others keep their indices.
    pub fn remove_sensor(&mut self, index: usize) {
        if let Some(shape) = self.sensors[index].take() {
            self.broad.remove_resting(shape);
            for contact in &mut self.contacts {
                if contact.is_cached && contact.shapes.contains(&shape) {
                    contact.seen = 0;
                }
            }
        }
    }

    pub(super) fn add_body(&mut self, body: Body) -> u32 {
        let index = self.bodies.len() as u32;
        self.bodies.push(body);
        self.awake.push(index);
        index
    }

    pub(super) fn add_joint(&mut self, joint: Joint) {
        self.active_joints.push(self.joints.len() as u32);
        self.joints.push(joint);
    }

    pub(super) fn add_moving_shape(&mut self, body: u32, local: Outline, material: [f64; 2], owner: ObjectId) -> u32 {
        let found = &self.bodies[body as usize];
        let (outline, velocity) = (local.placed(&found.frame()), found.velocity);
        let index = self.push_shape(outline, body, Vector::ZERO, material, false, owner);
        let Shape { number, bounds, .. } = self.shapes[index as usize];
        self.bodies[body as usize].shape = index;
        self.broad.insert_moving(index, number, &Extent { bounds, velocity });
        index
    }

    fn add_resting_shape(
        &mut self,
        local: Outline,
        frame: &Pose,
        material: [f64; 2],
        is_sensor: bool,
        owner: ObjectId,
    ) -> u32 {
        let outline = local.placed(frame);
        let index = self.push_shape(outline, GROUND as u32, frame.translation, material, is_sensor, owner);
        let Shape { number, bounds, .. } = self.shapes[index as usize];
        self.broad.insert_resting(index, number, bounds);
        index
    }

    fn push_shape(
        &mut self,
        outline: Outline,
        body: u32,
        origin: Vector,
        [elasticity, friction]: [f64; 2],
        is_sensor: bool,
        owner: ObjectId,
    ) -> u32 {
        let number = self.next_number;
        self.next_number += 1;
        let bounds = outline.bounds();
        self.shapes.push(Shape { number, outline, bounds, body, origin, elasticity, friction, is_sensor, owner });
        self.shapes.len() as u32 - 1
    }

    /// The tools, in the order in which they were added.
    pub fn tools(&self) -> impl ExactSizeIterator<Item = &Tool> {
        self.tools.iter().map(|actor| &actor.tool)
    }

    /// Motion of a tool's plank and of its weight, if it has them.
    pub fn plank(&self, tool: usize) -> (Option<Motion>, Option<Motion>) {
        let plank = self.shapes[self.tool_shapes[tool] as usize].body;
        if plank == GROUND as u32 {
            return (None, None);
        }
        let has_weight = self.tools[tool].tool.kind == super::ToolKind::SeeSaw;
        let weight = has_weight.then(|| self.bodies[plank as usize + 1].motion());
        (Some(self.bodies[plank as usize].motion()), weight)
    }

    /// Whether a tool's plank is asleep: not simulated until something touches it.
    pub fn is_plank_asleep(&self, tool: usize) -> bool {
        self.bodies[self.shapes[self.tool_shapes[tool] as usize].body as usize].is_asleep()
    }

    /// Number of balls and moving boxes.
    pub fn ball_count(&self) -> usize {
        self.balls.len()
    }

    fn body(&self, ball: usize) -> &Body {
        &self.bodies[self.balls[ball].0 as usize]
    }

    /// Motion of a ball, in single precision.
    pub fn ball(&self, index: usize) -> BallState {
        self.motion(index).into()
    }

    /// Motion of a ball.
    pub fn motion(&self, index: usize) -> Motion {
        self.body(index).motion()
    }

    /// Sets the motion of a ball, wakes it and forgets its contacts.
    pub fn set_ball(&mut self, index: usize, motion: impl Into<Motion>) {
        let body = self.balls[index].0;
        if self.bodies[body as usize].is_asleep() {
            self.wake(body);
        }
        for slot in 0..self.contacts.len() {
            let contact = &mut self.contacts[slot];
            if contact.involves(body) && (contact.is_cached || contact.linked.is_some()) {
                *contact = Contact::default();
                contact.is_cached = false;
                self.free_contacts.push(slot as u32);
                self.order.retain(|&other| other != slot as u32);
            }
        }
        let found = &mut self.bodies[body as usize];
        found.set_motion(motion.into());
        if let Some(outline) = found.outline {
            let shape = &mut self.shapes[found.shape as usize];
            shape.outline = outline.placed(&found.frame());
            shape.bounds = shape.outline.bounds();
        }
    }

    /// Renumbers balls and sensors without changing the order in which they were added, which decides the order of
    /// contacts: entry i is the old index of the new index i. Only valid before the first step.
    pub fn arrange(&mut self, balls: &[usize], sensors: &[usize]) {
        let new_index = |order: &[usize], old: usize| order.iter().position(|&entry| entry == old).unwrap_or(old);
        for shape in &mut self.shapes {
            shape.owner = match shape.owner {
                ObjectId::Ball(old) => ObjectId::Ball(new_index(balls, old)),
                ObjectId::Sensor(old) => ObjectId::Sensor(new_index(sensors, old)),
                tool => tool,
            };
        }
        self.balls = balls.iter().map(|&old| self.balls[old]).collect();
        self.sensors = sensors.iter().map(|&old| self.sensors[old]).collect();
    }

    /// Size and material of a ball; for a moving box, a ball of the same width.
    pub fn ball_material(&self, index: usize) -> Ball {
        self.balls[index].1
    }

    /// Whether it is a moving box and not a ball.
    pub fn is_box(&self, index: usize) -> bool {
        !self.body(index).is_round
    }

    /// Whether a bucket has captured the ball.
    pub fn is_captured(&self, index: usize) -> bool {
        self.body(index).captured
    }

    /// Whether the ball is asleep: not simulated until something touches it.
    pub fn is_asleep(&self, index: usize) -> bool {
        self.body(index).is_asleep()
    }

    /// Whether a ball overlaps a sensor now.
    pub fn overlaps_sensor(&self, ball: usize, sensor: usize) -> bool {
        self.sensors[sensor].is_some_and(|shape| {
            let shape = &self.shapes[shape as usize];
            // As of the latest step's detection: a rule may have moved the body since.
            overlap(&self.shapes[self.body(ball).shape as usize].outline, &shape.outline, shape.number)
        })
    }

    /// Whether `tool`'s shape overlaps that of a ball, a sensor or a tool.
    pub fn is_obstructed(&self, tool: &Tool) -> bool {
        let outline = tool.outline();
        let bounds = outline.bounds();
        let balls = self.balls.iter().map(|(body, _)| self.bodies[*body as usize].shape);
        let mut others = balls.chain(self.sensors.iter().flatten().copied()).chain(self.tool_shapes.iter().copied());
        others.any(|shape| {
            let shape = &self.shapes[shape as usize];
            let may_touch = shape.bounds.intersects(&bounds) || shape.outline.is_in_line_with(&outline);
            may_touch && overlap(&shape.outline, &outline, 0)
        })
    }
}

/// Whether two outlines in world coordinates touch.
fn overlap(a: &Outline, b: &Outline, number: u64) -> bool {
    let (a, b) = if a.rank() > b.rank() { (b, a) } else { (a, b) };
    let (first, second) = (a.bounds(), b.bounds());
    let touching =
        collide(Side { outline: a, bounds: &first, number }, Side { outline: b, bounds: &second, number }, 0, false);
    !touching.points().is_empty()
}

impl Sensor {
    /// The outline in its own frame, and its position.
    fn outline(&self) -> (Outline, [f64; 2]) {
        match *self {
            Self::Circle { position, radius } => (Outline::disc(radius), position),
            Self::Star { position, radius } => (Outline::hull(&regular(5, STAR_TURN, radius)), position),
            Self::Square { position, side } => (Outline::rectangle(side, side), position),
        }
    }
}
