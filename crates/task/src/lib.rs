//! Task files: schema, validation with JSON paths, the shipped tasks, saving.
//!
//! A task is a scene (ball, tools, goal, ordered subgoals), the tool that the agent places, and the rules of an
//! episode, in one versioned JSON file. Positions are normalised to [-1, 1]; sizes are in units of the 84 x 84
//! screen.

#![deny(unsafe_code)]

mod create;
mod edit;
mod file;
mod objects;
mod part;
mod property;
mod rules;
mod schema;
mod shift;
mod tools;
mod validate;

pub use edit::{Draft, Edit, Editor};
pub use file::{
    FORMAT, TaskError, file_of, level_names, load, load_all, load_regular, name_of, parse, save, shipped,
    shipped_names, to_json,
};
pub use objects::{BallSpec, BoxSpec, Goal, GoalShape, Marker, Region, STANDARD_RADIUS};
pub use part::{Offset, Part, Shift};
pub use property::{Property, Values};
pub use rules::{Rewards, Rules, SubgoalCheck};
pub use schema::{Task, VERSION};
pub use tools::{Form, Placeable, ToolSpec};
pub use validate::{RULES, check_name};
