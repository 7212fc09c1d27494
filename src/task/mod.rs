//! Task files: schema, validation with JSON paths, the shipped tasks, saving.
//!
//! A task is a scene (ball, tools, goal, ordered subgoals), the tool the agent may
//! place, and the rules of an episode, in one versioned JSON file. Positions are
//! normalised to [-1, 1]; sizes are in units of the 84 x 84 screen.

mod create;
mod edit;
mod file;
mod schema;
mod validate;

pub use edit::{Draft, Edit, Editor};
pub use file::{TaskError, level_names, load, parse, save, shipped, shipped_names, to_json};
pub use schema::{
    BallSpec, BoxSpec, Form, Goal, GoalShape, Marker, Offset, Part, Placeable, Region, Rewards, Rules, STANDARD_RADIUS,
    Shift, SubgoalCheck, Task, ToolSpec, VERSION,
};
pub use validate::RULES;
