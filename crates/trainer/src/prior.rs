//! The action prior of a run's configuration.

use std::sync::Arc;

use mge_base::stop::Stop;
use mge_dynamics as dynamics;
use mge_guidance::{self as guidance, ActionPrior, RapierPhysics, RolloutModel, TruePhysics};
use mge_run::RunDirectory;
use mge_task::Task;

use super::config::RunConfig;
use super::error::{Result, TrainerError};
use super::method::{Method, PriorSource};
use super::watch::Phase;

/// The predictor of a source of rollouts, for the task, seed and model settings of a configuration: a dynamics model,
/// rapier or the true physics; none for [`PriorSource::Uniform`]. A run uses its [`RunConfig::rollout_source`], which its
/// method may determine. A model that has to be trained calls `on_phase` after every epoch.
///
/// # Errors
/// When the model cannot be loaded or does not support the task; [`TrainerError::Stopped`] soon after a request of `stop`.
pub fn rollout_model(
    source: &PriorSource,
    config: &RunConfig,
    mut on_phase: impl FnMut(Phase),
    stop: &Stop,
) -> Result<Option<Arc<dyn RolloutModel>>> {
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
                TrainerError::Refused(format!("no shipped dynamics model knows the tools {}: {remedy}", names()))
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
/// As [`rollout_model`], and when there is none.
pub fn required_model(config: &RunConfig, stop: &Stop) -> Result<Arc<dyn RolloutModel>> {
    let nothing = "`uniform` predicts nothing: use trained, learned, rapier, true, or a model file";
    rollout_model(&config.prior, config, |_| (), stop)?.ok_or_else(|| TrainerError::Refused(nothing.to_owned()))
}

/// Builds the prior of a configuration. `on_phase` is called before each stage, and while a model is trained.
///
/// # Errors
/// When the dynamics model cannot be used; [`TrainerError::Stopped`] soon after a request of `stop`.
pub fn build_prior(config: &RunConfig, mut on_phase: impl FnMut(Phase), stop: &Stop) -> Result<ActionPrior> {
    let Some(model) = rollout_model(&config.rollout_source(), config, &mut on_phase, stop)? else {
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
pub fn saved_prior(directory: &RunDirectory, task: &Task) -> Result<Option<ActionPrior>> {
    let origin = directory.prior_path().display().to_string();
    let text = directory.read_prior()?;
    Ok(text.map(|text| ActionPrior::parse(&text, &origin, task)).transpose()?)
}

/// Checks that the models that a run needs are available. A model that is trained for the run is not trained yet.
///
/// # Errors
/// As [`rollout_model`], and when the method needs predictions but the source of rollouts is `uniform`.
pub fn check_model(config: &RunConfig) -> Result<()> {
    let is_planned = config.method == Method::Planning;
    match config.rollout_source() {
        _ if !is_planned && !config.is_guided() => Ok(()),
        PriorSource::Trained(_) => Ok(config.recipe().check_task(&config.task)?),
        _ if is_planned => required_model(config, &Stop::default()).map(drop),
        _ => rollout_model(&config.rollout_source(), config, |_| (), &Stop::default()).map(drop),
    }
}
