//! CREATE's level files, as tasks with CREATE's rules.

mod expression;
mod level;
mod objects;
mod value;

pub(super) use level::level_task;
