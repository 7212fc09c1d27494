//! Hand play: a person places the tools.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::env::{Action, Environment, EpisodeOver, Snapshot, Step};
use crate::task::Task;
use crate::trainer::{Source, Trace};

/// An episode played by hand.
#[derive(Debug, Clone)]
pub struct HandPlay {
    env: Environment,
    trace: Trace,
}

impl HandPlay {
    /// Begins an episode.
    pub fn new(task: Arc<Task>, seed: u64) -> Self {
        let mut env = Environment::new(task);
        env.reset(&mut ChaCha8Rng::seed_from_u64(seed));
        Self { env, trace: Trace::default() }
    }

    /// Places the tool and lets the world run for one action interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn place(&mut self, action: Action) -> Result<Step, EpisodeOver> {
        self.trace.step(&mut self.env, action, Source::Hand)
    }

    /// The episode so far.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The state the episode is in.
    pub fn snapshot(&self) -> &Snapshot {
        self.env.snapshot()
    }

    /// The task being played.
    pub fn task(&self) -> &Arc<Task> {
        self.env.task()
    }
}
