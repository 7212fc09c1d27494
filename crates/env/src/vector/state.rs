//! The state of one of several environments, in memory and as text.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::player::{Outcome, Player};
use crate::action_set::Choice;
use crate::environment::{Environment, Start};
use mge_physics::ToolSplit;
use mge_task::Task;

/// The state of one environment: its episode and its random numbers.
#[derive(Debug, Clone)]
pub struct State(pub(super) Player);

/// A state as text. Reading it replays the episode: the start and the actions determine an episode exactly.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Recorded {
    rng: ChaCha8Rng,
    begun: bool,
    split: Option<ToolSplit>,
    start: Start,
    actions: Vec<Choice>,
}

impl State {
    /// The task being played, as it was loaded.
    pub fn task(&self) -> &Arc<Task> {
        self.0.env.loaded_task()
    }

    /// The environment in this state.
    pub fn environment(&self) -> &Environment {
        &self.0.env
    }

    /// The state as JSON, without its task.
    pub fn to_json(&self) -> String {
        let Player { env, rng, begun, actions, .. } = self.0.clone();
        let recorded = Recorded { rng, begun, split: env.split(), start: env.start().clone(), actions };
        // Plain numbers always serialise.
        serde_json::to_string(&recorded).expect("a state is plain data")
    }

    /// Parses a state of `task` written by [`to_json`](Self::to_json).
    ///
    /// # Errors
    /// When the text is not a state of this task.
    pub fn parse(text: &str, task: &Arc<Task>) -> Result<Self, serde_json::Error> {
        let Recorded { rng, begun, split, start, actions } = serde_json::from_str(text)?;
        let mut env = Environment::new(task.clone()).with_tools(split);
        env.begin(start);
        let played = actions.iter().take_while(|action| env.step(**action).is_ok()).count();
        if played < actions.len() {
            let reason = format!("the episode ends after {played} of its {} actions", actions.len());
            return Err(serde::de::Error::custom(reason));
        }
        Ok(Self(Player { env, rng, begun, actions, outcome: Outcome::default() }))
    }
}
