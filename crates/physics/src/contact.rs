//! Contact response with the order and constants of CREATE's engine (Chipmunk 7 at a fixed step of 1/30 s):
//! accumulated impulses, separate bias velocities for overlap, elasticity from the velocity before gravity.
//!
//! Here and in the joints, the order of every addition is the engine's: another order changes the last digit, and a
//! few hundred steps later the path.

use educe::Educe;
use rapier2d::prelude::*;

use super::body::{Body, GROUND, Shape};
use super::collide::Touching;
use super::units::DT;

/// Iterations of the solver in one step, each over all contacts, then all joints.
pub(super) const ITERATIONS: usize = 10;
/// Penetration that is not corrected, in units; single precision in the engine too.
const SLOP: f64 = 0.1_f32 as f64;
/// Fraction of the remaining penetration, or of a joint's separation, that one step removes: 1 - 0.9^(60 dt), with
/// the engine's 0.9 in single precision. A test computes it.
pub(super) const BIAS_SHARE: f64 = 0.190_000_042_915_343_67;
/// Target velocity per unit of penetration or separation.
pub(super) const PULL: f64 = -BIAS_SHARE / DT;
/// Steps after which a lost contact forgets its accumulated impulses.
pub(super) const PERSISTENCE: u64 = 3;

/// State of a contact between two shapes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum State {
    /// It began in this step.
    #[default]
    New,
    /// It already existed in the previous step.
    Lasting,
    /// A rule has dropped it until the shapes separate.
    Ignored,
    /// It was not found in the latest step, but is remembered.
    Lost,
}

/// A contact point with its solver data.
#[derive(Debug, Clone, Copy, Default)]
struct ContactPoint {
    /// From the first body's centre to the point on its surface, and the same for the second body.
    arm: Vector,
    other_arm: Vector,
    key: u64,
    normal_mass: f64,
    tangent_mass: f64,
    target_bias: f64,
    target_bounce: f64,
    normal_impulse: f64,
    tangent_impulse: f64,
    bias_impulse: f64,
}

/// A contact between two shapes, remembered across steps; by default one that no step has found yet.
#[derive(Debug, Clone, Copy, Educe)]
#[educe(Default)]
pub(super) struct Contact {
    pub shapes: [u32; 2],
    pub bodies: [u32; 2],
    pub state: State,
    /// The latest step that found it.
    pub seen: u64,
    /// Whether detection can find it again; contacts of sleeping bodies cannot be found.
    #[educe(Default = true)]
    pub is_cached: bool,
    /// If it is linked to its bodies, the number of its link, in order of linking. Linked contacts connect bodies
    /// into groups.
    pub linked: Option<u64>,
    /// Positions of the bodies of shapes that do not move.
    origins: [Vector; 2],
    normal: Vector,
    count: usize,
    points: [ContactPoint; 2],
    elasticity: f64,
    friction: f64,
}

impl Contact {
    pub fn is_between(&self, shapes: [u32; 2]) -> bool {
        self.shapes == shapes || self.shapes == [shapes[1], shapes[0]]
    }

    pub fn involves(&self, body: u32) -> bool {
        self.bodies.contains(&body)
    }

    /// Stores the result of detection. Points whose key existed before keep their impulses.
    pub fn refresh(&mut self, indices: [u32; 2], shapes: [&Shape; 2], bodies: &[Body], touching: &Touching) {
        let before = *self;
        self.shapes = indices;
        self.bodies = shapes.map(|shape| shape.body);
        self.origins = shapes.map(|shape| shape.origin);
        let centres = self.centres(bodies);
        self.count = touching.points().len();
        for (point, touch) in self.points.iter_mut().zip(touching.points()) {
            *point = ContactPoint {
                arm: touch.on_first - centres[0],
                other_arm: touch.on_second - centres[1],
                key: touch.key,
                ..ContactPoint::default()
            };
            for old in &before.points[..before.count] {
                if old.key == point.key {
                    point.normal_impulse = old.normal_impulse;
                    point.tangent_impulse = old.tangent_impulse;
                }
            }
        }
        self.normal = touching.normal;
        self.elasticity = shapes[0].elasticity * shapes[1].elasticity;
        self.friction = shapes[0].friction * shapes[1].friction;
        if self.state == State::Lost {
            self.state = State::New;
        }
    }

    /// Removes all points: after a rule or for a sensor there is nothing to solve.
    pub fn clear_points(&mut self) {
        self.count = 0;
        if self.state != State::Ignored {
            self.state = State::Lasting;
        }
    }

    fn centres(&self, bodies: &[Body]) -> [Vector; 2] {
        [0, 1].map(|side| match self.bodies[side] {
            0 => self.origins[side],
            body => bodies[body as usize].position,
        })
    }

    /// Computes effective masses, target bias velocity and target bounce, from the velocities before this step's
    /// gravity.
    pub fn prepare(&mut self, bodies: &[Body]) {
        let [centre, other_centre] = self.centres(bodies);
        let between = other_centre - centre;
        let [a, b] = self.bodies.map(|body| &bodies[body as usize]);
        let normal = self.normal;
        for point in &mut self.points[..self.count] {
            let arms = [point.arm, point.other_arm];
            let mass = |direction: Vector| {
                let [own, other] = arms.map(|arm| arm.perp_dot(direction));
                let turning = own * own * a.inverse_moment + other * other * b.inverse_moment;
                1.0 / (turning + (a.inverse_mass + b.inverse_mass))
            };
            point.normal_mass = mass(normal);
            point.tangent_mass = mass(normal.perp());
            let distance = (between + point.other_arm - point.arm).dot(normal);
            point.target_bias = (distance + SLOP).min(0.0) * PULL;
            point.bias_impulse = 0.0;
            let velocity = relative([a.velocity, b.velocity], [a.spin, b.spin], arms);
            point.target_bounce = velocity.dot(normal) * self.elasticity;
        }
    }

    /// Applies the impulses of the previous step again.
    pub fn warm_start(&self, bodies: &mut [Body]) {
        if self.state == State::New {
            return;
        }
        for point in &self.points[..self.count] {
            let impulse = combined(self.normal, point.normal_impulse, point.tangent_impulse);
            bodies[self.bodies[0] as usize].push(-impulse, point.arm);
            bodies[self.bodies[1] as usize].push(impulse, point.other_arm);
        }
    }

    /// Whether a point overlaps so far that a bias impulse is needed.
    pub fn overlaps(&self) -> bool {
        self.points[..self.count].iter().any(|point| point.target_bias != 0.0)
    }

    /// One iteration: moves the bias impulses towards their targets. Returns whether any of them changed.
    pub fn separate(&mut self, bodies: &mut [Body]) -> bool {
        let normal = self.normal;
        let [first, second] = self.bodies.map(|body| body as usize);
        let mut changed = false;
        for point in &mut self.points[..self.count] {
            let (a, b) = (&bodies[first], &bodies[second]);
            let arms = [point.arm, point.other_arm];
            let velocity = relative([a.bias_velocity, b.bias_velocity], [a.bias_spin, b.bias_spin], arms);
            let old = point.bias_impulse;
            let change = plus_dot(point.target_bias, -velocity, normal) * point.normal_mass;
            point.bias_impulse = not_negative(old + change);
            if point.bias_impulse == old {
                continue;
            }
            changed = true;
            let impulse = normal * (point.bias_impulse - old);
            if first != GROUND {
                bodies[first].push_bias(-impulse, point.arm);
            }
            if second != GROUND {
                bodies[second].push_bias(impulse, point.other_arm);
            }
        }
        changed
    }

    /// One iteration: moves normal and friction impulses towards their targets. Returns whether any of them changed.
    pub fn solve(&mut self, bodies: &mut [Body]) -> bool {
        let (normal, tangent) = (self.normal, self.normal.perp());
        let [first, second] = self.bodies.map(|body| body as usize);
        let mut changed = false;
        for point in &mut self.points[..self.count] {
            let (a, b) = (&bodies[first], &bodies[second]);
            let velocity = if second == GROUND {
                // The same numbers with fewer operations.
                -a.velocity_at(point.arm)
            } else {
                relative([a.velocity, Vector::ZERO], [a.spin, b.spin], [point.arm, point.other_arm]) + b.velocity
            };

            let old_normal = point.normal_impulse;
            let change = -plus_dot(point.target_bounce, velocity, normal) * point.normal_mass;
            point.normal_impulse = not_negative(old_normal + change);
            let limit = self.friction * point.normal_impulse;
            let old_tangent = point.tangent_impulse;
            let change = -velocity.dot(tangent) * point.tangent_mass;
            point.tangent_impulse = between(-limit, old_tangent + change, limit);

            let (along, across) = (point.normal_impulse - old_normal, point.tangent_impulse - old_tangent);
            if along == 0.0 && across == 0.0 {
                continue;
            }
            changed = true;
            let impulse = combined(normal, along, across);
            if first != GROUND {
                bodies[first].push(-impulse, point.arm);
            }
            if second != GROUND {
                bodies[second].push(impulse, point.other_arm);
            }
        }
        changed
    }
}

/// Velocity of the end of the second arm relative to that of the first.
fn relative(velocities: [Vector; 2], spins: [f64; 2], arms: [Vector; 2]) -> Vector {
    (velocities[1] - velocities[0]) + arms[1].perp() * spins[1] - arms[0].perp() * spins[0]
}

/// The number plus the product of two vectors.
pub(super) fn plus_dot(number: f64, a: Vector, b: Vector) -> f64 {
    (number + a.y * b.y) + a.x * b.x
}

/// The impulse with these components along and across the normal.
fn combined(normal: Vector, along: f64, across: f64) -> Vector {
    Vector::new(normal.x * along - normal.y * across, normal.x * across + normal.y * along)
}

fn not_negative(value: f64) -> f64 {
    if value > 0.0 { value } else { rarely(0.0) }
}

fn between(low: f64, value: f64, high: f64) -> f64 {
    let value = if value > low { value } else { rarely(low) };
    if value < high { value } else { rarely(high) }
}

/// The value, on a branch that is seldom taken: the processor predicts the branch and does not wait for the comparison.
fn rarely(value: f64) -> f64 {
    std::hint::black_box(());
    value
}
