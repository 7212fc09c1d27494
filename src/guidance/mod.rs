//! Model-guided exploration: rollouts, action clusters, the action prior, epsilon
//! schedules (paper, sections 4.2 and 4.3).
//!
//! This room knows a dynamics model only as a [`RolloutModel`]; the true physics is one
//! too ([`TruePhysics`]), which gives the upper bound of what guidance can do.

mod clusters;
mod model;
mod planner;
mod prior;
mod proposal;
mod rollout;
mod schedule;
#[cfg(test)]
mod tests;

pub use clusters::{Cluster, ClusterCount};
pub use model::LearnedModel;
pub use planner::{PlannerConfig, SETTINGS as PLANNER_SETTINGS, plan};
pub use prior::{ActionPrior, GuidanceConfig, GuidanceError, SETTINGS, StagePrior, StartStates, build};
pub use proposal::propose_subgoals;
pub use rollout::{Played, Rewarding, Rollout, RolloutAction, RolloutModel, TruePhysics};
pub use schedule::{EpsilonSchedule, ScheduleError};
