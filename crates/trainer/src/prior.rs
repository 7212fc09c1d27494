//! The action prior of a run's configuration.

use std::sync::Arc;

use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, DynamicsError};
use mge_guidance::{
    self as guidance, ActionPrior, GuidanceError, InterruptibleModel, RapierPhysics, RolloutModel, ToolModel,
    TruePhysics,
};
use mge_physics::{Tool, ToolSplit, catalogue_tool};
use mge_run::{RunDirectory, RunError};
use mge_task::Task;

use super::config::RunConfig;
use super::method::PriorSource;

/// Why there is no action prior.
#[derive(Debug, thiserror::Error)]
pub enum PriorError {
    /// The dynamics model cannot be used.
    #[error(transparent)]
    Model(#[from] DynamicsError),
    /// No shipped model supports the task's tools.
    #[error(
        "no shipped dynamics model knows the tools {tools}: train one with `mge dynamics train --tools {tools} --out FILE` and name its file as the model"
    )]
    NoModel { tools: String },
    /// The method needs predictions, but the source of rollouts is `uniform`.
    #[error("the method {method} needs a model to predict with, but the source of rollouts is `uniform`")]
    NoPrediction { method: &'static str },
    /// A prediction is asked for, but the source of rollouts is `uniform`.
    #[error("`uniform` predicts nothing: use learned, rapier, true, or a model file")]
    PredictsNothing,
    /// Neither the shipped models nor rapier predict the effects of CREATE's tools.
    #[error(
        "neither the shipped models nor rapier predict CREATE's tools: use `true`, or train a model with `mge dynamics train --tools create --out FILE` and name its file"
    )]
    NoTools,
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

/// The predictor of rollouts of an agent that chooses among these tools: the true physics, or a dynamics model from a
/// file. `None` for [`PriorSource::Uniform`].
///
/// # Errors
/// When the source makes no such predictions, or the model cannot be loaded or does not support the task or these
/// tools.
fn tool_model(source: &PriorSource, task: &Task, tools: ToolSplit) -> Result<Option<Arc<dyn ToolModel>>, PriorError> {
    let file = match source {
        PriorSource::Uniform => return Ok(None),
        PriorSource::TruePhysics => return Ok(Some(Arc::new(TruePhysics))),
        PriorSource::Learned | PriorSource::Rapier => return Err(PriorError::NoTools),
        PriorSource::ModelFile(file) => file,
    };
    let model = file.load()?;
    model.check_task(task)?;
    let chosen: Vec<Tool> = tools.tools().into_iter().filter_map(catalogue_tool).copied().collect();
    model.check_tools(task, &chosen)?;
    Ok(Some(model))
}

/// Builds the prior of a configuration. `progress` is called with each stage's index.
///
/// # Errors
/// When the dynamics model cannot be used; soon after a request of `stop`, one that
/// [says so](PriorError::is_stopped).
pub fn build_prior(config: &RunConfig, progress: impl FnMut(usize), stop: &Stop) -> Result<ActionPrior, PriorError> {
    let uniform = || ActionPrior::uniform(&config.task, &config.guidance, config.seed);
    if let Some(tools) = config.tools {
        let Some(model) = tool_model(&config.rollout_source(), &config.task, tools)? else {
            return Ok(uniform());
        };
        let RunConfig { task, guidance, seed, .. } = config;
        return Ok(guidance::build_with_tools(task, tools, &*model, guidance, *seed, progress, stop)?);
    }
    let Some(model) = rollout_model(&config.rollout_source(), &config.task)? else { return Ok(uniform()) };
    let model = InterruptibleModel::new(&*model, stop);
    Ok(guidance::build(&config.task, &model, &config.guidance, config.seed, progress)?)
}

/// Builds the priors of a run, one for each task; none if it is not guided. `progress` is called with the number of
/// each stage and the number of all stages.
///
/// # Errors
/// As [`build_prior`]: priors are never incomplete.
pub(super) fn build_priors(
    config: &RunConfig,
    progress: impl Fn(usize, usize),
    stop: &Stop,
) -> Result<Vec<Arc<ActionPrior>>, PriorError> {
    let mut priors = Vec::new();
    if !config.is_guided() {
        return Ok(priors);
    }
    let (mut before, stages) = (0, config.tasks().map(|task| task.stage_count()).sum());
    for task in config.tasks() {
        priors.push(Arc::new(build_prior(&config.on(task), |stage| progress(before + stage, stages), stop)?));
        before += task.stage_count();
    }
    Ok(priors)
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
    consulted_model(config)?;
    if !config.is_guided() {
        return Ok(());
    }
    config.tasks().try_for_each(|task| check_rollouts(&config.on(task)))
}

/// Checks that the rollouts for a run's clusters can be predicted.
fn check_rollouts(config: &RunConfig) -> Result<(), PriorError> {
    let source = config.rollout_source();
    match config.tools {
        Some(tools) => tool_model(&source, &config.task, tools).map(drop),
        None => rollout_model(&source, &config.task).map(drop),
    }
}

/// The model that a method consults during episodes, if it does.
///
/// # Errors
/// When the model cannot be loaded or does not support the task, or the source of rollouts is `uniform`.
pub(super) fn consulted_model(config: &RunConfig) -> Result<Option<Arc<dyn RolloutModel>>, PriorError> {
    if !config.method.consults_model() {
        return Ok(None);
    }
    let model = rollout_model(&config.rollout_source(), &config.task)?;
    model.map(Some).ok_or(PriorError::NoPrediction { method: config.method.name() })
}
