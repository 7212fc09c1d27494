//! Joints of planks: accumulated impulses, warm-started in every step and solved after the contacts in the same
//! iterations.

use rapier2d::prelude::*;

use super::body::{Body, GROUND};
use super::contact::{BIAS_SHARE, PULL, plus_dot};
use super::outline::normalised;
use super::units::DT;

/// A joint between a plank and another body or the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    /// The plank, and the body it is joined to.
    pub bodies: [u32; 2],
    /// The anchor on the plank, in its frame. The other body is held at its centre.
    anchor: Vector,
    /// The anchor on the ground.
    place: Vector,
    kind: Kind,
    /// From the plank's centre to its anchor.
    arm: Vector,
    /// Accumulated impulse: along the normal in x (pin, slide), a vector (pivot), or an angular impulse in x (gear).
    impulse: Vector,
}

/// The type of a joint.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// Keeps the anchors together, along the line between them.
    Pin { normal: Vector, mass: f64, target: f64 },
    /// Keeps the anchors at most `longest` apart.
    Slide { longest: f64, normal: Vector, mass: f64, target: f64 },
    /// Keeps the anchors together in every direction; the symmetric matrix maps velocities to impulses.
    Pivot { matrix: [Vector; 2], target: Vector },
    /// Keeps the angles equal.
    Gear { mass: f64, target: f64 },
}

impl Joint {
    /// Holds a plank's centre at a position.
    pub fn pin(plank: u32, place: Vector) -> Self {
        let kind = Kind::Pin { normal: Vector::ZERO, mass: 0.0, target: 0.0 };
        Self::new([plank, GROUND as u32], Vector::ZERO, place, kind)
    }

    /// Keeps a point of a plank within a distance of a position.
    pub fn slide(plank: u32, anchor: Vector, place: Vector, longest: f64) -> Self {
        let kind = Kind::Slide { longest, normal: Vector::ZERO, mass: 0.0, target: 0.0 };
        Self::new([plank, GROUND as u32], anchor, place, kind)
    }

    /// Holds a body's centre at a point of a plank.
    pub fn pivot(plank: u32, anchor: Vector, body: u32) -> Self {
        let kind = Kind::Pivot { matrix: [Vector::ZERO; 2], target: Vector::ZERO };
        Self::new([plank, body], anchor, Vector::ZERO, kind)
    }

    /// Rotates a body with a plank.
    pub fn gear(plank: u32, body: u32) -> Self {
        Self::new([plank, body], Vector::ZERO, Vector::ZERO, Kind::Gear { mass: 0.0, target: 0.0 })
    }

    fn new(bodies: [u32; 2], anchor: Vector, place: Vector, kind: Kind) -> Self {
        Self { bodies, anchor, place, kind, arm: Vector::ZERO, impulse: Vector::ZERO }
    }

    /// Computes the arm, effective masses and targets for this step.
    pub fn prepare(&mut self, bodies: &[Body]) {
        let [a, b] = self.bodies.map(|body| &bodies[body as usize]);
        self.arm = a.frame().rotation * self.anchor;
        let arm = self.arm;
        let end = if self.bodies[1] == GROUND as u32 { self.place } else { b.position };
        let apart = (end - a.position) - arm;
        // Pins and slides are fixed to the ground, which adds nothing.
        let along = |normal: Vector| {
            let lever = arm.perp_dot(normal);
            1.0 / (a.inverse_mass + lever * lever * a.inverse_moment)
        };
        let target_for = |separation: f64| -BIAS_SHARE * separation / DT;
        match &mut self.kind {
            Kind::Pin { normal, mass, target } => {
                let distance = apart.length();
                *normal = apart * (1.0 / if distance != 0.0 { distance } else { f64::INFINITY });
                *mass = along(*normal);
                *target = target_for(distance);
            }
            Kind::Slide { longest, normal, mass, target } => {
                let distance = apart.length();
                let excess = (distance - *longest).max(0.0);
                if excess > 0.0 {
                    *normal = normalised(apart);
                } else {
                    *normal = Vector::ZERO;
                    self.impulse = Vector::ZERO;
                }
                *mass = along(*normal);
                *target = target_for(excess);
            }
            Kind::Pivot { matrix, target } => {
                *matrix = inverse_mass_matrix([a, b], arm);
                *target = apart * PULL;
            }
            Kind::Gear { mass, target } => {
                *mass = 1.0 / (a.inverse_moment + b.inverse_moment);
                *target = target_for(b.angle - a.angle);
            }
        }
    }

    /// One iteration. Returns whether the impulse changed.
    #[inline]
    fn solve(&mut self, plank: &mut Body, other: &mut Body) -> bool {
        let old = self.impulse;
        // A pin holds the plank's centre; the ground, to which pins and slides are fixed, does not move.
        match self.kind {
            Kind::Pin { normal, mass, target } => self.impulse.x += plus_dot(target, plank.velocity, normal) * mass,
            Kind::Slide { normal, .. } if normal == Vector::ZERO => return false,
            Kind::Slide { normal, mass, target, .. } => {
                let velocity = plank.velocity_at(self.arm);
                self.impulse.x = (old.x + plus_dot(target, velocity, normal) * mass).min(0.0);
            }
            Kind::Pivot { matrix, target } => {
                let missing = target - (other.velocity - plank.velocity) + self.arm.perp() * plank.spin;
                self.impulse = matrix[0] * missing.x + (matrix[1] * missing.y + old);
            }
            Kind::Gear { mass, target } => self.impulse.x += (target - (other.spin - plank.spin)) * mass,
        }
        let change = self.impulse - old;
        self.push(plank, other, change);
        change != Vector::ZERO
    }

    /// Applies an impulse to the bodies.
    #[inline]
    fn push(&self, plank: &mut Body, other: &mut Body, impulse: Vector) {
        match self.kind {
            Kind::Pin { normal, .. } => plank.velocity -= normal * impulse.x * plank.inverse_mass,
            Kind::Slide { normal, .. } => plank.push(normal * -impulse.x, self.arm),
            Kind::Pivot { .. } => {
                plank.push(-impulse, self.arm);
                other.velocity += impulse * other.inverse_mass;
            }
            Kind::Gear { .. } => {
                plank.spin -= impulse.x * plank.inverse_moment;
                other.spin += impulse.x * other.inverse_moment;
            }
        }
    }
}

/// One iteration over the active joints. Returns whether an impulse changed.
pub(super) fn solve(joints: &mut [Joint], active: &[u32], bodies: &mut [Body]) -> bool {
    let mut changed = false;
    for_each(joints, active, bodies, |joint, plank, other| changed |= joint.solve(plank, other));
    changed
}

/// Applies the impulses of the previous step again.
pub(super) fn warm_start(joints: &mut [Joint], active: &[u32], bodies: &mut [Body]) {
    for_each(joints, active, bodies, |joint, plank, other| joint.push(plank, other, joint.impulse));
}

/// Calls `act` with the active joints in turn and their two bodies, of which only the velocities may change. Joints
/// take as long as the chain of operations on these velocities: joints of one plank, which are neighbours in the list,
/// share copies, so that the velocities do not pass through memory between them.
#[inline]
fn for_each(
    joints: &mut [Joint],
    active: &[u32],
    bodies: &mut [Body],
    mut act: impl FnMut(&mut Joint, &mut Body, &mut Body),
) {
    let mut rest = active;
    while let Some(&first) = rest.first() {
        let plank = joints[first as usize].bodies[0];
        let count = rest.iter().take_while(|joint| joints[**joint as usize].bodies[0] == plank).count();
        let (own, after) = rest.split_at(count);
        rest = after;
        // A see-saw's weight; all other joints are with the ground.
        let other = own.iter().map(|&joint| joints[joint as usize].bodies[1]).max().unwrap_or(GROUND as u32);
        let [plank, other] = [plank, other].map(|body| body as usize);
        let (mut a, mut b) = (bodies[plank], bodies[other]);
        for &joint in own {
            act(&mut joints[joint as usize], &mut a, &mut b);
        }
        (bodies[plank].velocity, bodies[plank].spin) = (a.velocity, a.spin);
        (bodies[other].velocity, bodies[other].spin) = (b.velocity, b.spin);
    }
}

/// The symmetric matrix that maps velocities at the end of a body's arm, relative to another body, to impulses.
fn inverse_mass_matrix([a, b]: [&Body; 2], arm: Vector) -> [Vector; 2] {
    let turn = a.inverse_moment;
    let sum = a.inverse_mass + b.inverse_mass;
    let (xx, yy) = (arm.y * arm.y * turn + sum, arm.x * arm.x * turn + sum);
    let xy = arm.y * turn * -arm.x;
    let inverse = 1.0 / (xx * yy - xy * xy);
    [Vector::new(yy * inverse, -xy * inverse), Vector::new(-xy * inverse, xx * inverse)]
}
