//! Model-guided exploration: rollouts, action clusters, the action prior, epsilon
//! schedules (paper, sections 4.2 and 4.3).
//!
//! A dynamics model is used only as a [`RolloutModel`], or as a [`ToolModel`] if the agent chooses
//! among tools. [`TruePhysics`] implements both and gives an upper bound on the effect of guidance.

#![deny(unsafe_code)]

mod build;
mod clusters;
mod config;
mod planner;
mod prior;
mod proposal;
mod rewarding;
mod rollout;
mod schedule;
mod subgoal_search;
#[cfg(test)]
mod tests;
mod tool_rollout;
mod tools;

pub use build::build;
pub use clusters::{Cluster, ClusterCount, ToolCluster};
pub use config::{GuidanceConfig, GuidanceError, SETTINGS, StartStates};
pub use planner::{PlannerConfig, SETTINGS as PLANNER_SETTINGS, plan};
pub use prior::{ActionPrior, StagePrior};
pub use proposal::propose_subgoals;
pub use rewarding::{Played, Rewarding};
pub use rollout::{InterruptibleModel, RapierPhysics, RolloutModel, TruePhysics};
pub use schedule::{EpsilonSchedule, ScheduleError};
pub use subgoal_search::{ChosenSubgoals, NO_SUBGOALS, TRIALS, choose_subgoals};
pub use tool_rollout::{ToolModel, ToolRollout};
pub use tools::build_with_tools;
