//! CREATE's tools: one table of types, and tools with their sizes and materials.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, PI, TAU};

use rapier2d::parry::query;
use rapier2d::prelude::*;
use serde::{Deserialize, Serialize};

use super::outline::{Frame, Outline, direction};
use super::rules::{self, Rule};
use crate::validation::{ValidationError, in_range};

/// Types of tools. The paper has the first five (section 5.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToolKind {
    /// A solid square that captures a ball touching it from above.
    Bucket,
    /// A regular polygon of four corners: at angle 0 it stands on one of them.
    Square,
    /// An axis-aligned square.
    Box,
    /// A vertical segment.
    Wall,
    /// A horizontal segment.
    Floor,
    /// A segment at any angle.
    Ramp,
    /// A segment that may give back more than it takes.
    Trampoline,
    /// A disc without friction.
    Circle,
    /// A regular polygon of three corners.
    Triangle,
    /// A regular polygon of five corners.
    Pentagon,
    /// A regular polygon of six corners.
    Hexagon,
    /// A plank that turns freely around its centre.
    Hinge,
    /// A plank that turns up to an angle.
    HingeConstrained,
    /// A plank that turns up to an angle, with a weight on one side.
    SeeSaw,
    /// Throws a body that touches it.
    Cannon,
    /// Blows on bodies in front of it.
    Fan,
    /// Carries bodies along.
    Belt,
    /// Lets bodies fall through its nozzle.
    Funnel,
    /// Carries bodies up.
    Ladder,
}

/// What makes a type of tool: a row of [`TYPES`].
pub(super) struct ToolType {
    /// Its place in the table; a test compares.
    #[cfg_attr(not(test), allow(dead_code))]
    pub kind: ToolKind,
    name: &'static str,
    /// What its size is called in files.
    measure: &'static str,
    /// The size CREATE's tools of this type have unless they say otherwise, in units.
    size: f64,
    outline: fn(&Tool) -> (Outline, Frame),
    elasticity: f64,
    friction: f64,
    /// Notices bodies and exerts no contact forces.
    is_sensor: bool,
    /// When a body begins to touch it; if this returns false, nothing more happens until
    /// they have been apart.
    begin: Option<Rule>,
    /// In every step of contact, before the solver; false drops the contact.
    pre_solve: Option<Rule>,
    /// In every step of contact, after the solver.
    post_solve: Option<Rule>,
}

/// A type without rules.
const PLAIN: ToolType = ToolType {
    kind: ToolKind::Ramp,
    name: "",
    measure: "size",
    size: 8.0,
    outline: segment,
    elasticity: 0.5,
    friction: 1.0,
    is_sensor: false,
    begin: None,
    pre_solve: None,
    post_solve: None,
};

/// A segment.
const SEGMENT: ToolType = ToolType { measure: "length", size: 16.0, ..PLAIN };

/// A segment that bodies pass through.
const TRACK: ToolType = ToolType { is_sensor: true, size: 20.0, ..SEGMENT };

/// A plank on a pin.
const PLANK: ToolType = ToolType {
    measure: "length",
    size: 24.0,
    outline: plank,
    elasticity: 0.0,
    friction: 0.0,
    post_solve: Some(rules::brake),
    ..PLAIN
};

/// A box that bodies pass through.
const ENGINE: ToolType = ToolType { elasticity: 0.4, is_sensor: true, size: 10.0, ..PLAIN };

/// Every type, in the order of [`ToolKind`].
pub(super) static TYPES: [ToolType; 19] = {
    use ToolKind::*;
    [
        ToolType { kind: Bucket, name: "bucket", size: 6.0, outline: bucket, pre_solve: Some(rules::capture), ..PLAIN },
        ToolType { kind: Square, name: "square", outline: |tool| polygon(tool, 4, 0.0), ..PLAIN },
        ToolType { kind: Box, name: "box", outline: square, elasticity: 0.4, ..PLAIN },
        ToolType { kind: Wall, name: "wall", outline: upright, ..SEGMENT },
        ToolType { kind: Floor, name: "floor", ..SEGMENT },
        ToolType { kind: Ramp, name: "ramp", ..SEGMENT },
        ToolType { kind: Trampoline, name: "trampoline", outline: trampoline, elasticity: 1.2, ..SEGMENT },
        ToolType {
            kind: Circle,
            name: "circle",
            measure: "radius",
            size: 5.0,
            outline: disc,
            elasticity: 0.4,
            friction: 0.0,
            ..PLAIN
        },
        ToolType { kind: Triangle, name: "triangle", outline: |tool| polygon(tool, 3, 0.0), ..PLAIN },
        ToolType { kind: Pentagon, name: "pentagon", outline: |tool| polygon(tool, 5, 0.0), ..PLAIN },
        ToolType { kind: Hexagon, name: "hexagon", outline: |tool| polygon(tool, 6, 0.0), ..PLAIN },
        ToolType { kind: Hinge, name: "hinge", ..PLANK },
        ToolType { kind: HingeConstrained, name: "hinge_constrained", ..PLANK },
        ToolType { kind: SeeSaw, name: "see_saw", ..PLANK },
        ToolType { kind: Cannon, name: "cannon", outline: cannon, begin: Some(rules::fire), ..ENGINE },
        ToolType { kind: Fan, name: "fan", outline: fan, pre_solve: Some(rules::blow), ..ENGINE },
        ToolType { kind: Belt, name: "belt", pre_solve: Some(rules::carry), ..TRACK },
        ToolType { kind: Funnel, name: "funnel", outline: funnel, pre_solve: Some(rules::swallow), ..PLAIN },
        ToolType { kind: Ladder, name: "ladder", pre_solve: Some(rules::climb), ..TRACK },
    ]
};

impl ToolKind {
    /// Every tool type; the paper's come first.
    pub const ALL: [ToolKind; 19] = {
        use ToolKind::*;
        [
            Bucket,
            Square,
            Box,
            Wall,
            Floor,
            Ramp,
            Trampoline,
            Circle,
            Triangle,
            Pentagon,
            Hexagon,
            Hinge,
            HingeConstrained,
            SeeSaw,
            Cannon,
            Fan,
            Belt,
            Funnel,
            Ladder,
        ]
    };

    /// The paper's tool types, in the order of the one-hot encoding of observations.
    pub const PAPER: [ToolKind; 5] = [Self::Bucket, Self::Square, Self::Box, Self::Wall, Self::Floor];

    /// Position in [`ToolKind::ALL`], and in [`ToolKind::PAPER`] for those.
    pub fn index(self) -> usize {
        self as usize
    }

    fn row(self) -> &'static ToolType {
        &TYPES[self as usize]
    }

    /// The name used in files, on the command line and on screen.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// What the size is called in recordings: `size`, `length` or `radius`.
    pub fn measure(self) -> &'static str {
        self.row().measure
    }

    /// Whether tools of the type come in sizes; cannons and fans do not.
    pub fn has_size(self) -> bool {
        !matches!(self, Self::Cannon | Self::Fan)
    }

    /// Whether the tool is a segment, described by a length and a thickness.
    pub fn is_segment(self) -> bool {
        self.measure() == "length"
    }

    /// Whether the tool has a plank that moves.
    pub fn is_hinged(self) -> bool {
        matches!(self, Self::Hinge | Self::HingeConstrained | Self::SeeSaw)
    }

    /// Whether bodies pass through the tool.
    pub fn is_sensor(self) -> bool {
        self.row().is_sensor
    }

    /// CREATE's elasticity of the type.
    pub fn elasticity(self) -> f64 {
        self.row().elasticity
    }

    /// The size (or length) CREATE's tools of this type have in our launches and
    /// tasks unless they say otherwise, in units.
    pub fn default_size(self) -> f64 {
        self.row().size
    }

    pub(super) fn begin(self) -> Option<Rule> {
        self.row().begin
    }

    pub(super) fn pre_solve(self) -> Option<Rule> {
        self.row().pre_solve
    }

    pub(super) fn post_solve(self) -> Option<Rule> {
        self.row().post_solve
    }
}

impl std::fmt::Display for ToolKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for ToolKind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || Self::ALL.map(Self::name).join(", ");
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == text)
            .ok_or_else(|| format!("unknown tool `{text}`: use one of {}", known()))
    }
}

/// A tool at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tool {
    /// Type, which decides the shape.
    pub kind: ToolKind,
    /// Centre in units.
    pub position: [f64; 2],
    /// Polygons: centre to corner. Box: side. Circle: radius. Segments: length. Units.
    pub size: f64,
    /// Rotation in radians, counter-clockwise.
    pub angle: f64,
    /// Rounding of a segment's ends and sides (half its thickness); 0 for others.
    pub radius: f64,
    /// Elasticity; a pair's elasticity is the product of both.
    pub elasticity: f64,
    /// Friction coefficient; a pair's friction is the product of both.
    pub friction: f64,
    /// Cannon: momentum it gives. Fan: force it exerts.
    pub force: f64,
    /// Belt and ladder: speed in units/s.
    pub velocity: f64,
    /// Constrained hinge and see-saw: how far the plank turns, in radians.
    pub max_angle: f64,
    /// See-saw: the left end is up, and the weight on the right.
    pub on_left: bool,
    /// See-saw: mass of the weight.
    pub weight: f64,
    /// Planks: from 1 to 2, brakes balls that touch it by this less 1 in every step.
    pub roll_friction: f64,
}

impl Tool {
    /// A tool of CREATE's default size and material, at `position` in units.
    pub fn new(kind: ToolKind, position: [f64; 2]) -> Self {
        let row = kind.row();
        Self {
            kind,
            position,
            size: row.size,
            angle: match kind {
                ToolKind::Cannon | ToolKind::Fan => PI / 3.0,
                ToolKind::Ladder => 95.0 * PI / 180.0,
                _ => 0.0,
            },
            radius: if kind.is_segment() && !kind.is_hinged() { 1.0 } else { 0.0 },
            elasticity: row.elasticity,
            friction: row.friction,
            force: 120.0,
            velocity: if kind == ToolKind::Ladder { 4.0 } else { 5.0 },
            max_angle: FRAC_PI_6,
            on_left: false,
            weight: 0.1,
            roll_friction: 1.0,
        }
    }

    /// The same tool with another size.
    pub fn with_size(mut self, size: f64) -> Self {
        self.size = size;
        self
    }

    /// The same tool at another place, in units.
    pub fn at(mut self, position: [f64; 2]) -> Self {
        self.position = position;
        self
    }

    /// Whether the numbers make a tool that can stand in a world.
    ///
    /// # Errors
    /// The first field, by name, whose number is not finite or out of range.
    pub fn check(&self) -> Result<(), ValidationError> {
        for (axis, value) in self.position.iter().enumerate() {
            in_range(*value, format_args!("position[{axis}]"), -1000.0, 1000.0)?;
        }
        in_range(self.size, "size", 0.1, 200.0)?;
        in_range(self.angle, "angle", -1000.0, 1000.0)?;
        in_range(self.radius, "radius", 0.0, if self.kind.is_segment() { 20.0 } else { 0.0 })?;
        in_range(self.elasticity, "elasticity", 0.0, 1.5)?;
        in_range(self.friction, "friction", 0.0, 100.0)?;
        in_range(self.force, "force", -10_000.0, 10_000.0)?;
        in_range(self.velocity, "vel", -1000.0, 1000.0)?;
        in_range(self.max_angle, "max_angle", 0.0, FRAC_PI_2)?;
        in_range(self.weight, "ball_mass", 0.01, 10_000.0)?;
        in_range(self.roll_friction, "roll_friction", 0.0, 2.0)
    }

    /// World coordinates of the corners, counter-clockwise; the two end points of segments,
    /// points all around a circle. In single precision, for networks and screens.
    pub fn vertices(&self) -> Vec<[f32; 2]> {
        self.corner_points().into_iter().map(|corner| corner.map(|p| p as f32)).collect()
    }

    /// The same in the precision of the physics.
    pub fn corner_points(&self) -> Vec<[f64; 2]> {
        let corners: Vec<Vector> = match self.outline() {
            Outline::Disc { centre, radius } => {
                (0..48).map(|k| centre + direction(TAU * f64::from(k) / 48.0) * radius).collect()
            }
            Outline::Segment { a, b, .. } => vec![a, b],
            Outline::Polygon(polygon) => polygon.corners().iter().map(|corner| corner.position).collect(),
        };
        corners.into_iter().map(Into::into).collect()
    }

    /// Centre in units, in single precision.
    pub fn centre(&self) -> [f32; 2] {
        self.position.map(|p| p as f32)
    }

    /// Half width and half height of the axis-aligned box around the tool, in units.
    pub fn half_extents(&self) -> [f32; 2] {
        let (bounds, centre) = (self.outline().bounds(), Vector::from(self.position));
        single((bounds.high - centre).max(centre - bounds.low))
    }

    /// Whether a point (in units) is farther than `distance` from the box around the tool, and so from its surface:
    /// much quicker to find than the [distance](Self::surface) itself.
    pub fn is_beyond(&self, point: [f32; 2], distance: f32) -> bool {
        // More than what single precision loses.
        const MARGIN: f32 = 0.01;
        let (centre, halves) = (self.centre(), self.half_extents());
        (0..2).any(|axis| (point[axis] - centre[axis]).abs() > halves[axis] + distance + MARGIN)
    }

    /// Distance from a point (in units) to the tool's surface, negative inside, and
    /// the unit vector from the nearest surface point towards the point.
    pub fn surface(&self, point: [f32; 2]) -> (f32, [f32; 2]) {
        let (shape, place) = self.shape();
        let (ball, pose) = (SharedShape::ball(0.0), Pose::from_translation(Vector::from(point.map(f64::from))));
        let contact = query::contact(&Pose::from_translation(place), &*shape, &pose, &*ball, f64::MAX)
            // Both shapes are supported and the prediction distance is unbounded.
            .ok()
            .flatten()
            .expect("a point always has a nearest surface point");
        (contact.dist as f32, single(contact.normal1))
    }

    /// The shape for rapier, and where it stands in the world.
    pub(crate) fn shape(&self) -> (SharedShape, Vector) {
        match self.outline() {
            Outline::Disc { centre, radius } => (SharedShape::ball(radius), centre),
            Outline::Segment { a, b, radius, .. } if radius > 0.0 => (SharedShape::capsule(a, b, radius), Vector::ZERO),
            Outline::Segment { a, b, .. } => (SharedShape::segment(a, b), Vector::ZERO),
            Outline::Polygon(polygon) => {
                let corners = polygon.corners().iter().map(|corner| corner.position).collect();
                // Checked sizes make corners that differ; a point is the worst that can come.
                (SharedShape::convex_polyline(corners).unwrap_or_else(|| SharedShape::ball(0.0)), Vector::ZERO)
            }
        }
    }

    /// The outline in the world.
    pub(super) fn outline(&self) -> Outline {
        let (outline, frame) = self.local_outline();
        outline.placed(&frame)
    }

    /// The outline in the frame of the body that carries it, and that body's frame.
    pub(super) fn local_outline(&self) -> (Outline, Frame) {
        (self.kind.row().outline)(self)
    }

    /// How far a plank is drawn tilted while its body's angle is 0.
    pub fn tilt(&self) -> f64 {
        match self.kind {
            ToolKind::SeeSaw if self.on_left => -self.max_angle,
            ToolKind::SeeSaw => self.max_angle,
            _ => 0.0,
        }
    }

    /// Corners of a regular polygon around the tool's place, as the engine numbers them.
    pub(super) fn corners(&self) -> Vec<Vector> {
        let (count, turn) = match self.kind {
            ToolKind::Bucket => (4, FRAC_PI_4),
            ToolKind::Funnel => (3, FRAC_PI_6),
            _ => (0, 0.0),
        };
        let place = Vector::from(self.position);
        regular(count, turn + self.angle, self.size).into_iter().map(|corner| place + corner).collect()
    }
}

/// In single precision, for networks and screens.
fn single(vector: Vector) -> [f32; 2] {
    [vector.x as f32, vector.y as f32]
}

/// Corners of a regular polygon around the origin, the first one step after `angle`.
pub(super) fn regular(count: usize, angle: f64, size: f64) -> Vec<Vector> {
    let mut angle = angle;
    let corner = |_| {
        angle += TAU / count as f64;
        direction(angle) * size
    };
    (0..count).map(corner).collect()
}

/// A body that is not turned.
fn upright_at(position: [f64; 2]) -> Frame {
    Frame { position: position.into(), rotation: Vector::X }
}

fn polygon(tool: &Tool, corners: usize, turn: f64) -> (Outline, Frame) {
    (Outline::hull(&regular(corners, turn + tool.angle, tool.size)), upright_at(tool.position))
}

fn bucket(tool: &Tool) -> (Outline, Frame) {
    polygon(tool, 4, FRAC_PI_4)
}

fn funnel(tool: &Tool) -> (Outline, Frame) {
    polygon(tool, 3, FRAC_PI_6)
}

fn square(tool: &Tool) -> (Outline, Frame) {
    (Outline::rectangle(tool.size, tool.size), Frame::new(tool.position.into(), tool.angle))
}

fn disc(tool: &Tool) -> (Outline, Frame) {
    (Outline::disc(tool.size), upright_at(tool.position))
}

/// Segments are made in the world: their body stands at the origin.
fn segment_along(tool: &Tool, along: Vector) -> (Outline, Frame) {
    let (place, half) = (Vector::from(tool.position), along / 2.0);
    (Outline::segment(place - half, place + half, tool.radius), upright_at([0.0; 2]))
}

fn segment(tool: &Tool) -> (Outline, Frame) {
    segment_along(tool, direction(tool.angle) * tool.size)
}

fn upright(tool: &Tool) -> (Outline, Frame) {
    segment_along(tool, direction(tool.angle).perp() * tool.size)
}

/// Beyond 90 degrees it is turned round, so that its upper side stays up.
fn trampoline(tool: &Tool) -> (Outline, Frame) {
    let angle = if tool.angle > FRAC_PI_2 { tool.angle + PI } else { tool.angle };
    segment_along(tool, direction(angle) * tool.size)
}

fn plank(tool: &Tool) -> (Outline, Frame) {
    let half = direction(tool.tilt()) * tool.size / 2.0;
    (Outline::segment(-half, half, tool.radius), upright_at(tool.position))
}

/// CREATE hands the cannon's width over as its angle: it lies turned by 10 radians,
/// wherever it points.
fn cannon(tool: &Tool) -> (Outline, Frame) {
    (Outline::rectangle(7.3, 10.0), Frame::new(tool.position.into(), 10.0))
}

fn fan(tool: &Tool) -> (Outline, Frame) {
    (Outline::rectangle(6.7, 10.0), Frame::new(tool.position.into(), tool.angle))
}

/// Corners of CREATE's star, of which the engine keeps the hull.
pub(super) const STAR_TURN: f64 = PI / 10.0;
