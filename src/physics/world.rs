//! The world: balls, static tools and sensors, advanced in CREATE's step order.

use std::sync::Arc;

use rapier2d::parry::query;
use rapier2d::prelude::*;

use super::contact::{Contact, Geometry, Motion, SWEEPS};
use super::tool::{Tool, ToolKind};
use super::units::PHYSICS_DT;

/// Idle time after which a resting ball falls asleep, in seconds.
const SLEEP_AFTER: f32 = 0.3;

/// What a ball is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Radius in units.
    pub radius: f32,
    /// Mass; the moment of inertia is that of a disc.
    pub mass: f32,
    /// Elasticity, multiplied with that of what it touches.
    pub elasticity: f32,
    /// Friction coefficient, multiplied with that of what it touches.
    pub friction: f32,
}

impl Default for Ball {
    fn default() -> Self {
        Self { radius: 4.0, mass: 10.0, elasticity: 1.0, friction: 1.0 }
    }
}

/// How a ball moves: units, units/s, radians (not wrapped), radians/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BallState {
    /// Centre.
    pub position: [f32; 2],
    /// Velocity of the centre.
    pub velocity: [f32; 2],
    /// Angle, not wrapped.
    pub angle: f32,
    /// Angular velocity.
    pub angular_velocity: f32,
}

impl BallState {
    /// A ball at rest.
    pub fn at_rest(position: [f32; 2]) -> Self {
        Self { position, ..Self::default() }
    }

    /// Speed of the centre in units/s.
    pub fn speed(&self) -> f32 {
        self.velocity[0].hypot(self.velocity[1])
    }
}

/// A static region that notices balls and exerts no force.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensor {
    /// A disc: centre and radius in units.
    Circle { position: [f32; 2], radius: f32 },
    /// A convex polygon: counter-clockwise world vertices in units.
    Polygon { vertices: Vec<[f32; 2]> },
}

/// An object of the world, by the order in which its kind was added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ObjectId {
    /// A ball.
    Ball(usize),
    /// A static tool.
    Tool(usize),
    /// A sensor.
    Sensor(usize),
}

/// A ball overlapped an object when a step looked for collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touch {
    /// Index of the ball.
    pub ball: usize,
    /// What it touched.
    pub object: ObjectId,
}

/// A static tool and its rapier collider.
#[derive(Debug)]
struct StaticTool {
    tool: Tool,
    collider: Collider,
    bounds: rapier2d::parry::bounding_volume::Aabb,
}

#[derive(Debug, Clone)]
struct Body {
    ball: Ball,
    /// rapier's body: pose, velocities and mass properties.
    rigid: RigidBody,
    shape: SharedShape,
    angle: f32,
    bias_velocity: Vector,
    bias_spin: f32,
    idle: f32,
    asleep: bool,
    captured: bool,
}

/// Balls, tools and sensors under gravity. Cloning takes a snapshot; assigning the
/// clone back restores it exactly.
#[derive(Debug, Clone)]
pub struct World {
    gravity: Vector,
    balls: Vec<Body>,
    tools: Vec<Arc<StaticTool>>,
    sensors: Vec<Option<Arc<(Pose, SharedShape)>>>,
    contacts: Vec<Contact>,
    touches: Vec<Touch>,
    motions: Vec<Motion>,
    step: u64,
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
            step: 0,
        }
    }

    /// Adds a ball and returns its index.
    pub fn add_ball(&mut self, ball: Ball, state: BallState) -> usize {
        let inertia = ball.mass * ball.radius * ball.radius / 2.0;
        let mut rigid = RigidBodyBuilder::dynamic()
            .pose(Pose::new(state.position.into(), state.angle))
            .linvel(state.velocity.into())
            .angvel(state.angular_velocity)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, ball.mass, inertia))
            .build();
        rigid.recompute_mass_properties_from_colliders(&ColliderSet::new());
        self.balls.push(Body {
            ball,
            rigid,
            shape: SharedShape::ball(ball.radius),
            angle: state.angle,
            bias_velocity: Vector::ZERO,
            bias_spin: 0.0,
            idle: 0.0,
            asleep: false,
            captured: false,
        });
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
        self.sensors.push(Some(Arc::new(sensor.placed_shape())));
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
        let body = &self.balls[index];
        BallState {
            position: body.rigid.translation().into(),
            velocity: body.rigid.linvel().into(),
            angle: body.angle,
            angular_velocity: body.rigid.angvel(),
        }
    }

    /// Puts a ball into another state of motion, awake and with its old contacts forgotten.
    pub fn set_ball(&mut self, index: usize, state: BallState) {
        self.contacts.retain(|contact| contact.ball != index && contact.other != Some(index));
        let body = &mut self.balls[index];
        body.rigid.set_translation(state.position.into(), false);
        body.rigid.set_linvel(state.velocity.into(), false);
        body.rigid.set_angvel(state.angular_velocity, false);
        body.angle = state.angle;
        body.bias_velocity = Vector::ZERO;
        body.bias_spin = 0.0;
        body.idle = 0.0;
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
        self.sensors[sensor]
            .as_deref()
            .is_some_and(|(pose, shape)| overlap(body.rigid.position(), &body.shape, pose, shape))
    }

    /// The first object whose shape overlaps `tool`'s: balls, sensors, then tools.
    pub fn obstruction(&self, tool: &Tool) -> Option<ObjectId> {
        let (pose, shape) = (tool.pose(), tool.shape());
        let ball = self.balls.iter().position(|body| overlap(body.rigid.position(), &body.shape, &pose, &shape));
        let sensor = || {
            let hit = |sensor: &Option<Arc<(Pose, SharedShape)>>| {
                sensor.as_deref().is_some_and(|(other, region)| overlap(other, region, &pose, &shape))
            };
            self.sensors.iter().position(hit).map(ObjectId::Sensor)
        };
        let bounds = shape.compute_aabb(&pose);
        let near = |other: &Arc<StaticTool>| {
            use rapier2d::parry::bounding_volume::BoundingVolume;
            other.bounds.intersects(&bounds)
                && overlap(other.collider.position(), other.collider.shared_shape(), &pose, &shape)
        };
        ball.map(ObjectId::Ball).or_else(sensor).or_else(|| self.tools.iter().position(near).map(ObjectId::Tool))
    }

    /// Advances by one physics step of 1/30 s in CREATE's order: positions, collision
    /// detection, sleeping, gravity, impulses.
    pub fn step(&mut self) {
        self.step += 1;
        self.touches.clear();
        for body in self.balls.iter_mut().filter(|body| !body.asleep) {
            body.advance();
        }
        self.detect();
        self.put_to_sleep();
        self.respond();
    }

    fn detect(&mut self) {
        for ball in 0..self.balls.len() {
            for other in ball + 1..self.balls.len() {
                self.detect_balls(ball, other);
            }
            for tool in 0..self.tools.len() {
                self.detect_tool(ball, tool);
            }
            for sensor in 0..self.sensors.len() {
                if self.touches_sensor(ball, sensor) {
                    self.touches.push(Touch { ball, object: ObjectId::Sensor(sensor) });
                }
            }
        }
        let step = self.step;
        self.contacts.retain(|contact| !contact.is_forgotten(step));
    }

    fn detect_balls(&mut self, first: usize, second: usize) {
        let (a, b) = (&self.balls[first], &self.balls[second]);
        let between = b.rigid.translation() - a.rigid.translation();
        let distance = between.length() - a.ball.radius - b.ball.radius;
        if distance >= 0.0 || (a.asleep && b.asleep) {
            return;
        }
        let normal = between.normalize_or(Vector::X);
        let geometry = Geometry {
            normal,
            arm: normal * a.ball.radius,
            other_arm: -normal * b.ball.radius,
            distance,
            elasticity: a.ball.elasticity * b.ball.elasticity,
            friction: a.ball.friction * b.ball.friction,
        };
        self.touches.push(Touch { ball: first, object: ObjectId::Ball(second) });
        self.touches.push(Touch { ball: second, object: ObjectId::Ball(first) });
        for index in [first, second] {
            self.balls[index].wake();
        }
        self.remember(first, Some(second), 0, geometry);
    }

    fn detect_tool(&mut self, ball: usize, index: usize) {
        let body = &mut self.balls[ball];
        let StaticTool { tool, collider, bounds } = &*self.tools[index];
        let centre = body.rigid.translation();
        let reach = Vector::splat(body.ball.radius);
        if (centre + reach).cmplt(bounds.mins).any() || (centre - reach).cmpgt(bounds.maxs).any() {
            return;
        }
        let found = query::contact(collider.position(), collider.shape(), body.rigid.position(), &*body.shape, 0.0);
        // Balls against convex shapes are always supported.
        let Ok(Some(found)) = found else { return };
        self.touches.push(Touch { ball, object: ObjectId::Tool(index) });
        if tool.kind == ToolKind::Bucket && (body.captured || is_above(tool, centre)) {
            body.capture(tool);
            return;
        }
        let normal = -found.normal1;
        let geometry = Geometry {
            normal,
            arm: normal * body.ball.radius,
            other_arm: Vector::ZERO,
            distance: found.dist,
            elasticity: body.ball.elasticity * tool.elasticity,
            friction: body.ball.friction * tool.friction,
        };
        self.remember(ball, None, index, geometry);
    }

    fn remember(&mut self, ball: usize, other: Option<usize>, tool: usize, geometry: Geometry) {
        match self.contacts.iter_mut().find(|contact| contact.is_between(ball, other, tool)) {
            Some(contact) => contact.refresh(geometry, self.step),
            None => self.contacts.push(Contact::new(ball, other, tool, geometry, self.step)),
        }
    }

    /// Balls that hang together and have all been idle long enough fall asleep.
    fn put_to_sleep(&mut self) {
        let threshold = (self.gravity.length() * PHYSICS_DT).powi(2);
        for body in self.balls.iter_mut().filter(|body| !body.asleep) {
            let inertia = body.ball.radius * body.ball.radius / 2.0;
            let energy = body.rigid.linvel().length_squared() + inertia * body.rigid.angvel().powi(2);
            body.idle = if energy <= threshold { body.idle + PHYSICS_DT } else { 0.0 };
        }
        let mut group: Vec<usize> = (0..self.balls.len()).collect();
        let pairs = self.contacts.iter().filter(|contact| contact.is_active(self.step));
        for (a, b) in pairs.filter_map(|contact| Some((contact.ball, contact.other?))) {
            let (from, to) = (group[b], group[a]);
            group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
        }
        for leader in 0..group.len() {
            let members = || (0..group.len()).filter(|&ball| group[ball] == leader);
            if members().next().is_some() && members().all(|ball| self.balls[ball].idle >= SLEEP_AFTER) {
                members().for_each(|ball| self.balls[ball].asleep = true);
            }
        }
    }

    fn respond(&mut self) {
        let step = self.step;
        self.motions.clear();
        self.motions.extend(self.balls.iter().map(Body::motion));
        let mut motions = std::mem::take(&mut self.motions);
        for contact in &mut self.contacts {
            if self.balls[contact.ball].asleep {
                contact.keep(step);
            } else if contact.is_active(step) {
                contact.prepare(&motions);
            }
        }
        for (body, motion) in self.balls.iter().zip(&mut motions) {
            if !body.asleep {
                motion.velocity += self.gravity * PHYSICS_DT;
            }
        }
        let balls = &self.balls;
        let solvable = |contact: &&mut Contact| contact.is_active(step) && !balls[contact.ball].asleep;
        for contact in self.contacts.iter_mut().filter(solvable) {
            contact.warm_start(&mut motions);
        }
        for _ in 0..SWEEPS {
            for contact in self.contacts.iter_mut().filter(solvable) {
                contact.solve(&mut motions);
            }
        }
        for (body, motion) in self.balls.iter_mut().zip(&motions) {
            body.set_motion(motion);
        }
        self.motions = motions;
    }
}

impl Body {
    fn advance(&mut self) {
        let position = self.rigid.translation() + (self.rigid.linvel() + self.bias_velocity) * PHYSICS_DT;
        self.angle += (self.rigid.angvel() + self.bias_spin) * PHYSICS_DT;
        self.rigid.set_translation(position, false);
        self.bias_velocity = Vector::ZERO;
        self.bias_spin = 0.0;
    }

    fn wake(&mut self) {
        if self.asleep {
            self.asleep = false;
            self.idle = 0.0;
        }
    }

    /// Moves the ball to the bucket's centre, at rest, for good.
    fn capture(&mut self, bucket: &Tool) {
        self.rigid.set_translation(bucket.position.into(), false);
        self.rigid.set_linvel(Vector::ZERO, false);
        self.rigid.set_angvel(0.0, false);
        self.angle = 0.0;
        self.bias_velocity = Vector::ZERO;
        self.bias_spin = 0.0;
        self.idle = 0.0;
        self.captured = true;
    }

    fn motion(&self) -> Motion {
        Motion {
            velocity: self.rigid.linvel(),
            spin: self.rigid.angvel(),
            bias_velocity: self.bias_velocity,
            bias_spin: self.bias_spin,
            inverse_mass: 1.0 / self.ball.mass,
            inverse_inertia: 2.0 / (self.ball.mass * self.ball.radius * self.ball.radius),
        }
    }

    fn set_motion(&mut self, motion: &Motion) {
        self.rigid.set_linvel(motion.velocity, false);
        self.rigid.set_angvel(motion.spin, false);
        self.bias_velocity = motion.bias_velocity;
        self.bias_spin = motion.bias_spin;
    }
}

impl Sensor {
    fn placed_shape(&self) -> (Pose, SharedShape) {
        match self {
            Self::Circle { position, radius } => {
                (Pose::from_translation((*position).into()), SharedShape::ball(*radius))
            }
            Self::Polygon { vertices } => {
                let corners: Vec<Vector> = vertices.iter().map(|&vertex| vertex.into()).collect();
                let shape = SharedShape::convex_hull(&corners).unwrap_or_else(|| SharedShape::ball(0.0));
                (Pose::IDENTITY, shape)
            }
        }
    }
}

/// Whether a centre is nearer to both upper corners of a bucket than to both lower
/// ones: above both diagonals in the bucket's own frame.
fn is_above(bucket: &Tool, centre: Vector) -> bool {
    let local = bucket.pose().inverse_transform_point(centre);
    local.y > local.x.abs()
}

fn overlap(pose: &Pose, shape: &SharedShape, other_pose: &Pose, other: &SharedShape) -> bool {
    // All our shapes are convex, which the query supports.
    query::intersection_test(pose, &**shape, other_pose, &**other).is_ok_and(|intersection| intersection.intersecting)
}
