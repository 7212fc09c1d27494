//! The world: balls, static tools and sensors.

use std::sync::Arc;

use rapier2d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier2d::parry::query;
use rapier2d::prelude::*;

use super::body::{Ball, BallState, Body};
use super::contact::Contact;
use super::motion::Motion;
use super::tool::Tool;
use super::touch::{ObjectId, Touch};

/// A static region that notices balls and exerts no force.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensor {
    /// A disc: centre and radius in units.
    Circle { position: [f32; 2], radius: f32 },
    /// A convex polygon: counter-clockwise world vertices in units.
    Polygon { vertices: Vec<[f32; 2]> },
}

/// A static tool and its rapier collider.
#[derive(Debug)]
pub(super) struct StaticTool {
    pub tool: Tool,
    pub collider: Collider,
    pub bounds: Aabb,
}

/// The placed shape of a sensor.
#[derive(Debug)]
struct Region {
    pose: Pose,
    shape: SharedShape,
    bounds: Aabb,
}

/// Balls, tools and sensors under gravity. Cloning takes a snapshot; assigning the
/// clone back restores it exactly.
#[derive(Debug, Clone)]
pub struct World {
    pub(super) gravity: Vector,
    pub(super) balls: Vec<Body>,
    pub(super) tools: Vec<Arc<StaticTool>>,
    sensors: Vec<Option<Arc<Region>>>,
    /// Contacts of the latest step in the order of detection, then those lost lately.
    pub(super) contacts: Vec<Contact>,
    pub(super) touches: Vec<Touch>,
    /// Buffers of a step, so that stepping allocates nothing.
    pub(super) motions: Vec<Motion>,
    pub(super) previous: Vec<Contact>,
    pub(super) step: u64,
}

impl World {
    /// An empty world; gravity in units per second squared.
    pub fn new(gravity: [f32; 2]) -> Self {
        Self {
            gravity: gravity.into(),
            balls: Vec::new(),
            tools: Vec::new(),
            sensors: Vec::new(),
            contacts: Vec::new(),
            touches: Vec::new(),
            motions: Vec::new(),
            previous: Vec::new(),
            step: 0,
        }
    }

    /// Adds a ball and returns its index.
    pub fn add_ball(&mut self, ball: Ball, state: BallState) -> usize {
        self.balls.push(Body::new(ball, state));
        self.balls.len() - 1
    }

    /// Adds a static tool and returns its index. Wakes nothing, as in CREATE.
    pub fn add_tool(&mut self, tool: Tool) -> usize {
        let collider = tool.collider();
        let bounds = collider.compute_aabb();
        self.tools.push(Arc::new(StaticTool { tool, collider, bounds }));
        self.tools.len() - 1
    }

    /// Adds a sensor and returns its index.
    pub fn add_sensor(&mut self, sensor: &Sensor) -> usize {
        self.sensors.push(Some(Arc::new(sensor.region())));
        self.sensors.len() - 1
    }

    /// Removes a sensor; the indices of the others stay.
    pub fn remove_sensor(&mut self, index: usize) {
        self.sensors[index] = None;
    }

    /// The tools, in the order in which they were added.
    pub fn tools(&self) -> impl ExactSizeIterator<Item = &Tool> {
        self.tools.iter().map(|tool| &tool.tool)
    }

    /// Number of balls.
    pub fn ball_count(&self) -> usize {
        self.balls.len()
    }

    /// Motion of a ball.
    pub fn ball(&self, index: usize) -> BallState {
        self.balls[index].state()
    }

    /// Puts a ball into another state of motion, awake and with its old contacts forgotten.
    pub fn set_ball(&mut self, index: usize, state: BallState) {
        self.contacts.retain(|contact| contact.ball != index && contact.object != ObjectId::Ball(index));
        let body = &mut self.balls[index];
        body.rigid.set_translation(state.position.into(), false);
        body.rigid.set_linvel(state.velocity.into(), false);
        body.rigid.set_angvel(state.angular_velocity, false);
        body.angle = state.angle;
        body.bias_velocity = Vector::ZERO;
        body.bias_angular_velocity = 0.0;
        body.idle = 0;
        body.asleep = false;
        body.captured = false;
    }

    /// What a ball is made of.
    pub fn ball_material(&self, index: usize) -> Ball {
        self.balls[index].ball
    }

    /// Whether a bucket has captured the ball.
    pub fn is_captured(&self, index: usize) -> bool {
        self.balls[index].captured
    }

    /// Whether the ball rests and is no longer simulated until something touches it.
    pub fn is_asleep(&self, index: usize) -> bool {
        self.balls[index].asleep
    }

    /// Everything the latest step found touching, in a fixed order.
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Whether a ball overlaps a sensor now.
    pub fn touches_sensor(&self, ball: usize, sensor: usize) -> bool {
        let body = &self.balls[ball];
        self.sensors[sensor].as_deref().is_some_and(|region| {
            reaches(body, &region.bounds) && overlap(body.rigid.position(), &body.shape, &region.pose, &region.shape)
        })
    }

    /// Number of sensors, removed ones included.
    pub(super) fn sensor_count(&self) -> usize {
        self.sensors.len()
    }

    /// The first object whose shape overlaps `tool`'s: balls, sensors, then tools.
    pub fn obstruction(&self, tool: &Tool) -> Option<ObjectId> {
        let (pose, shape) = (tool.pose(), tool.shape());
        let bounds = shape.compute_aabb(&pose);
        let ball = |body: &Body| reaches(body, &bounds) && overlap(body.rigid.position(), &body.shape, &pose, &shape);
        let sensor = |sensor: &Option<Arc<Region>>| {
            sensor.as_deref().is_some_and(|region| {
                region.bounds.intersects(&bounds) && overlap(&region.pose, &region.shape, &pose, &shape)
            })
        };
        let near = |other: &Arc<StaticTool>| {
            other.bounds.intersects(&bounds)
                && overlap(other.collider.position(), other.collider.shared_shape(), &pose, &shape)
        };
        let ball = self.balls.iter().position(ball).map(ObjectId::Ball);
        let sensor = || self.sensors.iter().position(sensor).map(ObjectId::Sensor);
        let tool = || self.tools.iter().position(near).map(ObjectId::Tool);
        ball.or_else(sensor).or_else(tool)
    }
}

impl Sensor {
    fn region(&self) -> Region {
        let (pose, shape) = match self {
            Self::Circle { position, radius } => {
                (Pose::from_translation((*position).into()), SharedShape::ball(*radius))
            }
            Self::Polygon { vertices } => {
                let corners: Vec<Vector> = vertices.iter().map(|&vertex| vertex.into()).collect();
                // Fewer than three corners enclose nothing and touch nothing.
                (Pose::IDENTITY, SharedShape::convex_hull(&corners).unwrap_or_else(|| SharedShape::ball(0.0)))
            }
        };
        let bounds = shape.compute_aabb(&pose);
        Region { pose, shape, bounds }
    }
}

/// Whether the box around a ball meets `bounds`.
pub(super) fn reaches(body: &Body, bounds: &Aabb) -> bool {
    let centre = body.rigid.translation();
    let reach = Vector::splat(body.ball.radius);
    (centre + reach).cmpge(bounds.mins).all() && (centre - reach).cmple(bounds.maxs).all()
}

fn overlap(pose: &Pose, shape: &SharedShape, other_pose: &Pose, other: &SharedShape) -> bool {
    // All our shapes are convex, which the query supports.
    query::intersection_test(pose, &**shape, other_pose, &**other).is_ok_and(|intersection| intersection.intersecting)
}
