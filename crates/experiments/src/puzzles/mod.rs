//! Generated puzzles: layouts to which no method has been tuned, and the results of methods on them.
//!
//! A folder of puzzles holds `index.json` ([`Index`]) and a task file without subgoals for each puzzle.
//! Uniform play alone decides whether a layout is a puzzle: it reaches the goal, but rarely. The bench proposes
//! subgoals for each puzzle with a dynamics model, which was not trained on puzzles, and trains agents on the result as
//! a [sweep](crate::sweep).

mod bench;
mod generate;
mod index;
#[cfg(test)]
mod tests;

pub use bench::Bench;
pub use generate::{Criteria, START_NOISE, generate};
pub use index::{Index, Split};
