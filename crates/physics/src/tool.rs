//! Tools with their sizes and materials.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI, TAU};

use rapier2d::parry::query;
use rapier2d::prelude::*;

use super::direction::direction;
use super::outline::Outline;
use super::tool_kind::{ToolKind, local_corners};
use super::units::START_OVERLAP;
use mge_base::validation::{ValidationError, in_range};

/// A tool at a position.
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
    /// Constrained hinge and see-saw: largest angle of the plank, in radians.
    pub max_angle: f64,
    /// See-saw: the left end is up, and the weight on the right.
    pub on_left: bool,
    /// See-saw: mass of the weight.
    pub weight: f64,
    /// Planks: if it exceeds 1, the excess is the fraction of its velocity and spin that a ball in contact loses in
    /// every step.
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

    /// The same tool at another position, in units.
    pub fn at(mut self, position: [f64; 2]) -> Self {
        self.position = position;
        self
    }

    /// Checks that the tool can be added to a world.
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

    /// World coordinates of the corners, counter-clockwise; for segments the two ends, for circles points along the
    /// circumference. In single precision, for networks and screens.
    pub fn vertices(&self) -> Vec<[f32; 2]> {
        let corners: Vec<Vector> = match self.outline() {
            Outline::Disc { centre, radius } => {
                (0..48).map(|k| centre + direction(TAU * f64::from(k) / 48.0) * radius).collect()
            }
            Outline::Segment { a, b, .. } => vec![a, b],
            Outline::Polygon(polygon) => polygon.corners().iter().map(|corner| corner.position).collect(),
        };
        corners.into_iter().map(single).collect()
    }

    /// Centre in units, in single precision.
    pub fn centre(&self) -> [f32; 2] {
        self.position.map(|p| p as f32)
    }

    /// Half width and half height of the axis-aligned box around the tool, in units.
    pub fn half_extents(&self) -> [f32; 2] {
        let (bounds, centre) = (self.outline().bounds(), Vector::from(self.position));
        single((bounds.maxs - centre).max(centre - bounds.mins))
    }

    /// Whether a point (in units) is farther than `distance` from the tool's bounding box, and thus from its surface:
    /// a much faster test than the [distance](Self::surface) itself.
    pub fn is_beyond(&self, point: [f32; 2], distance: f32) -> bool {
        // More than the rounding error of single precision.
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

    /// Whether a ball of this radius at `centre`, both in units, would start inside the tool. It may start in front of a
    /// fan or on a plank.
    pub fn holds_start(&self, centre: [f32; 2], radius: f32) -> bool {
        let is_solid = !self.kind.is_sensor() && !self.kind.is_hinged();
        is_solid && radius - self.surface(centre).0 > START_OVERLAP
    }

    /// The shape for rapier, and its position in the world.
    pub fn shape(&self) -> (SharedShape, Vector) {
        match self.outline() {
            Outline::Disc { centre, radius } => (SharedShape::ball(radius), centre),
            Outline::Segment { a, b, radius, .. } if radius > 0.0 => (SharedShape::capsule(a, b, radius), Vector::ZERO),
            Outline::Segment { a, b, .. } => (SharedShape::segment(a, b), Vector::ZERO),
            Outline::Polygon(polygon) => {
                let corners = polygon.corners().iter().map(|corner| corner.position).collect();
                // With checked sizes the corners are distinct; a point is the fallback.
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
    pub(super) fn local_outline(&self) -> (Outline, Pose) {
        (self.kind.row().outline)(self)
    }

    /// Angle of a plank while its body's angle is 0.
    pub fn tilt(&self) -> f64 {
        match self.kind {
            ToolKind::SeeSaw if self.on_left => -self.max_angle,
            ToolKind::SeeSaw => self.max_angle,
            _ => 0.0,
        }
    }

    /// Corners of a regular polygon, as the engine numbers them; empty for other types.
    pub(super) fn corners(&self) -> Vec<Vector> {
        let place = Vector::from(self.position);
        local_corners(self).into_iter().map(|corner| place + corner).collect()
    }
}

/// In single precision, for networks and screens.
fn single(vector: Vector) -> [f32; 2] {
    [vector.x as f32, vector.y as f32]
}
