//! A model of the ball's motion together with the task it fits.

use std::sync::Arc;

use mge_base::stop::Stop;
use mge_env::{Action, Snapshot};
use mge_guidance::RolloutModel;
use mge_task::Task;
use mge_trainer::{RunConfig, required_model};

/// A model together with the one task it was checked against.
#[derive(Debug, Clone)]
pub struct TaskModel {
    pub(super) task: Arc<Task>,
    pub(super) model: Arc<dyn RolloutModel>,
}

impl TaskModel {
    /// Loads the model of a configuration, or trains it, for its task.
    ///
    /// # Errors
    /// When the source has no model, or the model cannot be loaded or does not fit the task.
    pub fn new(config: &RunConfig) -> Result<Self, String> {
        let model = required_model(config, &Stop::default()).map_err(|error| error.to_string())?;
        Ok(Self { task: config.task.clone(), model })
    }

    /// Predicted normalised positions of the ball when `actions` are taken from a state.
    pub(super) fn path(&self, start: &Snapshot, actions: Vec<Action>) -> Vec<[f32; 2]> {
        // A model that cannot predict the state shows no path.
        let rollouts = self.model.rollouts(&[start], &[actions], &Stop::default()).unwrap_or_default();
        rollouts.into_iter().next().map_or_else(Vec::new, |rollout| rollout.path)
    }
}
