//! Outlines of shapes: discs, thick segments and convex polygons, in a body's frame or in the world, with their
//! bounding boxes.

use rapier2d::prelude::*;

use super::direction::direction;

/// Largest number of corners of a polygon.
pub(super) const MAX_CORNERS: usize = 6;

/// Position and rotation of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub position: Vector,
    /// Cosine and sine of the angle.
    pub rotation: Vector,
}

impl Frame {
    pub fn new(position: Vector, angle: f64) -> Self {
        Self { position, rotation: direction(angle) }
    }

    /// A point of the body's frame, in the world.
    fn point(&self, point: Vector) -> Vector {
        self.vector(point) + self.position
    }

    /// A direction of the body's frame, in the world.
    pub fn vector(&self, vector: Vector) -> Vector {
        turned(vector, self.rotation)
    }
}

/// A vector rotated by an angle given as cosine and sine.
pub(super) fn turned(vector: Vector, rotation: Vector) -> Vector {
    Vector::new(rotation.x * vector.x - rotation.y * vector.y, rotation.y * vector.x + rotation.x * vector.y)
}

/// The unit vector along `vector`; the zero vector stays zero.
pub(super) fn normalised(vector: Vector) -> Vector {
    vector * (1.0 / (vector.length() + f64::MIN_POSITIVE))
}

/// A vector rotated clockwise by a right angle.
pub(super) fn clockwise(vector: Vector) -> Vector {
    Vector::new(vector.y, -vector.x)
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub low: Vector,
    pub high: Vector,
}

impl Bounds {
    pub fn intersects(&self, other: &Self) -> bool {
        self.low.x <= other.high.x
            && other.low.x <= self.high.x
            && self.low.y <= other.high.y
            && other.low.y <= self.high.y
    }

    pub fn contains(&self, other: &Self) -> bool {
        self.low.x <= other.low.x
            && self.high.x >= other.high.x
            && self.low.y <= other.low.y
            && self.high.y >= other.high.y
    }

    pub fn merged(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn area(&self) -> f64 {
        (self.high.x - self.low.x) * (self.high.y - self.low.y)
    }

    /// Twice the Manhattan distance between the centres.
    pub fn proximity(&self, other: &Self) -> f64 {
        (self.low.x + self.high.x - other.low.x - other.high.x).abs()
            + (self.low.y + self.high.y - other.low.y - other.high.y).abs()
    }

    pub fn centre(&self) -> Vector {
        self.low * 0.5 + self.high * 0.5
    }
}

/// A polygon's corner and the outward normal of the side that ends there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Corner {
    pub position: Vector,
    pub normal: Vector,
}

/// A convex polygon, counter-clockwise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    count: usize,
    corners: [Corner; MAX_CORNERS],
}

impl Polygon {
    pub fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }
}

/// The geometry of a shape.
#[derive(Debug, Clone, Copy)]
pub(super) enum Outline {
    Disc {
        centre: Vector,
        radius: f64,
    },
    /// `radius` rounds its ends and sides.
    Segment {
        a: Vector,
        b: Vector,
        normal: Vector,
        radius: f64,
    },
    Polygon(Polygon),
}

impl Outline {
    pub fn disc(radius: f64) -> Self {
        Self::Disc { centre: Vector::ZERO, radius }
    }

    pub fn segment(a: Vector, b: Vector, radius: f64) -> Self {
        Self::Segment { a, b, normal: clockwise(normalised(b - a)), radius }
    }

    /// A polygon with corners counter-clockwise, of which at most [`MAX_CORNERS`] are kept.
    pub fn polygon(corners: &[Vector]) -> Self {
        let count = corners.len().min(MAX_CORNERS);
        let mut polygon = Polygon { count, corners: [Corner::default(); MAX_CORNERS] };
        for (index, &position) in corners[..count].iter().enumerate() {
            let before = corners[(index + count - 1) % count];
            polygon.corners[index] = Corner { position, normal: normalised(clockwise(position - before)) };
        }
        Self::Polygon(polygon)
    }

    /// Like [`Outline::polygon`], starting with the leftmost (then lowest) corner, as the engine numbers the corners
    /// of a hull.
    pub fn hull(corners: &[Vector]) -> Self {
        let before = |a: &Vector, b: &Vector| (a.x, a.y) < (b.x, b.y);
        let first = (1..corners.len())
            .fold(0, |first, index| if before(&corners[index], &corners[first]) { index } else { first });
        let mut ordered = corners.to_vec();
        ordered.rotate_left(first);
        Self::polygon(&ordered)
    }

    /// A rectangle centred at the origin; its first corner is the lower right one.
    pub fn rectangle(width: f64, height: f64) -> Self {
        let (x, y) = (width / 2.0, height / 2.0);
        Self::polygon(&[Vector::new(x, -y), Vector::new(x, y), Vector::new(-x, y), Vector::new(-x, -y)])
    }

    /// The outline, given in a body's frame, in world coordinates.
    pub fn placed(&self, frame: &Frame) -> Self {
        let mut placed = *self;
        placed.move_to(self, frame);
        placed
    }

    /// Sets it to the outline `local` in world coordinates, like [`placed`](Self::placed). Writes only what a frame
    /// changes: an outline is large, and every step moves several.
    pub fn move_to(&mut self, local: &Self, frame: &Frame) {
        match (self, local) {
            (Self::Disc { centre, .. }, Self::Disc { centre: local, .. }) => *centre = frame.point(*local),
            (Self::Segment { a, b, normal, .. }, Self::Segment { a: local_a, b: local_b, normal: local, .. }) => {
                (*a, *b, *normal) = (frame.point(*local_a), frame.point(*local_b), frame.vector(*local));
            }
            (Self::Polygon(placed), Self::Polygon(local)) => {
                for (corner, local) in placed.corners.iter_mut().zip(local.corners()) {
                    *corner = Corner { position: frame.point(local.position), normal: frame.vector(local.normal) };
                }
            }
            _ => unreachable!("a body's outline keeps its kind"),
        }
    }

    #[inline]
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Disc { centre, radius } => around(*centre, *centre, *radius),
            Self::Segment { a, b, radius, .. } => around(a.min(*b), a.max(*b), *radius),
            Self::Polygon(polygon) => {
                let mut corners = polygon.corners().iter().map(|corner| corner.position);
                let first = corners.next().unwrap_or(Vector::ZERO);
                let (low, high) =
                    corners.fold((first, first), |(low, high), corner| (low.min(corner), high.max(corner)));
                Bounds { low, high }
            }
        }
    }

    /// Distance of the surface from the disc's centre or the segment; 0 for polygons.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Disc { radius, .. } | Self::Segment { radius, .. } => *radius,
            Self::Polygon(_) => 0.0,
        }
    }

    /// Whether both are segments on one straight line. The engine finds that such segments touch, however far apart
    /// they are: belts and floors that are placed at the edge of the screen, for example.
    pub fn is_in_line_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Segment { a, b, .. }, Self::Segment { a: c, b: d, .. }) => {
                [c, d].iter().all(|&&point| (*b - *a).perp_dot(point - *a) == 0.0)
            }
            _ => false,
        }
    }

    /// Of two touching shapes, the one with the lower rank comes first.
    pub fn rank(&self) -> u8 {
        match self {
            Self::Disc { .. } => 0,
            Self::Segment { .. } => 1,
            Self::Polygon(_) => 2,
        }
    }
}

fn around(low: Vector, high: Vector, radius: f64) -> Bounds {
    Bounds { low: low - Vector::splat(radius), high: high + Vector::splat(radius) }
}
