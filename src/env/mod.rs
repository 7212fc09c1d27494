//! The environment: reset, step, observation, reward, termination.
//!
//! Meanings are Gymnasium's: an episode is *terminated* by the task itself (goal, ball
//! out of the screen or standing still) and *truncated* by the limit of actions.

mod action;
mod check;
mod environment;
mod episode;
mod observation;
#[cfg(test)]
mod tests;
mod vector;

pub use action::{Action, EndReason, EpisodeOver, Placement, Step, uniform_action};
pub use check::{Contract, Violation, check};
pub use environment::Environment;
pub use episode::{Snapshot, ball_names};
pub use observation::{OBJECT_FEATURES, OBJECT_SLOTS, VELOCITY_SCALE, observation_bounds, observation_len};
pub use vector::{Autoreset, Info, Outcome, State, VectorEnvironment, VectorError};
