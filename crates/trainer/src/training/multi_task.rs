//! Runs on several tasks, which share the learner: what is kept for each task, and whose turn it is.

use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Training, TrainingError};
use crate::config::RunConfig;
use crate::exploration::Attempts;
use mge_guidance::ActionPrior;
use mge_task::Task;

/// What [`TrainingState`](super::TrainingState) has for the task being played, kept for a task that is not being played.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct TaskState {
    pub prior: Option<Arc<ActionPrior>>,
    pub rewarding: Vec<VecDeque<Vec<f32>>>,
    pub attempts: Attempts,
}

impl Training {
    /// A new run with the priors of its tasks, in their order; none if it is not guided.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub(crate) fn with_priors(config: RunConfig, priors: Vec<Arc<ActionPrior>>) -> Result<Self, TrainingError> {
        let mut priors = priors.into_iter();
        let mut training = Self::new(config, priors.next())?;
        for (state, prior) in training.progress.further.iter_mut().zip(priors) {
            state.prior = Some(prior);
        }
        Ok(training)
    }

    /// The priors of the tasks, in their order.
    pub(crate) fn priors(&self) -> Vec<Option<Arc<ActionPrior>>> {
        let further = self.progress.further.iter().map(|state| state.prior.clone());
        std::iter::once(self.progress.prior.clone()).chain(further).collect()
    }

    /// Number of tasks.
    pub(super) fn task_count(&self) -> u64 {
        1 + self.further.len() as u64
    }

    /// The task of the next episode, counted from 0.
    pub(super) fn turn(&self) -> usize {
        (self.progress.episode % self.task_count()) as usize
    }

    /// Number of episodes of the latest task, and that task; none before the first episode.
    pub(super) fn latest_turn(&self) -> Option<(u64, usize)> {
        let before = self.progress.episode.checked_sub(1)?;
        Some((before / self.task_count() + 1, (before % self.task_count()) as usize))
    }

    /// The task of an episode of the current evaluation, counted from 0. Successive evaluations continue the turns.
    pub(super) fn evaluated_task(&self, number: u32) -> &Arc<Task> {
        let evaluation = self.config.evaluation;
        let before = self.progress.episode / u64::from(evaluation.every.max(1)) * u64::from(evaluation.episodes);
        self.loaded_task(((before + u64::from(number)) % self.task_count()) as usize)
    }

    /// A task, counted from 0. Only between episodes.
    pub(super) fn loaded_task(&self, task: usize) -> &Arc<Task> {
        match task {
            0 => self.env.loaded_task(),
            further => self.further[further - 1].loaded_task(),
        }
    }

    /// Carries out `work` on a task, counted from 0.
    pub(super) fn on_task<T>(&mut self, task: usize, work: impl FnOnce(&mut Self) -> T) -> T {
        self.exchange(task);
        let outcome = work(self);
        self.exchange(task);
        outcome
    }

    /// Exchanges the first task with another one, or back.
    fn exchange(&mut self, task: usize) {
        let Some(further) = task.checked_sub(1) else { return };
        std::mem::swap(&mut self.env, &mut self.further[further]);
        let progress = &mut self.progress;
        let state = &mut progress.further[further];
        std::mem::swap(&mut progress.prior, &mut state.prior);
        std::mem::swap(&mut progress.rewarding, &mut state.rewarding);
        std::mem::swap(&mut progress.attempts, &mut state.attempts);
    }
}
