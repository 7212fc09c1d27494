//! CREATE's tool types: one table of shapes, materials and rules.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, PI, TAU};

use rapier2d::prelude::{Pose, Vector};
use serde::{Deserialize, Serialize};

use super::direction::{rotation, tool_direction};
use super::outline::Outline;
use super::rules::{self, Rule};
use super::tool::Tool;
use mge_base::by_name;

/// Tool types. The paper has the first five (section 5.1).
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
    /// A segment whose elasticity may exceed 1.
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
    /// A plank that turns up to a maximum angle.
    HingeConstrained,
    /// A plank that turns up to a maximum angle, with a weight on one side.
    SeeSaw,
    /// Fires a body that touches it.
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

/// A tool type: a row of [`TYPES`].
pub(super) struct ToolType {
    /// The type; rows are in the order of [`ToolKind`].
    kind: ToolKind,
    name: &'static str,
    /// Name of its size in files.
    measure: &'static str,
    /// CREATE's default size, in units.
    pub size: f64,
    pub outline: fn(&Tool) -> (Outline, Pose),
    /// Regular polygons: number of corners, and angle at which the first stands if the tool's angle is 0.
    corners: (usize, f64),
    pub elasticity: f64,
    pub friction: f64,
    /// Whether it detects bodies and exerts no contact forces.
    is_sensor: bool,
    /// Runs when a body begins to touch it; if it returns false, the contact is ignored until they separate.
    pub begin: Option<Rule>,
    /// Runs in every step of contact, before the solver; false drops the contact.
    pub pre_solve: Option<Rule>,
    /// Runs in every step of contact, after the solver.
    pub post_solve: Option<Rule>,
}

/// A type without rules.
const PLAIN: ToolType = ToolType {
    kind: ToolKind::Ramp,
    name: "",
    measure: "size",
    size: 8.0,
    outline: segment,
    corners: (0, 0.0),
    elasticity: 0.5,
    friction: 1.0,
    is_sensor: false,
    begin: None,
    pre_solve: None,
    post_solve: None,
};

/// A regular polygon.
const fn polygon(corners: usize, turn: f64) -> ToolType {
    ToolType {
        outline: |tool| (Outline::hull(&local_corners(tool)), Pose::from_translation(tool.position.into())),
        corners: (corners, turn),
        ..PLAIN
    }
}

/// A segment.
const SEGMENT: ToolType = ToolType { measure: "length", size: 16.0, ..PLAIN };

/// A segment that bodies pass through.
const SENSOR_SEGMENT: ToolType = ToolType { is_sensor: true, size: 20.0, ..SEGMENT };

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
const SENSOR_BOX: ToolType = ToolType { elasticity: 0.4, is_sensor: true, size: 10.0, ..PLAIN };

/// Every type, in the order of [`ToolKind`].
static TYPES: [ToolType; 19] = {
    use ToolKind::*;
    [
        ToolType { kind: Bucket, name: "bucket", size: 6.0, pre_solve: Some(rules::capture), ..polygon(4, FRAC_PI_4) },
        ToolType { kind: Square, name: "square", ..polygon(4, 0.0) },
        ToolType { kind: Box, name: "box", outline: square, elasticity: 0.4, ..PLAIN },
        ToolType {
            kind: Wall,
            name: "wall",
            outline: |tool| segment_along(tool, tool_direction(tool.angle).perp() * tool.size),
            ..SEGMENT
        },
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
        ToolType { kind: Triangle, name: "triangle", ..polygon(3, 0.0) },
        ToolType { kind: Pentagon, name: "pentagon", ..polygon(5, 0.0) },
        ToolType { kind: Hexagon, name: "hexagon", ..polygon(6, 0.0) },
        ToolType { kind: Hinge, name: "hinge", ..PLANK },
        ToolType { kind: HingeConstrained, name: "hinge_constrained", ..PLANK },
        ToolType { kind: SeeSaw, name: "see_saw", ..PLANK },
        ToolType { kind: Cannon, name: "cannon", outline: cannon, begin: Some(rules::fire), ..SENSOR_BOX },
        ToolType { kind: Fan, name: "fan", outline: fan, pre_solve: Some(rules::blow), ..SENSOR_BOX },
        ToolType { kind: Belt, name: "belt", pre_solve: Some(rules::carry), ..SENSOR_SEGMENT },
        ToolType { kind: Funnel, name: "funnel", pre_solve: Some(rules::swallow), ..polygon(3, FRAC_PI_6) },
        ToolType { kind: Ladder, name: "ladder", pre_solve: Some(rules::climb), ..SENSOR_SEGMENT },
    ]
};

impl ToolKind {
    /// Every tool type; the paper's come first.
    pub const ALL: [ToolKind; TYPES.len()] = {
        let mut all = [Self::Bucket; TYPES.len()];
        let mut index = 0;
        while index < all.len() {
            all[index] = TYPES[index].kind;
            index += 1;
        }
        all
    };

    /// The paper's tool types, in the order of the one-hot encoding of observations.
    pub const PAPER: [ToolKind; 5] = [Self::Bucket, Self::Square, Self::Box, Self::Wall, Self::Floor];

    /// Index in [`ToolKind::ALL`], and in [`ToolKind::PAPER`] for the paper's types.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Its row of the table.
    pub(super) fn row(self) -> &'static ToolType {
        &TYPES[self as usize]
    }

    /// The name used in files, on the command line and on screen.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Name of the size in recordings: `size`, `length` or `radius`.
    pub fn measure(self) -> &'static str {
        self.row().measure
    }

    /// Whether tools of the type have different sizes; cannons and fans do not.
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

    /// Whether the tool has a force.
    pub fn has_force(self) -> bool {
        matches!(self, Self::Cannon | Self::Fan)
    }

    /// Whether the tool moves the bodies that touch it at a velocity.
    pub fn has_velocity(self) -> bool {
        matches!(self, Self::Belt | Self::Ladder)
    }

    /// Whether the tool's plank turns up to an angle.
    pub fn has_max_angle(self) -> bool {
        matches!(self, Self::HingeConstrained | Self::SeeSaw)
    }

    /// Whether bodies pass through the tool.
    pub fn is_sensor(self) -> bool {
        self.row().is_sensor
    }

    /// Default size (or length) of the type in launches and tasks, in units.
    pub fn default_size(self) -> f64 {
        self.row().size
    }
}

by_name!(ToolKind, "tool");

/// Corners of a regular polygon around the origin; the first is one corner after `angle`.
pub(super) fn regular(count: usize, angle: f64, size: f64) -> Vec<Vector> {
    let mut angle = angle;
    let corner = |_| {
        angle += TAU / count as f64;
        tool_direction(angle) * size
    };
    (0..count).map(corner).collect()
}

/// The frame of a body.
fn placed(position: [f64; 2], angle: f64) -> Pose {
    Pose { translation: position.into(), rotation: rotation(angle) }
}

/// Corners of a tool that is a regular polygon, in the frame of its body; empty for other types.
pub(super) fn local_corners(tool: &Tool) -> Vec<Vector> {
    let (count, turn) = tool.kind.row().corners;
    regular(count, turn + tool.angle, tool.size)
}

fn square(tool: &Tool) -> (Outline, Pose) {
    (Outline::rectangle(tool.size, tool.size), placed(tool.position, tool.angle))
}

fn disc(tool: &Tool) -> (Outline, Pose) {
    (Outline::disc(tool.size), Pose::from_translation(tool.position.into()))
}

/// Segments are built in world coordinates: their body is at the origin.
fn segment_along(tool: &Tool, along: Vector) -> (Outline, Pose) {
    let (place, half) = (Vector::from(tool.position), along / 2.0);
    (Outline::segment(place - half, place + half, tool.radius), Pose::IDENTITY)
}

fn segment(tool: &Tool) -> (Outline, Pose) {
    segment_along(tool, tool_direction(tool.angle) * tool.size)
}

/// Beyond 90 degrees it is rotated by half a turn, so that its upper side stays up.
fn trampoline(tool: &Tool) -> (Outline, Pose) {
    let angle = if tool.angle > FRAC_PI_2 { tool.angle + PI } else { tool.angle };
    segment_along(tool, tool_direction(angle) * tool.size)
}

fn plank(tool: &Tool) -> (Outline, Pose) {
    let half = tool_direction(tool.tilt()) * tool.size / 2.0;
    (Outline::segment(-half, half, tool.radius), Pose::from_translation(tool.position.into()))
}

/// CREATE passes the cannon's width as its angle: it is rotated by 10 radians, wherever it points.
fn cannon(tool: &Tool) -> (Outline, Pose) {
    (Outline::rectangle(7.3, 10.0), placed(tool.position, 10.0))
}

fn fan(tool: &Tool) -> (Outline, Pose) {
    (Outline::rectangle(6.7, 10.0), placed(tool.position, tool.angle))
}

/// Angle for the corners of CREATE's star; the engine keeps only the convex hull.
pub(super) const STAR_TURN: f64 = PI / 10.0;
