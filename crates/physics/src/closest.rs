//! Closest points of two convex outlines: GJK on the Minkowski difference, and EPA for overlaps. The arithmetic
//! follows the engine's, because rounding decides where contacts begin.

// `clamp` would keep the NaN of a side of zero length.
#![expect(clippy::manual_clamp)]

use rapier2d::prelude::*;
use smallvec::{SmallVec, smallvec};

use super::outline::{Outline, clockwise, normalised};

/// Largest number of iterations; then the current edge is used.
const MAX_ROUNDS: usize = 30;

/// Corners of a hull, stored inline: overlaps would otherwise allocate in every step. Hulls rarely have more corners.
type Hull = SmallVec<[Difference; 8]>;

/// An outline in world coordinates, its bounding box, and its shape's number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side<'a> {
    pub outline: &'a Outline,
    pub bounds: &'a Aabb,
    pub number: u64,
}

/// The closest points of two outlines without their radii.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closest {
    /// On the first outline.
    pub on_first: Vector,
    /// On the second outline.
    pub on_second: Vector,
    /// Unit vector of the axis that separates them, from the first to the second.
    pub normal: Vector,
    /// Signed distance along the normal.
    pub distance: f64,
    /// The corners between which it was found, where the search starts in the next step; 0 for none.
    pub hint: u32,
}

/// A point of the Minkowski difference: a corner of the second outline minus a corner of the first.
#[derive(Debug, Clone, Copy)]
struct Difference {
    between: Vector,
    /// The numbers of the corners, the first outline's in the higher byte.
    corners: u32,
}

impl Difference {
    fn new((first, i): (Vector, usize), (second, j): (Vector, usize)) -> Self {
        Self { between: second - first, corners: ((i as u32) & 0xff) << 8 | (j as u32) & 0xff }
    }
}

/// The closest points of two outlines, starting from an earlier hint. Unless `measures` is set, those of an overlap are
/// any with a negative distance.
pub(super) fn closest(first: Side, second: Side, hint: u32, measures: bool) -> Closest {
    let pair = Pair { first: first.outline, second: second.outline, measures };
    let (start, end) = if hint == 0 {
        let (low, high) = (second.bounds.mins * 0.5, second.bounds.maxs * 0.5);
        // As in the engine, the second centre's x and y are subtracted in different orders: ties depend on it.
        let centre = first.bounds.center();
        let axis = Vector::new(centre.x - high.x - low.x, centre.y - low.y - high.y).perp();
        (pair.support(axis), pair.support(-axis))
    } else {
        let corner = |shift: u32| (hint >> shift & 0xff) as usize;
        (
            Difference::new(corner_of(pair.first, corner(24)), corner_of(pair.second, corner(16))),
            Difference::new(corner_of(pair.first, corner(8)), corner_of(pair.second, corner(0))),
        )
    };
    pair.approach(start, end)
}

struct Pair<'a> {
    first: &'a Outline,
    second: &'a Outline,
    /// Whether overlaps are measured.
    measures: bool,
}

impl Pair<'_> {
    /// The difference's corner farthest along a direction.
    fn support(&self, direction: Vector) -> Difference {
        Difference::new(farthest(self.first, -direction), farthest(self.second, direction))
    }

    /// GJK: finds the edge of the difference that is nearest to the origin.
    fn approach(&self, mut v0: Difference, mut v1: Difference) -> Closest {
        let mut round = 1;
        while round <= MAX_ROUNDS {
            if is_left(v1.between, v0.between, Vector::ZERO) {
                // The origin is behind the edge.
                std::mem::swap(&mut v0, &mut v1);
                // Rounding can make both sides "behind".
                if is_left(v1.between, v0.between, Vector::ZERO) {
                    break;
                }
            }
            let t = nearest(v0.between, v1.between);
            let normal =
                if -1.0 < t && t < 1.0 { (v1.between - v0.between).perp() } else { -mix(v0.between, v1.between, t) };
            let p = self.support(normal);
            if is_left(p.between, v0.between, Vector::ZERO) && is_left(v1.between, p.between, Vector::ZERO) {
                return if self.measures { self.expand(v0, p, v1) } else { self.on_edge(&v1, &v0) };
            }
            if p.between.dot(normal) <= v0.between.dot(normal).max(v1.between.dot(normal)) {
                break;
            }
            if edge_distance(v0.between, p.between) < edge_distance(p.between, v1.between) {
                v1 = p;
            } else {
                v0 = p;
            }
            round += 1;
        }
        self.on_edge(&v0, &v1)
    }

    /// EPA, for an origin inside the difference: repeatedly moves the nearest side of a growing hull outwards.
    fn expand(&self, v0: Difference, v1: Difference, v2: Difference) -> Closest {
        let (mut hull, mut grown): (Hull, Hull) = (smallvec![v0, v1, v2], Hull::new());
        let (mut hull, mut grown) = (&mut hull, &mut grown);
        for round in 1.. {
            // The side nearest to the origin ends at corner `end`.
            let mut start = &hull[hull.len() - 1];
            let (mut least, mut end, mut v0) = (f64::INFINITY, usize::from(hull.len() > 1), hull[0]);
            for (index, corner) in hull.iter().enumerate() {
                let distance = edge_distance(start.between, corner.between);
                if distance < least {
                    (least, end, v0) = (distance, index, *start);
                }
                start = corner;
            }
            let v1 = hull[end];
            let p = self.support((v1.between - v0.between).perp());
            let is_known = p.corners == v0.corners || p.corners == v1.corners;
            if is_known || !is_left(v0.between, v1.between, p.between) || round >= MAX_ROUNDS {
                return self.on_edge(&v0, &v1);
            }
            grown.clear();
            grown.push(p);
            let corners = hull[end..].iter().chain(&hull[..end]);
            let next = corners.clone().skip(1).map(|corner| corner.between).chain([p.between]);
            for (corner, after) in corners.zip(next) {
                if is_left(grown[grown.len() - 1].between, after, corner.between) {
                    grown.push(*corner);
                }
            }
            std::mem::swap(&mut hull, &mut grown);
        }
        self.on_edge(&v0, &v1)
    }

    /// The closest points given the edge of the difference that is nearest to the origin.
    fn on_edge(&self, v0: &Difference, v1: &Difference) -> Closest {
        let t = nearest(v0.between, v1.between);
        let between = mix(v0.between, v1.between, t);
        let on = |outline: &Outline, shift: u32| {
            let corner = |difference: &Difference| corner_of(outline, (difference.corners >> shift & 0xff) as usize).0;
            mix(corner(v0), corner(v1), t)
        };
        let (on_first, on_second) = (on(self.first, 8), on(self.second, 0));
        let hint = v0.corners << 16 | v1.corners;
        let normal = normalised(clockwise(v1.between - v0.between));
        let distance = normal.dot(between);
        if distance <= 0.0 || (-1.0 < t && t < 1.0) {
            return Closest { on_first, on_second, normal, distance, hint };
        }
        // Corner against corner: the axis is not the normal of an edge.
        let distance = between.length();
        Closest { on_first, on_second, normal: between * (1.0 / (distance + f64::MIN_POSITIVE)), distance, hint }
    }
}

/// The point of an outline that is farthest along a direction, the first of equals, and its number.
fn farthest(outline: &Outline, direction: Vector) -> (Vector, usize) {
    match outline {
        Outline::Disc { centre, .. } => (*centre, 0),
        Outline::Segment { a, b, .. } => {
            if a.dot(direction) > b.dot(direction) {
                (*a, 0)
            } else {
                (*b, 1)
            }
        }
        Outline::Polygon(polygon) => {
            let index = farthest_corner(polygon.corners(), direction);
            (polygon.corners()[index].position, index)
        }
    }
}

/// The number of the corner farthest along a direction, the first of equals.
pub(super) fn farthest_corner(corners: &[super::outline::Corner], direction: Vector) -> usize {
    let mut best = f64::NEG_INFINITY;
    let mut index = 0;
    for (i, corner) in corners.iter().enumerate() {
        let along = corner.position.dot(direction);
        if along > best {
            (best, index) = (along, i);
        }
    }
    index
}

/// A corner by its number; a number that a changed outline no longer has gives the first corner.
fn corner_of(outline: &Outline, number: usize) -> (Vector, usize) {
    match outline {
        Outline::Disc { centre, .. } => (*centre, 0),
        Outline::Segment { a, b, .. } => (if number == 0 { *a } else { *b }, number),
        Outline::Polygon(polygon) => {
            let number = if number < polygon.corners().len() { number } else { 0 };
            (polygon.corners()[number].position, number)
        }
    }
}

/// The position nearest to the origin on the edge from `a` (-1) to `b` (1).
fn nearest(a: Vector, b: Vector) -> f64 {
    let edge = b - a;
    -(edge.dot(a + b) / (edge.length_squared() + f64::MIN_POSITIVE)).max(-1.0).min(1.0)
}

fn mix(a: Vector, b: Vector, t: f64) -> Vector {
    let half = 0.5 * t;
    a * (0.5 - half) + b * (0.5 + half)
}

/// Squared distance of the edge from the origin.
fn edge_distance(a: Vector, b: Vector) -> f64 {
    mix(a, b, nearest(a, b)).length_squared()
}

/// Whether `c` is to the left of the line from `a` to `b`, without division.
fn is_left(a: Vector, b: Vector, c: Vector) -> bool {
    (b.y - a.y) * (a.x + b.x - 2.0 * c.x) > (b.x - a.x) * (a.y + b.y - 2.0 * c.y)
}
