//! Hand play: the user places the tools.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mge_env::{Action, ActionSet, Choice, Environment, EpisodeOver, Snapshot, Step};
use mge_task::Task;
use mge_trainer::{Source, Trace};

/// An episode played by hand.
#[derive(Debug, Clone)]
pub struct HandPlay {
    env: Environment,
    trace: Trace,
}

impl HandPlay {
    /// Starts an episode.
    pub fn new(task: Arc<Task>, seed: u64) -> Self {
        let mut env = Environment::new(task);
        env.reset(&mut ChaCha8Rng::seed_from_u64(seed));
        Self { trace: Trace::begin(&env, 0), env }
    }

    /// Places the task's tool, or the tool with this number in CREATE's catalogue, and simulates one action interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn place(&mut self, place: Action, number: Option<usize>) -> Result<Step, EpisodeOver> {
        // Without a number, the step uses the task's own tool, which is not in the catalogue.
        let tool = number.map(|number| self.index(number));
        let set = tool.map(|_| ActionSet::of_catalogue(&self.trace.start.tools));
        self.env = self.env.clone().with_action_set(set);
        self.trace.step(&mut self.env, Choice { tool: tool.unwrap_or(0), place }, Source::Hand)
    }

    /// The index of a catalogue tool among those of the episode; adds it if it is new.
    fn index(&mut self, number: usize) -> usize {
        let tools = &mut self.trace.start.tools;
        tools.iter().position(|known| *known == number).unwrap_or_else(|| {
            tools.push(number);
            tools.len() - 1
        })
    }

    /// The episode so far.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The current state of the episode.
    pub fn snapshot(&self) -> &Snapshot {
        self.env.snapshot()
    }

    /// The task being played.
    pub fn task(&self) -> &Arc<Task> {
        self.env.task()
    }
}
