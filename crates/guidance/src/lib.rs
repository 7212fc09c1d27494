//! Model-guided exploration: rollouts, action clusters, the action prior, epsilon
//! schedules (paper, sections 4.2 and 4.3).
//!
//! A dynamics model is used only as a [`RolloutModel`]. [`TruePhysics`] gives an upper bound on the effect of guidance.
//!
//! [`fn@build`] turns rollouts into an [`ActionPrior`]: for every stage of a task, clusters of the actions that were
//! predicted to reach it, from which exploration draws. It depends only on task, model, settings and seed, not on the
//! number of threads. [`plan`] and [`choose_subgoals`] use the same rollouts.
//!
//! ```
//! use std::sync::Arc;
//!
//! use mge_base::stop::Stop;
//! use mge_guidance::{GuidanceConfig, TruePhysics, build};
//!
//! let task = Arc::new(mge_task::load("task1")?);
//! let few = GuidanceConfig { model_rollouts: 50, environment_rollouts: 50, ..GuidanceConfig::default() };
//! let prior = build(&task, &TruePhysics, &few, 0, &Stop::default(), |stage| println!("stage {stage}"))?;
//! assert_eq!(prior.stages.len(), task.stage_count());
//! println!("an action for the first subgoal: {:?}", prior.sample(0, &mut rand::thread_rng()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

mod build;
mod clusters;
mod config;
mod planner;
mod prior;
mod rewarding;
mod rollout;
mod schedule;
mod subgoals;
#[cfg(test)]
mod tests;

pub use build::{EndStates, build, build_with};
pub use clusters::{Cluster, ClusterCount};
pub use config::{GuidanceConfig, GuidanceError, SETTINGS, StartStates};
pub use planner::{PlannerConfig, SETTINGS as PLANNER_SETTINGS, plan};
pub use prior::{ActionPrior, StagePrior};
pub use rewarding::{Played, Rewarding};
pub use rollout::{RapierPhysics, RolloutModel, TruePhysics};
pub use schedule::{EpsilonSchedule, ScheduleError};
pub use subgoals::{ChosenSubgoals, NO_SUBGOALS, TRIALS, choose_subgoals};
