//! CREATE-like physics on rapier2d: units, tools, balls, the world and its step.
//!
//! rapier2d supplies bodies, colliders, mass properties and contact geometry; the
//! response to a contact follows CREATE's engine step by step ([`contact`]), because
//! the coarse step of 1/30 s decides where a ball goes as much as the laws of motion do.

mod body;
mod contact;
mod scene;
mod step;
mod tool;
mod units;
mod world;

pub use body::{Ball, BallState};
pub use scene::{MAX_OBJECTS, Row, START_OVERLAP, Scene, Trajectory, simulate};
pub use tool::{Tool, ToolKind};
pub use units::{ACTION_INTERVAL, GRAVITY, PHYSICS_DT, SCREEN, STEPS_PER_ACTION, to_normalised, to_units};
pub use world::{ObjectId, Sensor, Touch, World};
