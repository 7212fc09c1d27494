//! Training and evaluation of dynamics models in the session.

use std::path::{Path, PathBuf};

use super::command::{Command, ModelEvaluate, ModelTrain};
use super::job::{Progress, Reporter};
use super::{Session, SessionError, write_file};
use mge_base::atomic::{Format, Target};
use mge_base::json;
use mge_dynamics::{self as dynamics, DynamicsError, Evaluation, EvaluationConfig, Model, train_to_file};
use mge_experiments::sweep::ModelJob;
use mge_run::RunError;
use mge_task as task;

/// The format of saved evaluations.
const EVALUATION: Format<'static> =
    Format { name: "the evaluation of a model", is: &|found| serde_json::from_slice::<Evaluation>(found).is_ok() };

/// The folder for models trained in the workbench.
pub const MODELS: &str = "models";

fn is_model_work(command: &Command) -> bool {
    matches!(command, Command::ModelTrain(_) | Command::ModelEvaluate(_))
}

fn name(command: &Command) -> String {
    match command {
        Command::ModelTrain(train) => format!("training {}", train.to.path.display()),
        Command::ModelEvaluate(ModelEvaluate(model)) => format!("evaluating {model}"),
        other => other.to_string(),
    }
}

impl Session {
    /// Starts training a model, written to a file.
    pub(super) fn train_model(&mut self, command: &ModelTrain) -> Result<String, SessionError> {
        let ModelTrain { tools, to, epochs, settings } = command.clone();
        let (tools, seed) = (tools.to_string(), self.config().seed.to_string());
        let epochs = epochs.iter().map(|epochs| ("epochs".to_owned(), epochs.to_string()));
        let settings: Vec<(String, String)> = epochs.chain(settings).collect();
        let own = settings.iter().map(|(key, value)| (key.as_str(), value));
        let all = [("tools", &tools), ("seed", &seed)].into_iter().chain(own);
        let job = ModelJob::of(&all.map(|(key, text)| (key, json::value_of(text))).collect::<Vec<_>>())?;
        let set = settings.iter().flat_map(|(key, value)| ["--set".to_owned(), format!("{key}={value}")]);
        let file = to.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let words = ["mge", "dynamics", "train", "--tools", &tools, "--seed", &seed].map(str::to_owned).into_iter();
        let made_by = shell_words::join(words.chain(set).chain(["--out".to_owned(), file]));
        self.start_model_job(command.clone().into(), move |reporter| train_into_file(job, &to, &made_by, reporter))
    }

    /// Starts evaluating a model, shipped or from a file.
    pub(super) fn evaluate_model(&mut self, command: &ModelEvaluate) -> Result<String, SessionError> {
        let (seed, model) = (self.config().seed, command.0.clone());
        self.start_model_job(command.clone().into(), move |reporter| evaluate(&model, seed, reporter))
    }

    /// Starts a job on a model. Only one runs at a time, as each keeps all cores busy.
    fn start_model_job(
        &mut self,
        command: Command,
        work: impl FnOnce(&Reporter) -> Result<String, String> + Send + 'static,
    ) -> Result<String, SessionError> {
        if let Some((name, _)) = self.model_work() {
            return Err(SessionError::Failed(format!("{name}: wait for its end, or end it with `model stop`")));
        }
        let report = name(&command);
        self.start_job(command, work, |_, result| result);
        Ok(report)
    }

    /// Cancels the training or evaluation of a model.
    pub(super) fn stop_model_work(&mut self) -> Result<String, SessionError> {
        let Some((name, _)) = self.model_work() else {
            return Err(SessionError::Failed("no dynamics model is being trained or evaluated".to_owned()));
        };
        self.cancel_jobs(is_model_work);
        Ok(format!("ended: {name}"))
    }

    /// The name and progress of the current training or evaluation of a model.
    pub fn model_work(&self) -> Option<(String, Progress)> {
        self.job(is_model_work).map(|pending| (name(&pending.command), pending.job.progress()))
    }
}

/// The saved evaluation of a model, if it is of this very model.
pub fn saved_evaluation(name: &str, model: &Model) -> Option<Evaluation> {
    let text = mge_base::bounded::read_text(&evaluation_of(name)).ok()?;
    let evaluation: Evaluation = serde_json::from_str(&text).ok()?;
    (evaluation.model_sha256 == model.id().sha256).then_some(evaluation)
}

/// Where the evaluation of a model is saved: beside its file, or in [`MODELS`] for a shipped model.
fn evaluation_of(name: &str) -> PathBuf {
    let beside = format!("{name}.evaluation.json");
    if dynamics::shipped(name).is_some() { Path::new(MODELS).join(beside) } else { beside.into() }
}

fn train_into_file(job: ModelJob, to: &Target, made_by: &str, reporter: &Reporter) -> Result<String, String> {
    let path = &to.path;
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let on_progress = |now: &dynamics::Progress| _ = reporter.progress(now.epoch as usize, now.epochs as usize);
    let trained = train_to_file(to, job.model, job.training, &job.tools, made_by, reporter.stop(), on_progress)
        .map_err(|error| match error {
            DynamicsError::Stopped => failed(&"stopped: the same command starts again"),
            error => failed(&error),
        })?;
    if let Some(reason) = trained.diverged {
        return Err(failed(&format!("{reason}; the model is that of the epoch before")));
    }
    Ok(format!("trained {}: validation loss {:.5}", path.display(), trained.training.validation_loss()))
}

fn evaluate(name: &str, seed: u64, reporter: &Reporter) -> Result<String, String> {
    let to = Target::from(&evaluation_of(name));
    // Refused before the work.
    to.check(&EVALUATION).map_err(|error| RunError::io("write", &to.path)(error).to_string())?;
    let model = dynamics::named(name, None).map_err(|error| error.to_string())?;
    let config = EvaluationConfig { seed, ..EvaluationConfig::default() };
    let on_progress = &mut |done, total, _: &str| _ = reporter.progress(done, total);
    let evaluation = dynamics::evaluate(&model, &task::shipped(), &config, reporter.stop(), on_progress)
        .map_err(|error| format!("{name}: {error}"))?;
    let launches = evaluation.launches.iter().map(|launches| {
        let (model, baseline) = (&launches.errors.model.one_step, &launches.errors.constant_velocity.one_step);
        format!("{} {:.4} ({:.4})", launches.tool, model.mean, baseline.mean)
    });
    write_file(&to, json::pretty(&evaluation).as_bytes(), &EVALUATION).map_err(|error| error.to_string())?;
    let scenes = evaluation.scenes.iter().filter_map(|scene| {
        let error = &scene.rollout.model.first()?;
        Some(format!("{} {:.4}", scene.task, error.mean))
    });
    Ok(format!(
        "{name}: error after one prediction (constant velocity): {}; after one action: {}; saved to {}",
        launches.collect::<Vec<_>>().join(", "),
        scenes.collect::<Vec<_>>().join(", "),
        to.path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Script;

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
    fn a_wait_fails_with_a_failed_evaluation() {
        let error = run("model evaluate nowhere.safetensors\nwait").unwrap_err();
        assert!(error.starts_with("s:2: ") && error.contains("nowhere.safetensors"), "{error}");
    }

    #[test]
    fn cancelled_work_is_not_in_the_recorded_script() {
        let mut session = run("model evaluate bucket-box\nmodel stop").unwrap();
        assert!(!session.to_script().contains("model"), "{}", session.to_script());
        assert!(session.is_idle() && session.apply(crate::command::ModelStop).is_err());
    }
}
