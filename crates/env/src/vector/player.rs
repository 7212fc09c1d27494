//! One environment of several: its episode, and the results of its resets and steps.

use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::action::{EndReason, Placement};
use crate::action_set::Choice;
use crate::environment::Environment;
use crate::episode::Snapshot;

/// What an environment does after the end of an episode (the autoreset modes of Gymnasium's vector environments).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// The next step ignores its action and starts the next episode, with reward 0.
    NextStep,
    /// The step that ends the episode also starts the next one; the last observation is in [`Outcome::ended`].
    SameStep,
    /// A step after the end is an error.
    Disabled,
}

/// The result of a reset or a step, apart from the observation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Reward of the step.
    pub reward: f32,
    /// The task itself ended the episode.
    pub terminated: bool,
    /// The maximum number of actions ended the episode.
    pub truncated: bool,
    /// The state of the current episode.
    pub info: Info,
    /// The episode that this step ended, if the next one has already started.
    pub ended: Option<Ended>,
}

/// The end of an episode.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ended {
    /// Its last observation.
    pub observation: Vec<f32>,
    /// Its final state.
    pub info: Info,
    /// Catalogue numbers of its action set, if it had one.
    pub tools: Vec<usize>,
}

/// Facts about an episode beyond observation and reward.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Info {
    /// The goal has been reached.
    pub goal: bool,
    /// Which subgoals have been reached.
    pub subgoals: Vec<bool>,
    /// Tools placed so far.
    pub placed: usize,
    /// Whether the latest action's tool was placed, and if not, why.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<Placement>,
    /// Why the episode is over, if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<EndReason>,
}

impl Info {
    /// The facts about the episode `now`.
    pub fn of(now: &Snapshot, placement: Option<Placement>) -> Self {
        let mut info = Self::default();
        info.update(now, placement);
        info
    }

    /// Like [`of`](Self::of), but reuses its memory.
    fn update(&mut self, now: &Snapshot, placement: Option<Placement>) {
        self.goal = now.goal_reached;
        self.subgoals.clear();
        self.subgoals.extend_from_slice(&now.reached);
        self.placed = now.placed.len();
        self.placement = placement;
        self.end = now.end();
    }
}

/// An environment, its random numbers, and the actions of its episode.
#[derive(Debug, Clone)]
pub(super) struct Player {
    pub env: Environment,
    pub rng: ChaCha8Rng,
    pub begun: bool,
    pub actions: Vec<Choice>,
    pub outcome: Outcome,
}

impl Player {
    pub fn is_over(&self) -> bool {
        self.env.snapshot().end().is_some()
    }

    pub fn info(&self, placement: Option<Placement>) -> Info {
        Info::of(self.env.snapshot(), placement)
    }

    /// Starts an episode and returns its first observation.
    pub fn reset(&mut self) -> Vec<f32> {
        self.begun = true;
        self.actions.clear();
        let observation = self.env.reset(&mut self.rng);
        self.outcome = Outcome { info: self.info(None), ..Outcome::default() };
        observation
    }

    /// Takes an action and writes the observation after it.
    pub fn step(&mut self, action: Choice, autoreset: Autoreset, observation: &mut [f32]) {
        let Ok(step) = self.env.step_without_observation(action) else {
            return observation.copy_from_slice(&self.reset());
        };
        self.actions.push(action);
        let outcome = &mut self.outcome;
        (outcome.reward, outcome.terminated, outcome.truncated) = (step.reward, step.terminated, step.truncated);
        outcome.ended = None;
        outcome.info.update(self.env.snapshot(), Some(step.placement));
        if step.end.is_none() || autoreset != Autoreset::SameStep {
            return self.env.write_observation(observation);
        }
        let (last, tools) = (self.env.observation(), self.env.start().tools.clone());
        let Outcome { reward, terminated, truncated, info, .. } = std::mem::take(&mut self.outcome);
        observation.copy_from_slice(&self.reset());
        let begun = std::mem::take(&mut self.outcome.info);
        let ended = Some(Ended { observation: last, info, tools });
        self.outcome = Outcome { reward, terminated, truncated, info: begun, ended };
    }
}
