//! A learned dynamics model as a model of rollouts.

use std::sync::Arc;

use super::rollout::{Rollout, RolloutAction, RolloutModel};
use crate::dynamics::{DynamicsError, Model};
use crate::env::{Action, Snapshot};
use crate::task::Task;

/// A dynamics model that was found to fit a task.
#[derive(Debug, Clone)]
pub struct LearnedModel(Arc<Model>);

impl LearnedModel {
    /// The model for rollouts of `task`.
    ///
    /// # Errors
    /// When the task has objects the model was never trained on, or other physics.
    pub fn for_task(model: Arc<Model>, task: &Task) -> Result<Self, DynamicsError> {
        model.check_task(task)?;
        Ok(Self(model))
    }
}

impl RolloutModel for LearnedModel {
    /// # Panics
    /// If `task` is not one the model was found to fit.
    fn rollouts(&self, task: &Arc<Task>, starts: &[&Snapshot], sequences: &[Vec<Action>]) -> Vec<Rollout> {
        let predicted = self.0.rollouts(task, starts, sequences).expect("the model fits the task");
        predicted
            .into_iter()
            .zip(sequences)
            .map(|(predicted, sequence)| Rollout {
                actions: sequence
                    .iter()
                    .zip(predicted.placed.iter().zip(&predicted.touched))
                    .map(|(&action, (&placed, &touched))| RolloutAction { action, placed, touched })
                    .collect(),
                hit: predicted.hit,
                path: predicted.path,
                balls: predicted.balls,
            })
            .collect()
    }
}
