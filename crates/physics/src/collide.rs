//! Contact points of two outlines: one point if a disc is involved, up to two where sides meet.

// `clamp` would keep the NaN of a side of zero length.
#![expect(clippy::manual_clamp)]

use rapier2d::prelude::*;

use super::closest::{Side, closest, farthest_corner};
use super::outline::Outline;

/// Multiplier of the engine's pair hash.
const PAIR_HASH_MULTIPLIER: u64 = 3_344_921_057;

/// A point where two outlines touch, in world coordinates.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Point {
    pub on_first: Vector,
    pub on_second: Vector,
    /// Identifies the corners that meet here, to recognise the point in the next step. As in the engine, different
    /// points may in rare cases share a key.
    pub key: u64,
}

/// How two outlines touch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Touching {
    /// Unit vector from the first to the second outline.
    pub normal: Vector,
    count: usize,
    points: [Point; 2],
    /// Hint for the search for closest points in the next step.
    pub hint: u32,
}

impl Touching {
    /// The contact points; empty if the outlines are apart.
    pub fn points(&self) -> &[Point] {
        &self.points[..self.count]
    }

    fn push(&mut self, on_first: Vector, on_second: Vector, key: u64) {
        self.points[self.count] = Point { on_first, on_second, key };
        self.count += 1;
    }
}

/// Contact points of two outlines, of which the first has the lower or equal rank. Unless `measures` is set, they only
/// show whether the outlines touch.
pub(super) fn collide(first: Side, second: Side, hint: u32, measures: bool) -> Touching {
    match (first.outline, second.outline) {
        (&Outline::Disc { centre, radius }, &Outline::Disc { centre: other, radius: other_radius }) => {
            let reach = radius + other_radius;
            point_contact(centre, radius, other, other_radius, reach, Vector::new(1.0, 0.0), hint)
        }
        (&Outline::Disc { centre, radius }, &Outline::Segment { a, b, normal, radius: thickness }) => {
            let along = b - a;
            let t = (along.dot(centre - a) / along.length_squared()).min(1.0).max(0.0);
            point_contact(centre, radius, a + along * t, thickness, radius + thickness, normal, hint)
        }
        _ => edge_contact(first, second, hint, measures),
    }
}

/// Contact of two discs; the second may stand for the nearest part of a segment.
fn point_contact(
    centre: Vector,
    radius: f64,
    other: Vector,
    other_radius: f64,
    reach: f64,
    if_coincident: Vector,
    hint: u32,
) -> Touching {
    let between = other - centre;
    let squared = between.length_squared();
    let mut touching = Touching { hint, ..Touching::default() };
    if squared < reach * reach {
        let distance = squared.sqrt();
        touching.normal = if distance != 0.0 { between * (1.0 / distance) } else { if_coincident };
        touching.push(centre + touching.normal * radius, other + touching.normal * -other_radius, 0);
    }
    touching
}

/// A side of an outline: its ends with their numbers.
struct Edge {
    ends: [(Vector, u64); 2],
    radius: f64,
}

fn edge_contact(first: Side, second: Side, hint: u32, measures: bool) -> Touching {
    let is_disc = matches!(first.outline, Outline::Disc { .. });
    // Where sides meet, the points decide whether the outlines touch.
    let found = closest(first, second, hint, measures || !is_disc);
    let mut touching = Touching { normal: found.normal, hint: found.hint, ..Touching::default() };
    let (radius, other_radius) = (first.outline.radius(), second.outline.radius());
    if found.distance.is_nan() || found.distance > radius + other_radius {
        return touching;
    }
    let normal = found.normal;
    if is_disc {
        touching.push(found.on_first + normal * radius, found.on_second + normal * -other_radius, 0);
        return touching;
    }
    let (e1, e2) = (facing(first, normal), facing(second, -normal));
    let across = |edge: &Edge, end: usize| edge.ends[end].0.perp_dot(normal);
    let spread = |edge: &Edge| 1.0 / (across(edge, 1) + f64::MIN_POSITIVE - across(edge, 0));
    let (spread1, spread2) = (spread(&e1), spread(&e2));
    // The point of a side that corresponds to an end of the other side, with the offset of its surface.
    let on = |edge: &Edge, from: f64, spread: f64, offset: Vector| {
        let t = ((from - across(edge, 0)) * spread).min(1.0).max(0.0);
        (edge.ends[1].0 * t + offset) + edge.ends[0].0 * (1.0 - t)
    };
    for (end1, end2) in [(0, 1), (1, 0)] {
        let p1 = on(&e1, across(&e2, end2), spread1, normal * e1.radius);
        let p2 = on(&e2, across(&e1, end1), spread2, normal * -e2.radius);
        if (p2 - p1).dot(normal) <= 0.0 {
            touching.push(p1, p2, pair_number(e1.ends[end1].1, e2.ends[end2].1));
        }
    }
    touching
}

/// The side of an outline that faces a direction.
fn facing(side: Side, direction: Vector) -> Edge {
    let number = |corner: usize| pair_number(side.number, corner as u64);
    match side.outline {
        // Discs have no sides; they are handled earlier.
        Outline::Disc { centre, radius } => Edge { ends: [(*centre, number(0)); 2], radius: *radius },
        Outline::Segment { a, b, normal, radius } => {
            let (a, b) = ((*a, number(0)), (*b, number(1)));
            Edge { ends: if normal.dot(direction) > 0.0 { [a, b] } else { [b, a] }, radius: *radius }
        }
        Outline::Polygon(polygon) => {
            let corners = polygon.corners();
            let count = corners.len();
            let at = farthest_corner(corners, direction);
            let (before, after) = ((at + count - 1) % count, (at + 1) % count);
            let end = |corner: usize| (corners[corner].position, number(corner));
            let is_before = direction.dot(corners[at].normal) > direction.dot(corners[after].normal);
            Edge { ends: if is_before { [end(before), end(at)] } else { [end(at), end(after)] }, radius: 0.0 }
        }
    }
}

/// The engine's hash of a pair of numbers.
fn pair_number(a: u64, b: u64) -> u64 {
    a.wrapping_mul(PAIR_HASH_MULTIPLIER) ^ b.wrapping_mul(PAIR_HASH_MULTIPLIER)
}
