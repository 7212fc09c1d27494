//! The environment: reset, step, observation, reward, termination.
//!
//! An agent has either the task's own tool or an action set of CREATE's tools. With an action set, an action is a
//! [`Choice`] of a tool and a position, and observations describe the tools and the scene.
//!
//! Terms are those of Gymnasium: an episode is *terminated* by the task itself (goal reached, ball out of the screen,
//! standstill) and *truncated* by the maximum number of actions.
//!
//! A [`Snapshot`] continues an episode exactly where it was taken. [`VectorEnvironment`] steps many environments at
//! once, [`protocol`] serves one to other programs.
//!
//! ```
//! use std::sync::Arc;
//!
//! use mge_env::{Environment, uniform_action};
//! use rand::SeedableRng;
//!
//! let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
//! let mut env = Environment::new(Arc::new(mge_task::load("task1")?));
//! env.reset(&mut rng);
//! let end = loop {
//!     let step = env.step(uniform_action(&mut rng))?;
//!     if let Some(end) = step.end {
//!         break end;
//!     }
//! };
//! println!("{end}; the goal was reached: {}", env.snapshot().goal_reached);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

pub mod protocol;

mod action;
mod action_set;
mod description;
mod environment;
mod episode;
mod observation;
#[cfg(test)]
mod tests;
mod vector;

pub use action::{Action, EndReason, EpisodeOver, Placement, Step, uniform_action};
pub use action_set::{ActionSet, Choice, TOOL_FEATURES, TOOL_PROPERTIES, tool_features};
pub use description::{ROLES, SCENE_FEATURES, SCENE_SLOTS};
pub use environment::{Environment, Start};
pub use episode::{MARKER, Snapshot, TARGET, ball_names, goal_object};
pub use observation::{
    OBJECT_FEATURES, OBJECT_SLOTS, ObservationPart, VELOCITY_SCALE, observation_bounds, observation_len,
};
pub use vector::{Autoreset, Ended, FEW, Info, Outcome, State, VectorEnvironment, VectorError};
