//! The five tool types with CREATE's geometry and materials.

use rapier2d::prelude::*;
use serde::{Deserialize, Serialize};

use crate::validation::{ValidationError, in_range};

/// The paper's tool types (section 5.1). All are static.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToolKind {
    /// A solid axis-aligned square that captures a ball touching it from above.
    Bucket,
    /// The rotated square: it stands on a corner.
    Square,
    /// An axis-aligned square.
    Box,
    /// A vertical segment.
    Wall,
    /// A horizontal segment.
    Floor,
}

impl ToolKind {
    /// Every tool type, in the order of the one-hot encoding of observations.
    pub const ALL: [ToolKind; 5] = [Self::Bucket, Self::Square, Self::Box, Self::Wall, Self::Floor];

    /// Position in [`ToolKind::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// The name used in files, on the command line and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bucket => "bucket",
            Self::Square => "square",
            Self::Box => "box",
            Self::Wall => "wall",
            Self::Floor => "floor",
        }
    }

    /// Whether the tool is a segment, described by a length and a thickness.
    pub fn is_segment(self) -> bool {
        matches!(self, Self::Wall | Self::Floor)
    }

    /// CREATE's elasticity of the type.
    pub fn elasticity(self) -> f32 {
        if self == Self::Box { 0.4 } else { 0.5 }
    }

    /// The size (or length) CREATE's tools of this type have in our launches and
    /// tasks unless they say otherwise, in units.
    pub fn default_size(self) -> f32 {
        match self {
            Self::Bucket => 6.0,
            Self::Square | Self::Box => 8.0,
            Self::Wall | Self::Floor => 16.0,
        }
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

/// A static tool with all its numbers, in units and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tool {
    /// Type, which decides the shape.
    pub kind: ToolKind,
    /// Centre in units.
    pub position: [f32; 2],
    /// Bucket and square: centre to vertex. Box: side. Wall and floor: length.
    pub size: f32,
    /// Rotation in radians, counter-clockwise.
    pub angle: f32,
    /// Rounding of a segment's ends and sides (half its thickness); 0 for polygons.
    pub radius: f32,
    /// Elasticity; a pair's elasticity is the product of both.
    pub elasticity: f32,
    /// Friction coefficient; a pair's friction is the product of both.
    pub friction: f32,
}

impl Tool {
    /// A tool of CREATE's default size and material, at `position` in units.
    pub fn new(kind: ToolKind, position: [f32; 2]) -> Self {
        Self {
            kind,
            position,
            size: kind.default_size(),
            angle: 0.0,
            radius: if kind.is_segment() { 1.0 } else { 0.0 },
            elasticity: kind.elasticity(),
            friction: 1.0,
        }
    }

    /// The same tool with another size.
    pub fn with_size(mut self, size: f32) -> Self {
        self.size = size;
        self
    }

    /// The same tool at another place, in units.
    pub fn at(mut self, position: [f32; 2]) -> Self {
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
        in_range(self.elasticity, "elasticity", 0.0, 1.0)?;
        in_range(self.friction, "friction", 0.0, 100.0)
    }

    /// World coordinates of the corners, counter-clockwise: four for polygons, the
    /// two end points for segments.
    pub fn vertices(&self) -> Vec<[f32; 2]> {
        let (sin, cos) = self.angle.sin_cos();
        self.local_vertices()
            .into_iter()
            .map(|v| [self.position[0] + v.x * cos - v.y * sin, self.position[1] + v.x * sin + v.y * cos])
            .collect()
    }

    /// Half width and half height of the axis-aligned box around the tool, in units.
    pub fn half_extents(&self) -> [f32; 2] {
        self.vertices().iter().fold([0.0; 2], |extent, vertex| {
            std::array::from_fn(|axis| f32::max(extent[axis], (vertex[axis] - self.position[axis]).abs() + self.radius))
        })
    }

    /// Distance from a point (in units) to the tool's surface, negative inside, and
    /// the unit vector from the nearest surface point towards the point.
    pub fn surface(&self, point: [f32; 2]) -> (f32, [f32; 2]) {
        let ball = SharedShape::ball(0.0);
        let pose = Pose::from_translation(Vector::from(point));
        let contact = rapier2d::parry::query::contact(&self.pose(), &*self.shape(), &pose, &*ball, f32::MAX)
            // Both shapes are supported and the prediction distance is unbounded.
            .ok()
            .flatten()
            .expect("a point always has a nearest surface point");
        (contact.dist, contact.normal1.into())
    }

    /// Corners in the tool's own frame.
    fn local_vertices(&self) -> Vec<Vector> {
        let half = self.half_side();
        match self.kind {
            ToolKind::Bucket | ToolKind::Box => vec![
                Vector::new(-half, -half),
                Vector::new(half, -half),
                Vector::new(half, half),
                Vector::new(-half, half),
            ],
            ToolKind::Square => vec![
                Vector::new(self.size, 0.0),
                Vector::new(0.0, self.size),
                Vector::new(-self.size, 0.0),
                Vector::new(0.0, -self.size),
            ],
            ToolKind::Wall => vec![Vector::new(0.0, -half), Vector::new(0.0, half)],
            ToolKind::Floor => vec![Vector::new(-half, 0.0), Vector::new(half, 0.0)],
        }
    }

    /// Half the side of a polygon, half the length of a segment.
    fn half_side(&self) -> f32 {
        match self.kind {
            ToolKind::Bucket | ToolKind::Square => self.size * std::f32::consts::FRAC_1_SQRT_2,
            ToolKind::Box | ToolKind::Wall | ToolKind::Floor => self.size / 2.0,
        }
    }

    /// Place and rotation of [`Tool::shape`]: the rotated square is a cuboid on a corner,
    /// which has a closed form for the nearest point.
    pub(super) fn pose(&self) -> Pose {
        let turn = if self.kind == ToolKind::Square { std::f32::consts::FRAC_PI_4 } else { 0.0 };
        Pose::new(Vector::from(self.position), self.angle + turn)
    }

    pub(super) fn shape(&self) -> SharedShape {
        let corners = self.local_vertices();
        if self.kind.is_segment() {
            if self.radius > 0.0 {
                SharedShape::capsule(corners[0], corners[1], self.radius)
            } else {
                SharedShape::segment(corners[0], corners[1])
            }
        } else {
            let half = self.half_side();
            SharedShape::cuboid(half, half)
        }
    }

    /// The rapier collider: shape, place and material with CREATE's product rule.
    pub(super) fn collider(&self) -> Collider {
        ColliderBuilder::new(self.shape())
            .position(self.pose())
            .restitution(self.elasticity)
            .restitution_combine_rule(CoefficientCombineRule::Multiply)
            .friction(self.friction)
            .friction_combine_rule(CoefficientCombineRule::Multiply)
            .build()
    }
}
