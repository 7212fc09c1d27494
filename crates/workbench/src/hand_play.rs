//! Hand play: the user places the tools.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mge_env::{Action, Environment, EpisodeOver, Step};
use mge_task::Task;
use mge_trainer::{Source, Trace};

/// An episode played by hand.
#[derive(Debug, Clone)]
pub struct HandPlay {
    /// The episode.
    pub env: Environment,
    /// The episode so far.
    pub trace: Arc<Trace>,
}

impl HandPlay {
    /// Starts an episode.
    pub fn new(task: Arc<Task>, seed: u64) -> Self {
        let mut env = Environment::new(task);
        env.reset(&mut ChaCha8Rng::seed_from_u64(seed));
        Self { trace: Arc::new(Trace::begin(&env, 0)), env }
    }

    /// Places the task's tool and simulates one action interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn place(&mut self, place: Action) -> Result<Step, EpisodeOver> {
        Arc::make_mut(&mut self.trace).step(&mut self.env, place, Source::Hand)
    }
}
