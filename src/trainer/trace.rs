//! A finished episode, step by step.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::env::{Action, Environment, EpisodeOver, Placement, Step};
use crate::physics::to_normalised;
use crate::run::{PlayedAction, PlayedEpisode, Source};
use crate::task::Task;

/// One action of an episode and its result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TracedStep {
    /// Where the tool was to be placed, normalised.
    pub action: Action,
    /// Who chose it.
    pub source: Source,
    /// What became of the tool.
    pub placement: Placement,
    /// Reward of the action.
    pub reward: f32,
    /// Subgoals reached.
    pub subgoals: Vec<usize>,
    /// The goal was reached.
    pub goal: bool,
    /// Normalised positions of the target ball after each physics step.
    pub path: Vec<[f32; 2]>,
}

/// An episode, step by step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// Number of the episode, from 1; 0 outside of training.
    pub episode: u64,
    /// How far noise shifted its start, normalised.
    pub shift: [f32; 2],
    /// Its actions, in order.
    pub steps: Vec<TracedStep>,
}

impl Trace {
    /// Takes a step in the environment and appends it.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step(&mut self, env: &mut Environment, action: Action, source: Source) -> Result<Step, EpisodeOver> {
        let mut path = Vec::with_capacity(env.task().rules.steps_per_action as usize);
        let step = env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position)))?;
        self.steps.push(TracedStep {
            action,
            source,
            placement: step.placement,
            reward: step.reward,
            subgoals: step.subgoals.clone(),
            goal: step.goal,
            path,
        });
        Ok(step)
    }

    /// What has to be kept to play it again.
    pub fn played(&self) -> PlayedEpisode {
        let step = |step: &TracedStep| PlayedAction { action: step.action, source: step.source };
        PlayedEpisode { episode: self.episode, shift: self.shift, actions: self.steps.iter().map(step).collect() }
    }

    /// Plays an episode again: the physics give the same to the last bit.
    pub fn replay(task: &Arc<Task>, played: &PlayedEpisode) -> Self {
        let mut env = Environment::shifted(task.clone(), played.shift);
        let mut trace = Self { episode: played.episode, shift: played.shift, steps: Vec::new() };
        for PlayedAction { action, source } in &played.actions {
            if trace.step(&mut env, *action, *source).is_err() {
                break;
            }
        }
        trace
    }

    /// Whether the goal was reached.
    pub fn reached_goal(&self) -> bool {
        self.steps.iter().any(|step| step.goal)
    }

    /// Sum of the rewards.
    pub fn total_reward(&self) -> f32 {
        self.steps.iter().map(|step| step.reward).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_sums_its_rewards_and_knows_whether_a_step_reached_the_goal() {
        let task = Arc::new(crate::task::load("task1").unwrap());
        let mut env = Environment::new(task);
        let mut trace = Trace::default();
        assert!(!trace.reached_goal());
        for action in [[0.9, 0.9], [-0.9, 0.9]] {
            trace.step(&mut env, action, Source::Policy).unwrap();
        }
        trace.steps[0].reward = 0.5;
        trace.steps[1].reward = -2.0;
        assert_eq!((trace.total_reward(), trace.reached_goal()), (-1.5, false));
        trace.steps[0].goal = true;
        assert!(trace.reached_goal());
    }
}
