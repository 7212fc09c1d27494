//! Record of an episode, step by step.

use std::sync::Arc;

use mge_env::{Action, Environment, EpisodeOver, Placement, Start, Step};
use mge_physics::to_normalised;
use mge_run::{PlayedAction, PlayedEpisode, Source};
use mge_task::Task;

/// One action of an episode and its result.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedStep {
    /// Requested position of the tool, normalised.
    pub action: Action,
    /// What chose the action.
    pub source: Source,
    /// Outcome of placing the tool.
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// Number of the episode, from 1; 0 outside of training.
    pub episode: u64,
    /// The random draws of its reset.
    pub start: Start,
    /// Its actions, in order.
    pub steps: Vec<TracedStep>,
}

impl Trace {
    /// A trace without steps for episode number `episode`, to which the environment has just been reset.
    pub fn begin(env: &Environment, episode: u64) -> Self {
        Self { episode, start: env.start().clone(), steps: Vec::new() }
    }

    /// The environment at the beginning of the episode.
    pub fn environment(&self, task: &Arc<Task>) -> Environment {
        let mut env = Environment::new(task.clone());
        env.begin(self.start.clone());
        env
    }

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

    /// The data needed to replay the episode.
    pub fn played(&self) -> PlayedEpisode {
        let step = |step: &TracedStep| PlayedAction { action: step.action, source: step.source };
        let Start { shift, shifts, .. } = self.start.clone();
        PlayedEpisode { episode: self.episode, shift, shifts, actions: self.steps.iter().map(step).collect() }
    }

    /// Replays an episode; physics is deterministic to the last bit.
    pub fn replay(task: &Arc<Task>, played: &PlayedEpisode) -> Self {
        let PlayedEpisode { episode, shift, shifts, actions } = played.clone();
        let mut trace = Self { episode, start: Start { shift, shifts, ..Start::default() }, steps: Vec::new() };
        let mut env = trace.environment(task);
        for PlayedAction { action, source } in actions {
            if trace.step(&mut env, action, source).is_err() {
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
    fn a_trace_reports_its_total_reward_and_whether_the_goal_was_reached() {
        let task = Arc::new(mge_task::load("task1").unwrap());
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
