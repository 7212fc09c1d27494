//! The environment: reset, step, observation, reward, termination.
//!
//! An agent has the task's own tool, or chooses among an action set of CREATE's tools; then an action
//! is a [`Choice`] of a tool and a place, and observations describe the tools and the scene.
//!
//! Meanings are Gymnasium's: an episode is *terminated* by the task itself (goal, ball
//! out of the screen or standing still) and *truncated* by the limit of actions.

mod action;
mod action_set;
mod check;
mod description;
mod environment;
mod episode;
mod image;
mod observation;
mod refusal;
#[cfg(test)]
mod tests;
mod vector;

pub use action::{Action, EndReason, EpisodeOver, Placement, Step, uniform_action};
pub use action_set::{ActionSet, Choice, TOOL_FEATURES, TOOL_PROPERTIES, held_tool, tool_embedding, tool_features};
pub use check::{Contract, Violation, check};
pub use description::{ObservationPart, ROLES, SCENE_FEATURES, SCENE_SLOTS, TARGET_POSITION};
pub use environment::{Environment, Start};
pub use episode::{Snapshot, ball_names};
pub use image::{IMAGE_LEN, IMAGE_SIDE, Pictures, PicturesError};
pub use observation::{
    BALL_POSITION, OBJECT_FEATURES, OBJECT_SLOTS, VELOCITY_SCALE, observation_bounds, observation_len,
};
pub use vector::{Autoreset, Ended, Info, Outcome, State, VectorEnvironment, VectorError};
