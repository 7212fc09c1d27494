//! Task files: schema, validation with JSON paths, the shipped tasks, saving.
//!
//! A task is a scene (ball, tools, goal, ordered subgoals), the tool that the agent places, and the rules of an
//! episode, in one versioned JSON file. Positions are normalised to [-1, 1]; sizes are in units of the 84 x 84
//! screen. CREATE's own levels are included. Whatever is loaded has been validated, and errors name the place in
//! the file; an [`Editor`] applies, undoes and redoes [`Edit`]s that keep a task valid.
//!
//! ```
//! use mge_task::{Edit, Editor, load, parse, to_json};
//!
//! let mut editor = Editor::new(load("task1")?);
//! editor.apply(&Edit::AddSubgoal { position: [0.5, 0.0], radius: None })?;
//! assert_eq!(parse(&to_json(editor.task()), "my task")?, *editor.task());
//! assert!(editor.undo());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

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

pub use edit::{Draft, Edit, Editor, Object};
pub use file::{
    FORMAT, TaskError, file_of, is_edited, level_names, load, load_regular, parse, save, save_as, shipped,
    shipped_name, shipped_names, to_json,
};
pub use objects::{BallSpec, BoxSpec, Goal, GoalShape, Marker, Region, STANDARD_RADIUS};
pub use part::{Offset, Part, Shift};
pub use property::{Property, Values};
pub use rules::{Rewards, Rules, SubgoalCheck};
pub use schema::{Task, VERSION};
pub use tools::{Form, Placeable, ToolSpec};
pub use validate::{RULES, check_name};
