//! Dynamics models, trained and measured.

use std::path::{Path, PathBuf};

use super::command::{Command, ModelEvaluate, ModelTrain};
use super::job::{Progress, Reporter};
use super::{Session, SessionError, create_parent, write_file};
use crate::dynamics::{
    self, Ended, Evaluation, EvaluationConfig, EvaluationProgress, Model, ModelConfig, TrainConfig,
    evaluate_with_progress, train_to_file,
};
use crate::task;

/// The folder for models that are trained here.
pub const MODELS: &str = "models";

fn is_model_work(command: &Command) -> bool {
    matches!(command, Command::ModelTrain(_) | Command::ModelEvaluate(_))
}

fn name(command: &Command) -> String {
    match command {
        Command::ModelTrain(train) => format!("training {}", train.path.display()),
        Command::ModelEvaluate(ModelEvaluate(model)) => format!("measuring {model}"),
        other => other.to_string(),
    }
}

impl Session {
    /// Begins to train a model into a file.
    pub(super) fn train_model(&mut self, command: &ModelTrain) -> Result<String, SessionError> {
        let (seed, train) = (self.config().seed, command.clone());
        self.begin_model_work(command.clone().into(), move |reporter| train_into_file(&train, seed, reporter))
    }

    /// Begins to measure a shipped model or one in a file.
    pub(super) fn evaluate_model(&mut self, command: &ModelEvaluate) -> Result<String, SessionError> {
        let (seed, model) = (self.config().seed, command.0.clone());
        self.begin_model_work(command.clone().into(), move |reporter| evaluate(&model, seed, reporter))
    }

    /// One at a time: each of them keeps all cores busy.
    fn begin_model_work(
        &mut self,
        command: Command,
        work: impl FnOnce(&Reporter) -> Result<String, String> + Send + 'static,
    ) -> Result<String, SessionError> {
        if let Some((name, _)) = self.model_work() {
            return Err(SessionError::Failed(format!("{name}: wait for its end, or end it with `model stop`")));
        }
        let report = name(&command);
        self.begin_job(command, work, |_, result| result);
        Ok(report)
    }

    /// Ends what is being done about a dynamics model.
    pub(super) fn stop_model_work(&mut self) -> Result<String, SessionError> {
        let Some((name, _)) = self.model_work() else {
            return Err(SessionError::Failed("no dynamics model is being trained or measured".to_owned()));
        };
        self.cancel_jobs(is_model_work);
        Ok(format!("ended: {name}"))
    }

    /// What is being done about a dynamics model, and how much of it is done.
    pub fn model_work(&self) -> Option<(String, Progress)> {
        self.job(is_model_work).map(|pending| (name(&pending.command), pending.job.progress()))
    }

    /// Losses of the model that is being trained, one an epoch, from the epoch of this number on; none of one that is
    /// measured.
    pub fn model_losses(&self, from: usize) -> Vec<f32> {
        self.job(is_model_work).map_or_else(Vec::new, |pending| pending.job.values(from))
    }
}

/// The evaluation of a model that is kept in a file, if it is one of this model.
pub fn kept_evaluation(name: &str, model: &Model) -> Option<Evaluation> {
    let text = crate::bounded::read_text(&evaluation_of(name)).ok()?;
    let evaluation: Evaluation = serde_json::from_str(&text).ok()?;
    (evaluation.data_hash == model.provenance().data_hash).then_some(evaluation)
}

/// Where the evaluation of a model is kept: beside its file, or in the folder of models if it is a shipped one.
fn evaluation_of(name: &str) -> PathBuf {
    let beside = format!("{name}.evaluation.json");
    if dynamics::shipped(name).is_some() { Path::new(MODELS).join(beside) } else { beside.into() }
}

fn train_into_file(train: &ModelTrain, seed: u64, reporter: &Reporter) -> Result<String, String> {
    let ModelTrain { tools, path, epochs } = train;
    let mut settings = TrainConfig { seed, ..TrainConfig::default() };
    settings.epochs = epochs.unwrap_or(settings.epochs);
    let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let command = format!("mge dynamics train --tools {tools} --seed {seed} --epochs {} --out {file}", settings.epochs);
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    create_parent(path).map_err(|error| error.to_string())?;
    let on_progress = |now: &dynamics::Progress| {
        reporter.note(now.loss);
        reporter.progress(now.epoch as usize, now.epochs as usize)
    };
    let trained =
        train_to_file(path, tools.apply(ModelConfig::default()), settings, tools.kinds(), &command, on_progress)
            .map_err(|error| failed(&error))?;
    if trained.ended == Ended::Stopped {
        return Err(failed(&"ended before it was trained; train it again to continue"));
    }
    trained.remove_checkpoint();
    if let Some(reason) = trained.divergence() {
        return Err(failed(&reason));
    }
    Ok(format!("trained {}: validation loss {:.5}", path.display(), trained.training.validation_loss()))
}

fn evaluate(name: &str, seed: u64, reporter: &Reporter) -> Result<String, String> {
    let model = dynamics::named(name).map_err(|error| error.to_string())?;
    let tasks: Vec<_> = task::shipped().into_iter().filter(|task| model.check_task(task).is_ok()).collect();
    let config = EvaluationConfig { seed, ..EvaluationConfig::default() };
    let on_progress = &mut |now: &EvaluationProgress| reporter.progress(now.done, now.total);
    let evaluation = evaluate_with_progress(&model, &tasks, &config, on_progress)
        .map_err(|error| error.to_string())?
        .ok_or_else(|| format!("{name}: ended before it was measured"))?;
    let launches = evaluation.launches.iter().map(|launches| {
        let (ours, still) = (&launches.errors.model.one_step, &launches.errors.constant_velocity.one_step);
        format!("{} {:.4} ({:.4})", launches.tool, ours.mean, still.mean)
    });
    // Plain data always serialises.
    let json = serde_json::to_string_pretty(&evaluation).expect("an evaluation is plain data") + "\n";
    let path = evaluation_of(name);
    write_file(&path, json.as_bytes()).map_err(|error| error.to_string())?;
    let scenes = evaluation.scenes.iter().filter_map(|scene| {
        let hits = &scene.rollout.model.first()?;
        Some(format!("{} {:.4}", scene.task, hits.mean))
    });
    Ok(format!(
        "{name}: error after one prediction (constant velocity): {}; after one action: {}; kept in {}",
        launches.collect::<Vec<_>>().join(", "),
        scenes.collect::<Vec<_>>().join(", "),
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::Script;

    fn run(lines: &str) -> Result<Session, String> {
        let mut session = Session::new(task::load("task1").unwrap(), "runs".into());
        let script = Script::parse(lines, "s", &[]).unwrap();
        script.run(&mut session, |_| {}).map(|()| session).map_err(|error| error.to_string())
    }

    #[test]
    fn a_model_is_trained_into_a_new_folder_and_can_be_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("models/mine.safetensors");
        let line = format!("model train box {} 1\nwait", shell_words::quote(&path.display().to_string()));
        run(&line).unwrap();
        assert!(dynamics::Model::load(&path).is_ok());
    }

    #[test]
    fn what_cannot_be_measured_fails_the_wait_for_it() {
        let error = run("model evaluate nowhere.safetensors\nwait").unwrap_err();
        assert!(error.starts_with("s:2: ") && error.contains("nowhere.safetensors"), "{error}");
    }

    #[test]
    fn what_was_ended_is_not_in_the_recorded_script() {
        let mut session = run("model evaluate bucket-box\nmodel stop").unwrap();
        assert!(!session.to_script().contains("model"), "{}", session.to_script());
        assert!(session.is_idle() && session.apply(crate::workbench::command::ModelStop).is_err());
    }
}
