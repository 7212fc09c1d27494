//! The action prior of a run's configuration.

use std::sync::Arc;

use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, DynamicsError};
use mge_guidance::{self as guidance, ActionPrior, GuidanceError, RapierPhysics, RolloutModel, TruePhysics};
use mge_run::{RunDirectory, RunError};
use mge_task::Task;

use super::config::RunConfig;
use super::method::{Method, PriorSource};
use super::watch::Phase;

/// Why there is no action prior.
#[derive(Debug, thiserror::Error)]
pub enum PriorError {
    /// The dynamics model cannot be used.
    #[error(transparent)]
    Model(#[from] DynamicsError),
    /// There is no model that could predict, for the reason that the text gives.
    #[error("{0}")]
    NoModel(String),
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

/// The predictor of a run's rollouts, from the source that is chosen in its configuration: a dynamics model, rapier or
/// the true physics. `None` for [`PriorSource::Uniform`]. A model that has to be trained for it calls `on_phase` after
/// every epoch.
///
/// # Errors
/// When the model cannot be loaded or does not support the task; soon after a request of `stop`, one that
/// [says so](PriorError::is_stopped).
pub fn rollout_model(
    config: &RunConfig,
    on_phase: impl FnMut(Phase),
    stop: &Stop,
) -> Result<Option<Arc<dyn RolloutModel>>, PriorError> {
    model_of(&config.prior, config, on_phase, stop)
}

/// The predictor of a source of rollouts, for the task, seed and model settings of a configuration. A run uses its
/// [`RunConfig::rollout_source`], which its method may determine.
///
/// # Errors
/// As [`rollout_model`].
pub(super) fn model_of(
    source: &PriorSource,
    config: &RunConfig,
    mut on_phase: impl FnMut(Phase),
    stop: &Stop,
) -> Result<Option<Arc<dyn RolloutModel>>, PriorError> {
    let task = &*config.task;
    let model = match source {
        PriorSource::Uniform => return Ok(None),
        PriorSource::Rapier => return Ok(Some(Arc::new(RapierPhysics))),
        PriorSource::TruePhysics => return Ok(Some(Arc::new(TruePhysics))),
        PriorSource::Learned => {
            let tools = task.tool_set();
            let names = || tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
            dynamics::shipped_for(&tools).ok_or_else(|| {
                let remedy = "use the model `trained`, which is trained for them";
                PriorError::NoModel(format!("no shipped dynamics model knows the tools {}: {remedy}", names()))
            })?
        }
        PriorSource::ModelFile(file) => file.load()?,
        PriorSource::Trained(own) => {
            let recipe = config.recipe();
            recipe.check_task(task)?;
            match own.copied(&recipe)? {
                Some(copy) => Arc::new(copy),
                None => recipe.model(stop, |now| on_phase(Phase::of_model(now)))?,
            }
        }
    };
    model.check_task(task)?;
    Ok(Some(model))
}

/// As [`rollout_model`], for work that needs predictions.
///
/// # Errors
/// As [`rollout_model`]; [`PriorError::NoModel`] if there is none.
pub fn required_model(config: &RunConfig, stop: &Stop) -> Result<Arc<dyn RolloutModel>, PriorError> {
    let nothing = "`uniform` predicts nothing: use trained, learned, rapier, true, or a model file";
    rollout_model(config, |_| (), stop)?.ok_or_else(|| PriorError::NoModel(nothing.to_owned()))
}

/// Builds the prior of a configuration. `on_phase` is called before each stage, and while a model is trained.
///
/// # Errors
/// When the dynamics model cannot be used; soon after a request of `stop`, one that
/// [says so](PriorError::is_stopped).
pub fn build_prior(
    config: &RunConfig,
    mut on_phase: impl FnMut(Phase),
    stop: &Stop,
) -> Result<ActionPrior, PriorError> {
    let Some(model) = model_of(&config.rollout_source(), config, &mut on_phase, stop)? else {
        return Ok(ActionPrior::uniform(&config.task, &config.guidance, config.seed));
    };
    let stages = config.task.stage_count();
    let on_stage = |stage| on_phase(Phase::BuildingPrior { stage, stages });
    Ok(guidance::build(&config.task, &*model, &config.guidance, config.seed, stop, on_stage)?)
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

/// Checks that the models that a run needs are available. A model that is trained for the run is not trained yet.
///
/// # Errors
/// As [`rollout_model`], and when the method needs predictions but the source of rollouts is `uniform`.
pub fn check_model(config: &RunConfig) -> Result<(), PriorError> {
    let is_planned = config.method == Method::Planning;
    match config.rollout_source() {
        _ if !is_planned && !config.is_guided() => Ok(()),
        PriorSource::Trained(_) => Ok(config.recipe().check_task(&config.task)?),
        _ if is_planned => planning_model(config).map(drop),
        _ => model_of(&config.rollout_source(), config, |_| (), &Stop::default()).map(drop),
    }
}

/// The model through which a run plans.
///
/// # Errors
/// When the model cannot be loaded or does not support the task, or the source of rollouts is `uniform`.
pub(super) fn planning_model(config: &RunConfig) -> Result<Arc<dyn RolloutModel>, PriorError> {
    let model = model_of(&config.rollout_source(), config, |_| (), &Stop::default())?;
    model.ok_or_else(|| {
        let method = config.method;
        let what =
            format!("the method {method} needs a model to predict with, but the source of rollouts is `uniform`");
        PriorError::NoModel(what)
    })
}
