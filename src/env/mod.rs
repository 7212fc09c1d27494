//! The environment: reset, step, observation, reward, termination.
//!
//! Meanings are Gymnasium's: an episode is *terminated* by the task itself (goal, ball
//! out of the screen or standing still) and *truncated* by the limit of actions.

mod environment;
mod observation;

pub use environment::{Action, EndReason, Environment, EpisodeOver, Placement, Snapshot, Step};
pub use observation::{OBJECT_FEATURES, OBJECT_SLOTS, VELOCITY_SCALE, observation_len};
