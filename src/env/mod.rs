//! The environment: reset, step, observation, reward, termination.
