//! Hand play: the user places the tools.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::arguments::{Argument, Named, Position, Words};
use super::{Command, Execute, Verb, command};
use crate::{Session, SessionError};
use mge_env::{Action, Environment, EpisodeOver, Step};
use mge_task::Task;
use mge_trainer::{Source, Trace};

command! {
    /// Places the task's tool and simulates one action interval.
    Place(position: Action = Position): "place" "X Y" "place the tool and simulate one action";
    execute = |this, session| {
        let hand = &mut session.hand_play;
        let refusal = hand.env.snapshot().refusal(&hand.env.task().placeable.tool([0.0; 2]), this.0);
        let step = hand.place(this.0)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        let placed = refusal.map_or_else(|| "placed".to_owned(), |reason| format!("not placed, but the action is used: {reason}"));
        let subgoals: String = step.subgoals.iter().map(|index| format!("; subgoal {} reached", index + 1)).collect();
        Ok(format!("{placed}{subgoals}; reward {:.2}{end}", step.reward))
    };
}

command! {
    /// Restarts the episode of hand play.
    Reset: "reset" "" "restart the episode played by hand";
    execute = |_, session| {
        session.restart_hand_play();
        Ok("a new episode".to_owned())
    };
}

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
