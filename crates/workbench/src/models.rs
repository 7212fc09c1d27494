//! Training of dynamics models in the session.

use std::path::Path;

use super::command::{Command, ModelTrain};
use super::job::{Progress, Reporter};
use super::{Session, SessionError};
use mge_base::atomic::Target;
use mge_base::json;
use mge_base::paths::suffix;
use mge_dynamics::{self as dynamics, DynamicsError, train_to_file};
use mge_experiments::sweep::ModelJob;

/// The folder for models trained in the workbench.
pub const MODELS: &str = "models";

/// Whether a file may be a model by its name.
pub(super) fn is_listed(path: &Path) -> bool {
    ["safetensors", ""].contains(&&*suffix(path))
}

impl Session {
    /// Starts training a model, written to a file. Only one is trained at a time, as that keeps all cores busy.
    pub(super) fn train_model(&mut self, command: &ModelTrain) -> Result<String, SessionError> {
        if let Some((name, _)) = self.model_work() {
            return Err(SessionError::Failed(format!("{name}: wait for its end, or end it with `model stop`")));
        }
        let ModelTrain { tools, to, epochs, settings } = command.clone();
        if to.path.parent() == Some(Path::new(MODELS)) && !is_listed(&to.path) {
            return Err(format!("{}: a model there ends in .safetensors, or has no ending", to.path.display()).into());
        }
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
        let report = format!("training {}", to.path.display());
        let work = move |reporter: &Reporter| Ok(train_into_file(&job, &to, &made_by, reporter)?);
        self.start_job(command.clone(), work, |_, result| Ok(result?));
        Ok(report)
    }

    /// Cancels the training of a model.
    pub(super) fn stop_model_work(&mut self) -> Result<String, SessionError> {
        let (name, _) = self.model_work().ok_or("no dynamics model is being trained".to_owned())?;
        self.cancel_jobs(Command::is_model_train);
        Ok(format!("ended: {name}"))
    }

    /// The file and progress of the current training of a model.
    pub fn model_work(&self) -> Option<(String, Progress)> {
        let (Command::ModelTrain(train), progress) = self.job(Command::is_model_train)? else { return None };
        Some((format!("training {}", train.to.path.display()), progress))
    }
}

fn train_into_file(job: &ModelJob, to: &Target, made_by: &str, reporter: &Reporter) -> Result<String, String> {
    let path = &to.path;
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let on_progress = |now: &dynamics::Progress| _ = reporter.progress(now.epoch as usize, now.epochs as usize);
    let trained =
        train_to_file(to, &job.recipe(), made_by, &reporter.stop, on_progress).map_err(|error| match &error {
            DynamicsError::Stopped(_) => failed(&"stopped: the same command starts again"),
            // It names the file.
            DynamicsError::Io { .. } => error.to_string(),
            _ => failed(&error),
        })?;
    if let Some(reason) = &trained.diverged {
        return Err(failed(&format!("{reason}; the model is that of the epoch before")));
    }
    Ok(format!("trained {}: validation loss {:.5}", path.display(), trained.validation_loss()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Script;

    fn run(lines: &str) -> Result<Session, String> {
        let mut session = Session::new(mge_task::load("task1").unwrap(), "runs".into());
        let script = Script::parse(lines, "s", &[]).unwrap();
        script.run(&mut session, |_| {}).map(|()| session).map_err(|error| error.to_string())
    }

    #[test]
    fn a_model_is_trained_into_a_new_folder_and_can_be_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("models/mine.bin");
        let other = run("model train box models/mine.bin 1").unwrap_err().to_string();
        assert!(other.contains("mine.bin: a model there ends in .safetensors"), "it would not be listed: {other}");
        let line = format!("model train box {} 1\nwait", shell_words::quote(&path.display().to_string()));
        run(&line).unwrap();
        assert!(dynamics::Model::load(&path).is_ok());
    }

    #[test]
    fn cancelled_work_is_not_in_the_recorded_script() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.safetensors").display().to_string();
        let mut session = run(&format!("model train box {} 1000\nmodel stop", shell_words::quote(&path))).unwrap();
        assert!(!session.to_script().contains("model"), "{}", session.to_script());
        assert!(session.is_idle() && session.apply(crate::command::ModelStop).is_err());
    }
}
