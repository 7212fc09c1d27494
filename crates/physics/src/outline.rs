//! Outlines of shapes: discs, thick segments and convex polygons, in a body's frame or in the world, with their
//! bounding boxes.

use rapier2d::prelude::*;

/// Largest number of corners of a polygon.
pub(super) const MAX_CORNERS: usize = 6;

/// The unit vector along `vector`; the zero vector stays zero.
pub(super) fn normalised(vector: Vector) -> Vector {
    vector * (1.0 / (vector.length() + f64::MIN_POSITIVE))
}

/// A vector rotated clockwise by a right angle.
pub(super) fn clockwise(vector: Vector) -> Vector {
    Vector::new(vector.y, -vector.x)
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
    pub fn placed(&self, frame: &Pose) -> Self {
        let mut placed = *self;
        placed.move_to(self, frame);
        placed
    }

    /// Sets it to the outline `local` in world coordinates, like [`placed`](Self::placed). Writes only what a frame
    /// changes: an outline is large, and every step moves several.
    pub fn move_to(&mut self, local: &Self, frame: &Pose) {
        match (self, local) {
            (Self::Disc { centre, .. }, Self::Disc { centre: local, .. }) => *centre = frame * *local,
            (Self::Segment { a, b, normal, .. }, Self::Segment { a: local_a, b: local_b, normal: local, .. }) => {
                (*a, *b, *normal) = (frame * *local_a, frame * *local_b, frame.rotation * *local);
            }
            (Self::Polygon(placed), Self::Polygon(local)) => {
                for (corner, local) in placed.corners.iter_mut().zip(local.corners()) {
                    *corner = Corner { position: frame * local.position, normal: frame.rotation * local.normal };
                }
            }
            _ => unreachable!("a body's outline keeps its kind"),
        }
    }

    #[inline]
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Disc { centre, radius } => around(*centre, *centre, *radius),
            Self::Segment { a, b, radius, .. } => around(a.min(*b), a.max(*b), *radius),
            Self::Polygon(polygon) => Aabb::from_points(polygon.corners().iter().map(|corner| corner.position)),
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

fn around(low: Vector, high: Vector, radius: f64) -> Aabb {
    Aabb::new(low - Vector::splat(radius), high + Vector::splat(radius))
}
