//! CREATE's own formats: level files as CREATE ships them, and levels as they were
//! recorded with all numbers resolved. Both become tasks with CREATE's rules.

mod expression;
mod level;
mod recorded;

pub(super) use level::level_task;
pub use recorded::{RecordedLevel, RecordedTool};

/// Radius of CREATE's balls and stars, in units.
const GOAL_RADIUS: f32 = 4.0;
