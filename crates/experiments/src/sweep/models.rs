//! The dynamics models of a sweep (paper, table 1): each is trained and evaluated in its folder.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::WorkError;
use super::file::{Combination, Grid};
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::stop::Stop;
use mge_base::validation::ValidationError;
use mge_dynamics::{
    DynamicsError, EvaluationConfig, LaunchErrors, ModelConfig, Progress, ToolSet, TrainConfig, TrainedModel,
    TrainingOutcome, canonical_tool_set, evaluate, model_name, train_to_file,
};
use mge_physics::ToolKind;
use mge_run::{RunDirectory, RunError, read_optional};
use mge_task as task;
use mge_trainer::batch::JobHandle;

pub(super) const MODEL: &str = "model.safetensors";
pub(super) const RESULT: &str = "result.json";

/// A dynamics model to train and evaluate: the content of `config.json` in its folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelJob {
    /// Tool set, in canonical order.
    pub tools: Vec<ToolKind>,
    /// Structure, inputs and targets.
    pub model: ModelConfig,
    /// Training.
    pub training: TrainConfig,
    /// Evaluation.
    pub evaluation: EvaluationConfig,
}

/// The results of a model: the content of `result.json` in its folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelResult {
    /// Number of epochs trained.
    pub epochs: u32,
    /// Why the training diverged, if it did; the errors are then those of the model of the previous
    /// epoch.
    pub diverged: Option<String>,
    /// Mean loss of the last epoch, on normalised outputs; None if no epoch was completed.
    pub train_loss: Option<f32>,
    /// Final mean loss on the validation launches.
    pub validation_loss: f32,
    /// Mean error after one action on fresh launches, normalised.
    pub action_error: f64,
    /// Mean error of one prediction on fresh launches, normalised.
    pub one_step_error: f64,
    /// Mean errors after 1, 2, ... actions in unseen scenes of the tasks, normalised.
    pub rollout_error: Vec<f64>,
}

impl ModelJob {
    /// The job of a combination of settings.
    pub(super) fn new(grid: &Grid, combination: &Combination) -> Result<Self, ValidationError> {
        let mut job = Self {
            tools: Vec::new(),
            model: ModelConfig::default(),
            training: TrainConfig::default(),
            evaluation: EvaluationConfig::default(),
        };
        let chosen = || grid.axes.iter().zip(combination).map(|(axis, &value)| (axis, &axis.values[value], value));
        // `literal` and `tools` select the defaults that the other settings change, whatever their positions.
        if let Some((axis, literal, number)) = chosen().find(|(axis, _, _)| axis.key == "literal") {
            let wrong = || ValidationError::new(axis.path(number), "must be true or false");
            if literal.as_bool().ok_or_else(wrong)? {
                (job.model, job.training) = (ModelConfig::literal(), TrainConfig::literal());
            }
        }
        if let Some((axis, tools, number)) = chosen().find(|(axis, _, _)| axis.key == "tools") {
            let wrong = |message: String| ValidationError::new(axis.path(number), message);
            let set: ToolSet = json::text(tools).parse().map_err(wrong)?;
            job.tools = canonical_tool_set(set.kinds()).map_err(|error| wrong(error.to_string()))?;
            job.model = set.apply(job.model);
        }
        let is_default = |key: &str| ["literal", "tools"].contains(&key);
        for (axis, value, number) in chosen().filter(|(axis, _, _)| !is_default(&axis.key)) {
            let wrong = |message: String| ValidationError::new(axis.path(number), message);
            job = job.with_setting(&axis.key, value).map_err(wrong)?;
        }
        if job.tools.is_empty() {
            return Err(ValidationError::new("tools", "is missing: name a tool set, such as \"box,bucket\""));
        }
        let wrong = |error: DynamicsError| match error {
            DynamicsError::Config(error) => error,
            error => ValidationError::new(".", error),
        };
        job.model.validate().map_err(wrong)?;
        job.training.validate().map_err(wrong)?;
        job.evaluation.validate().map_err(wrong)?;
        Ok(job)
    }

    fn with_setting(&self, key: &str, value: &Value) -> Result<Self, String> {
        // Plain data always serialises.
        let mut whole = serde_json::to_value(self).expect("settings are plain data");
        let keys: Vec<String> = json::leaves(&whole).into_iter().map(|(path, _)| path).collect();
        let known = |path: &String| path != "tools" && short(path) == key;
        let Some(place) = keys.iter().find(|path| known(path)).and_then(|path| json::at_mut(&mut whole, path)) else {
            let names: Vec<&str> = keys.iter().map(|path| short(path)).collect();
            let hint = did_you_mean(names.into_iter().chain(["literal", "kind"]), key);
            return Err(format!("there is no setting `{key}` of a dynamics model{hint}"));
        };
        *place = value.clone();
        serde_json::from_value(whole).map_err(|error| format!("cannot be `{}`: {error}", json::text(value)))
    }

    /// The prefix of its name.
    pub(super) fn base_name(&self) -> String {
        model_name(&self.model, &self.tools)
    }

    /// Number of epochs to train.
    pub(super) fn epochs(&self) -> u64 {
        u64::from(self.training.epochs)
    }

    /// Trains and evaluates the model in `folder`, or does the missing part of it. None if it was stopped
    /// before the end.
    pub(super) fn run(&self, folder: &Path, command: &str, handle: &JobHandle) -> Result<Option<()>, WorkError> {
        let directory = RunDirectory::open_or_create(folder, self)?;
        let file = folder.join(RESULT);
        let is_finished = || match read_optional(&file)? {
            Some(bytes) => Ok(json::parse::<ModelResult>(&bytes, &file.display().to_string()).map(|_| true)?),
            None => Ok::<_, WorkError>(false),
        };
        if is_finished()? {
            return Ok(Some(()));
        }
        let _lock = directory.lock()?;
        // Another process may have finished it meanwhile.
        if is_finished()? {
            return Ok(Some(()));
        }
        let (path, model, training) = (folder.join(MODEL), self.model.clone(), self.training.clone());
        let on_progress = |now: &Progress| handle.set_done(u64::from(now.epoch));
        let trained = train_to_file(&path, model, training, &self.tools, command, handle.stop(), on_progress)?;
        if trained.ended == TrainingOutcome::Stopped {
            return Ok(None);
        }
        if trained.divergence().is_some() {
            trained.model().save(&path)?;
        }
        let result = self.result(&trained, handle.stop())?;
        mge_base::atomic::write(&file, json::pretty(&result).as_bytes()).map_err(RunError::io("write", &file))?;
        trained.remove_checkpoint();
        Ok(Some(()))
    }

    /// Evaluates the model.
    fn result(&self, trained: &TrainedModel, stop: &Stop) -> Result<ModelResult, WorkError> {
        let evaluation = evaluate(trained.model(), &task::shipped(), &self.evaluation, stop, &mut |_| ())?;
        let (one_step_error, rollout_error) = evaluation.mean_errors();
        let after_an_action = |tool: &LaunchErrors| tool.errors.model.rollout.last().map(|e| e.mean);
        let actions: Vec<f64> = evaluation.launches.iter().filter_map(after_an_action).collect();
        Ok(ModelResult {
            epochs: trained.training.epoch(),
            diverged: trained.divergence(),
            train_loss: trained.train_loss,
            validation_loss: trained.training.validation_loss(),
            action_error: actions.iter().sum::<f64>() / actions.len().max(1) as f64,
            one_step_error,
            rollout_error,
        })
    }
}

/// The name of a model's setting in a sweep file, given its JSON path.
pub(super) fn short(path: &str) -> &str {
    path.trim_start_matches("model.").trim_start_matches("training.")
}
