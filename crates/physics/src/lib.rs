//! CREATE's physics: units, tools, balls, the world and its step, in double precision.
//!
//! The step follows CREATE's engine, Chipmunk 7 (MIT licence, copyright 2007-2015 Scott Lembcke and Howling Moon
//! Software), because its coarse step of 1/30 s affects the path of a ball as much as the laws of motion do. Each
//! file covers one subject:
//!
//! | file | subject |
//! |---|---|
//! | `tool_kind.rs` | tool types: one table of shapes, materials and rules |
//! | `tool.rs` | a tool: its type, position, size and material |
//! | `catalogue.rs` | CREATE's 2,365 tool variants |
//! | `rules.rs` | effects of tools on bodies that touch them, before or after the solver |
//! | `plank.rs` | hinges and see-saws |
//! | `body.rs` | balls and boxes, bodies and their motion |
//! | `outline.rs` | discs, thick segments, convex polygons, bounding boxes |
//! | `broad.rs` | which shapes may touch, in the order in which they are solved |
//! | `closest.rs`, `collide.rs` | closest points and contact points of two outlines |
//! | `contact.rs`, `joint.rs` | contact and joint impulses |
//! | `sleep.rs` | groups of bodies that fall asleep and wake |
//! | `step.rs` | the stages of a step |
//! | `world.rs` | the world and its public interface; a clone is a snapshot |
//!
//! rapier2d (in double precision) supplies vectors and the distance of a point from a tool.
//!
//! ```
//! use mge_physics::{Ball, BallState, GRAVITY, Tool, ToolKind, World};
//!
//! let mut world = World::new(GRAVITY);
//! world.add_ball(Ball::default(), BallState::at_rest([42.0, 70.0]));
//! world.add_tool(Tool::new(ToolKind::Floor, [42.0, 20.0]));
//! (0..300).for_each(|_| world.step());
//! assert!((20.0..70.0).contains(&world.ball(0).position[1]), "it fell, and the floor holds it");
//! ```
//!
//! # Agreement with CREATE
//!
//! In recordings of CREATE with every tool type, 1404 of 1408 launches and 120 of 120 scenes agree in every recorded
//! digit of every body at every step, with the same sleeping bodies. In the other four launches a see-saw or hinge
//! lies against its limit and jitters: a difference in the last bit grows within 60 steps, but the ball agrees to
//! 1e-5 units.

#![deny(unsafe_code)]

mod body;
mod broad;
mod catalogue;
mod closest;
mod collide;
mod contact;
mod direction;
mod joint;
mod outline;
mod plank;
mod rules;
mod sleep;
mod step;
mod symmetry;
#[cfg(test)]
mod tests;
mod tool;
mod tool_kind;
mod touch;
mod units;
mod world;

pub use body::{Ball, BallState, Motion};
pub use catalogue::{ACTION_SET, NO_OP, ToolSplit, catalogue_tool};
pub use tool::Tool;
pub use tool_kind::ToolKind;
pub use touch::{ObjectId, Touch};
pub use units::{
    GRAVITY, MAX_OBJECTS, PHYSICS_DT, SCREEN, START_OVERLAP, STEPS_PER_ACTION, exact, to_normalised, to_units,
};
pub use world::{Sensor, World};
