//! The environment: reset, step, observation, reward, termination.
//!
//! Meanings are Gymnasium's: an episode is *terminated* by the task itself (goal, ball
//! out of the screen or standing still) and *truncated* by the limit of actions.

mod check;
mod environment;
mod episode;
mod observation;
mod replay;
mod serve;

pub use check::{Promise, Violation, check};
pub use environment::{Action, EndReason, Environment, EpisodeOver, Placement, Step};
pub use episode::Snapshot;
pub use observation::{OBJECT_FEATURES, OBJECT_SLOTS, VELOCITY_SCALE, observation_len};
pub use replay::{StepLine, play_actions, play_episodes, replay};
pub use serve::serve;
