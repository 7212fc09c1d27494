//! The action prior of a run's configuration.

use crate::guidance::{self, ActionPrior, RolloutModel, TruePhysics};
use crate::task::Task;

use super::config::{PriorSource, RunConfig};

/// Why there is no action prior.
#[derive(Debug, thiserror::Error)]
pub enum PriorError {
    /// The dynamics model cannot be used.
    #[error("the model `{name}` cannot be used: {reason}")]
    Model { name: String, reason: String },
}

/// A rollout model and its name, as a prior records it.
pub type NamedModel = (Box<dyn RolloutModel>, String);

/// What predicts the rollouts of a task: a dynamics model or the true physics, and its
/// name. None for no prediction at all.
///
/// # Errors
/// When the model cannot be loaded or does not know the task's tools.
pub fn rollout_model(source: &PriorSource, task: &Task) -> Result<Option<NamedModel>, PriorError> {
    let unavailable =
        |name: &str| PriorError::Model { name: name.to_owned(), reason: format!("no model for {:?}", task.tool_set()) };
    match source {
        PriorSource::Uniform => Ok(None),
        PriorSource::TruePhysics => Ok(Some((Box::new(TruePhysics), "true physics".to_owned()))),
        PriorSource::Learned => Err(unavailable("learned")),
        PriorSource::ModelFile(path) => Err(unavailable(path)),
    }
}

/// Builds the prior of a configuration; `progress` sees each stage's number and may
/// return false to stop, which gives none.
///
/// # Errors
/// When the dynamics model cannot be used.
pub fn build_prior(config: &RunConfig, progress: impl FnMut(usize) -> bool) -> Result<Option<ActionPrior>, PriorError> {
    let Some((model, name)) = rollout_model(&config.prior, &config.task)? else {
        return Ok(Some(ActionPrior::uniform(&config.task, config.seed)));
    };
    Ok(guidance::build(&config.task, &*model, &name, &config.guidance, config.seed, progress))
}
