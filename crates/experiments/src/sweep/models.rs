//! The dynamics models of a sweep (paper, table 1): each is trained and evaluated in its folder.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::file::Choice;
use super::work::once;
use crate::error::Result;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::stop::Stop;
use mge_base::validation::ValidationError;
use mge_dynamics::{
    DynamicsError, EvaluationConfig, HitPredictions, ModelConfig, OneTool, Progress, Recipe, ToolSet, TrainConfig,
    Training, canonical_tool_set, evaluate, train_to_file,
};
use mge_physics::ToolKind;
use mge_task as task;
use mge_trainer::batch::JobHandle;

pub(super) const MODEL: &str = "model.safetensors";

/// A dynamics model to train and evaluate: the content of `config.json` in its folder.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// As `one_step_error`, of the predictions in which the ball was deflected. This and what follows is missing in
    /// results of earlier versions.
    pub one_step_contact_error: Option<f64>,
    /// As `action_error`, of the launches in which the ball was deflected.
    pub action_contact_error: Option<f64>,
    /// Share of the predicted hits of the next stage, in these scenes, that were real. None if none was predicted.
    pub precision: Option<f64>,
    /// Share of the real hits of the next stage that were predicted.
    pub recall: Option<f64>,
}

impl ModelJob {
    /// The job of a combination of settings.
    pub(super) fn new(chosen: &[Choice<'_>]) -> Result<Self, ValidationError> {
        let settings: Vec<(&str, Value)> = chosen.iter().map(|choice| (choice.key(), choice.value().clone())).collect();
        Self::of(&settings).map_err(|error| match chosen.iter().find(|choice| choice.key() == error.path) {
            Some(choice) => choice.wrong(error.message),
            None => error,
        })
    }

    /// The job with these settings, by their names in a sweep file.
    ///
    /// # Errors
    /// The name of the setting that does not exist or cannot have its value.
    pub fn of(settings: &[(&str, Value)]) -> Result<Self, ValidationError> {
        let mut job = Self::default();
        let named = |name: &str| settings.iter().find(|(key, _)| *key == name).map(|(_, value)| value);
        // `literal` and `tools` select the defaults that the other settings change, whatever their positions.
        if let Some(literal) = named("literal")
            && literal.as_bool().ok_or_else(|| ValidationError::new("literal", "must be true or false"))?
        {
            (job.model, job.training) = (ModelConfig::literal(), TrainConfig::literal());
        }
        if let Some(tools) = named("tools") {
            let wrong = |message: String| ValidationError::new("tools", message);
            let set: ToolSet = json::text(tools).parse().map_err(wrong)?;
            job.tools = canonical_tool_set(set.kinds()).map_err(|error| wrong(error.to_string()))?;
            job.model = set.apply(job.model);
        }
        for (key, value) in settings.iter().filter(|(key, _)| !["literal", "tools"].contains(key)) {
            job = job.with_setting(key, value).map_err(|message| ValidationError::new(*key, message))?;
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
        let keys: Vec<String> = json::leaf_values(&whole).into_iter().map(|(path, _)| path).collect();
        let known = |path: &String| path != "tools" && short(path) == key;
        let Some(place) = keys.iter().find(|path| known(path)).and_then(|path| json::at_mut(&mut whole, path)) else {
            let names: Vec<&str> = keys.iter().map(|path| short(path)).collect();
            let hint = did_you_mean(names.into_iter().chain(["literal", "kind"]), key);
            return Err(format!("there is no setting `{key}` of a dynamics model{hint}"));
        };
        *place = value.clone();
        serde_json::from_value(whole).map_err(|error| format!("cannot be `{}`: {error}", json::text(value)))
    }

    /// What determines the model.
    pub fn recipe(&self) -> Recipe {
        Recipe { tools: self.tools.clone(), config: self.model.clone(), training: self.training.clone() }
    }

    /// Trains the model into `folder` and evaluates it.
    pub(super) fn run(&self, folder: &Path, command: &str, handle: &JobHandle) -> Result<()> {
        once(folder, || {
            let on_progress = |now: &Progress| handle.set_done(u64::from(now.epoch));
            let trained = train_to_file(&folder.join(MODEL), &self.recipe(), command, handle.stop(), on_progress)?;
            self.result(&trained, handle.stop())
        })
    }

    /// Evaluates the model.
    fn result(&self, trained: &Training, stop: &Stop) -> Result<ModelResult> {
        let evaluation = evaluate(&trained.model, &task::shipped(), &self.evaluation, stop, &mut |_, _, _| ())?;
        let (one_step_error, rollout_error) = evaluation.mean_errors();
        let of_launches =
            |of: fn(&OneTool) -> Option<f64>| evaluation.launches.iter().filter_map(move |tool| of(&tool.errors.model));
        let of_scenes = |of: fn(&HitPredictions) -> Option<f64>| {
            evaluation.scenes.iter().filter_map(move |scene| of(&scene.hits.model))
        };
        let actions = of_launches(|tool| tool.rollout.last().map(|errors| errors.mean));
        Ok(ModelResult {
            epochs: trained.epoch(),
            diverged: trained.diverged.clone(),
            train_loss: trained.model.provenance.losses.map(|[train, _]| train),
            validation_loss: trained.validation_loss(),
            action_error: mean(actions).unwrap_or(0.0),
            one_step_error,
            rollout_error,
            one_step_contact_error: mean(of_launches(|tool| Some(tool.one_step_contact.mean))),
            action_contact_error: mean(of_launches(|tool| Some(tool.action_contact.mean))),
            precision: mean(of_scenes(|hits| hits.precision)),
            recall: mean(of_scenes(|hits| hits.recall)),
        })
    }
}

/// The mean; none without values.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The name of a model's setting in a sweep file, given its JSON path.
pub(super) fn short(path: &str) -> &str {
    path.trim_start_matches("model.").trim_start_matches("training.")
}
