//! DDPG: actor, critic, replay buffer, exploration noise, update. Knows vectors, not puzzles.

mod config;
mod ddpg;
mod learner;
mod noise;
#[cfg(test)]
mod probe;
mod replay;
mod state;

pub use config::{ConfigError, DdpgConfig, OuConfig};
pub use ddpg::{Ddpg, UpdateError, UpdateMetrics};
pub use learner::{Learner, Streams};
pub use noise::OrnsteinUhlenbeck;
pub use replay::{Batch, ReplayBuffer, ReplayError, Transition};
pub use state::{Checkpoint, StateError};
