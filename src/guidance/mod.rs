//! Model-guided exploration: rollouts, action clusters, the action prior, epsilon schedules.
