//! Hand play: a person places the tools.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::env::{Action, ActionSet, Choice, Environment, EpisodeOver, Snapshot, Step};
use crate::physics::{NO_OP, catalogue_tool};
use crate::task::Task;
use crate::trainer::{Source, Trace};

/// The number of the task's own tool beside those of the catalogue, which has no such number.
const OWN: usize = NO_OP + 1;

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

    /// Places the task's tool, or one of CREATE's catalogue, and lets the world run for one action interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn place(&mut self, place: Action, number: Option<usize>) -> Result<Step, EpisodeOver> {
        let tool = number.map_or(0, |number| self.offer(number));
        self.trace.step(&mut self.env, Choice { tool, place }, Source::Hand)
    }

    /// The index of a tool of the catalogue among those of the episode, which begin with the task's own.
    fn offer(&mut self, number: usize) -> usize {
        let tools = &mut self.trace.tools;
        if let Some(index) = tools.iter().position(|known| *known == number) {
            return index;
        }
        if tools.is_empty() {
            tools.push(OWN);
        }
        tools.push(number);
        let own = self.env.task().placeable.tool([0.0; 2]);
        let offered = tools.iter().map(|&number| (number, catalogue_tool(number).copied().or(Some(own))));
        self.env = self.env.clone().with_action_set(ActionSet::new(offered));
        tools.len() - 1
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
