//! The action prior of a run's configuration.

use std::sync::Arc;

use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, DynamicsError};
use mge_guidance::{self as guidance, ActionPrior, GuidanceError, RapierPhysics, RolloutModel, TruePhysics};
use mge_run::{RunDirectory, RunError};
use mge_task::Task;

use super::config::RunConfig;
use super::method::{Method, PriorSource};

/// Why there is no action prior.
#[derive(Debug, thiserror::Error)]
pub enum PriorError {
    /// The dynamics model cannot be used.
    #[error(transparent)]
    Model(#[from] DynamicsError),
    /// No shipped model supports the task's tools.
    #[error(
        "no shipped dynamics model knows the tools {tools}: train one with `mge dynamics train --tools {tools} --out FILE` and name its file as the model, or use the model `true`, the true physics"
    )]
    NoModel { tools: String },
    /// The method needs predictions, but the source of rollouts is `uniform`.
    #[error("the method {method} needs a model to predict with, but the source of rollouts is `uniform`")]
    NoPrediction { method: &'static str },
    /// A prediction is asked for, but the source of rollouts is `uniform`.
    #[error("`uniform` predicts nothing: use learned, rapier, true, or a model file")]
    PredictsNothing,
    /// The saved prior of a run is invalid or belongs to another task.
    #[error(transparent)]
    Saved(#[from] GuidanceError),
    /// The saved prior of a run cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl PriorError {
    /// Whether the cause is a stop request.
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Model(DynamicsError::Stopped))
    }
}

/// The predictor of a task's rollouts: a dynamics model, rapier or the true physics. `None` for
/// [`PriorSource::Uniform`].
///
/// # Errors
/// When the model cannot be loaded or does not support the task.
pub fn rollout_model(source: &PriorSource, task: &Task) -> Result<Option<Arc<dyn RolloutModel>>, PriorError> {
    let model = match source {
        PriorSource::Uniform => return Ok(None),
        PriorSource::Rapier => return Ok(Some(Arc::new(RapierPhysics))),
        PriorSource::TruePhysics => return Ok(Some(Arc::new(TruePhysics))),
        PriorSource::Learned => {
            let tools = task.tool_set();
            let names = || tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
            dynamics::shipped_for(&tools).ok_or_else(|| PriorError::NoModel { tools: names() })?
        }
        PriorSource::ModelFile(file) => file.load()?,
    };
    model.check_task(task)?;
    Ok(Some(model))
}

/// As [`rollout_model`], for work that needs predictions.
///
/// # Errors
/// As [`rollout_model`]; [`PriorError::PredictsNothing`].
pub fn required_model(source: &PriorSource, task: &Task) -> Result<Arc<dyn RolloutModel>, PriorError> {
    rollout_model(source, task)?.ok_or(PriorError::PredictsNothing)
}

/// Builds the prior of a configuration. `progress` is called with each stage's index.
///
/// # Errors
/// When the dynamics model cannot be used; soon after a request of `stop`, one that
/// [says so](PriorError::is_stopped).
pub fn build_prior(config: &RunConfig, progress: impl FnMut(usize), stop: &Stop) -> Result<ActionPrior, PriorError> {
    let Some(model) = rollout_model(&config.rollout_source(), &config.task)? else {
        return Ok(ActionPrior::uniform(&config.task, &config.guidance, config.seed));
    };
    Ok(guidance::build(&config.task, &*model, &config.guidance, config.seed, stop, progress)?)
}

/// Like [`build_prior`]; none if the run is not guided.
///
/// # Errors
/// As [`build_prior`].
pub(super) fn prior_of_run(
    config: &RunConfig,
    progress: impl FnMut(usize),
    stop: &Stop,
) -> Result<Option<Arc<ActionPrior>>, PriorError> {
    let prior = config.is_guided().then(|| build_prior(config, progress, stop)).transpose()?;
    Ok(prior.map(Arc::new))
}

/// The latest prior of a run on disk; `None` if it never had one.
///
/// # Errors
/// When `prior.json` cannot be read, is not a prior, or belongs to another task.
pub fn saved_prior(directory: &RunDirectory, task: &Task) -> Result<Option<ActionPrior>, PriorError> {
    let origin = directory.prior_path().display().to_string();
    let text = directory.read_prior()?;
    Ok(text.map(|text| ActionPrior::parse(&text, &origin, task)).transpose()?)
}

/// Checks that the models that a run needs are available.
///
/// # Errors
/// As [`rollout_model`], and when the method needs predictions but the source of rollouts is `uniform`.
pub fn check_model(config: &RunConfig) -> Result<(), PriorError> {
    if config.method == Method::Planning {
        planning_model(config)?;
    }
    if config.is_guided() {
        rollout_model(&config.rollout_source(), &config.task)?;
    }
    Ok(())
}

/// The model through which a run plans.
///
/// # Errors
/// When the model cannot be loaded or does not support the task, or the source of rollouts is `uniform`.
pub(super) fn planning_model(config: &RunConfig) -> Result<Arc<dyn RolloutModel>, PriorError> {
    let model = rollout_model(&config.rollout_source(), &config.task)?;
    model.ok_or(PriorError::NoPrediction { method: config.method.name() })
}
