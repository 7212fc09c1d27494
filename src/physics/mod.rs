//! CREATE-like physics on rapier2d: units, tools, balls, the world and its step.
//!
//! rapier2d supplies bodies, colliders, mass properties and contact geometry; the
//! response to a contact (`contact.rs`) and the order of a step (`step.rs`) follow CREATE's
//! engine, because its coarse step of 1/30 s decides where a ball goes as much as the
//! laws of motion do.
//!
//! # Agreement with CREATE
//!
//! Against recordings of CREATE (1800 launches at one tool, 100 scenes of 3 to 8 tools, 360
//! episodes) every first contact and every capture falls in the same step, and every
//! placement, reward, goal and subgoal is the same. Positions differ by at most 2e-4 units
//! in the 40 steps of a launch, and by less than 1e-3 units in the 160 steps of 98 of 100
//! scenes (median 1e-4). What remains has three causes:
//!
//! - **Single precision.** CREATE computes in double precision, rapier2d in single. That
//!   is worth about 1e-5 units in a second, more after many bounces, and up to 0.004 units
//!   for a ball that has fallen far below the screen, where coordinates are large.
//! - **Grazing contacts.** A ball that lies or slides on an edge is in contact in one step
//!   and 1e-6 units clear of it in the next; rounding can shift such a contact by a step.
//!   Two scenes of 100 show it (1e-3 and 0.035 units), and the long rests of episodes.
//! - **The order of simultaneous contacts.** Ten iterations of the solver do not converge for a ball wedged
//!   between two objects, so the order in which contacts are solved matters. CREATE takes
//!   it from the tree of its broad phase; here it is other balls first, then tools in the
//!   order in which they were added. About ten episodes of 360 differ for this reason
//!   after a while, by up to some units, with the same outcome.

mod body;
mod contact;
mod motion;
mod step;
#[cfg(test)]
mod tests;
mod tool;
mod touch;
mod units;
mod world;

pub use body::{Ball, BallState};
pub use tool::{Tool, ToolKind};
pub use touch::{ObjectId, Touch};
pub use units::{
    ACTION_INTERVAL, GRAVITY, MAX_OBJECTS, PHYSICS_DT, SCREEN, START_OVERLAP, STEPS_PER_ACTION, to_normalised, to_units,
};
pub use world::{Sensor, World};
