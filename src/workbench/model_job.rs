//! Training and measuring dynamics models, on a thread of their own.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;

use crate::dynamics::{self, Ended, EvaluationConfig, ModelConfig, TrainConfig, train_to_file};
use crate::physics::ToolKind;
use crate::task;

/// Work on a dynamics model. Dropping it ends the work after the present epoch.
#[derive(Debug)]
pub(super) struct ModelJob {
    name: String,
    seen: Arc<Seen>,
    shown: u32,
    thread: Option<JoinHandle<Result<String, String>>>,
}

/// What the thread and its owner share.
#[derive(Debug, Default)]
struct Seen {
    /// Thousandths that are done; 0 as long as nothing can be said.
    thousandths: AtomicU32,
    cancelled: AtomicBool,
}

impl ModelJob {
    /// Trains a model of a tool set into a file.
    pub fn train(tools: &[ToolKind], path: &Path, epochs: Option<u32>, seed: u64) -> std::io::Result<Self> {
        let mut settings = TrainConfig { seed, ..TrainConfig::default() };
        settings.epochs = epochs.unwrap_or(settings.epochs);
        let names = tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        let (tools, path) = (tools.to_owned(), path.to_owned());
        let name = format!("training {}", path.display());
        Self::spawn(name, move |seen| train(&tools, &names, &path, settings, seen))
    }

    /// Measures a shipped model or one in a file.
    pub fn evaluate(model: &str, seed: u64) -> std::io::Result<Self> {
        let (name, model) = (format!("measuring {model}"), model.to_owned());
        Self::spawn(name, move |_| evaluate(&model, seed))
    }

    fn spawn(
        name: String,
        work: impl FnOnce(&Seen) -> Result<String, String> + Send + 'static,
    ) -> std::io::Result<Self> {
        let seen = Arc::<Seen>::default();
        let theirs = Arc::clone(&seen);
        let thread = std::thread::Builder::new().name("mge-model".to_owned()).spawn(move || work(&theirs))?;
        Ok(Self { name, seen, shown: 0, thread: Some(thread) })
    }

    /// What is being done.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How much of it is done, from 0 to 1; None if that cannot be said.
    pub fn progress(&self) -> Option<f32> {
        let thousandths = self.seen.thousandths.load(Ordering::Relaxed);
        (thousandths > 0).then(|| thousandths as f32 / 1000.0)
    }

    /// Whether the progress is another than at the last call.
    pub fn is_news(&mut self) -> bool {
        let now = self.seen.thousandths.load(Ordering::Relaxed);
        std::mem::replace(&mut self.shown, now) != now
    }

    /// What came of it, once it has ended.
    pub fn outcome(&mut self) -> Option<Result<String, String>> {
        if self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return None;
        }
        let outcome = self.thread.take()?.join();
        Some(outcome.unwrap_or_else(|_| Err(format!("{}: it panicked", self.name))))
    }
}

impl Drop for ModelJob {
    fn drop(&mut self) {
        self.seen.cancelled.store(true, Ordering::Relaxed);
    }
}

fn train(tools: &[ToolKind], names: &str, path: &Path, settings: TrainConfig, seen: &Seen) -> Result<String, String> {
    let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let command = format!(
        "mge dynamics train --tools {names} --seed {} --epochs {} --out {file}",
        settings.seed, settings.epochs
    );
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| failed(&error))?;
    }
    let on_progress = |now: &dynamics::Progress| {
        // At least one thousandth: something can be said.
        seen.thousandths.store((1000 * now.epoch / now.epochs.max(1)).max(1), Ordering::Relaxed);
        !seen.cancelled.load(Ordering::Relaxed)
    };
    let trained = train_to_file(path, ModelConfig::default(), settings, tools, &command, on_progress)
        .map_err(|error| failed(&error))?;
    if trained.ended == Ended::Stopped {
        return Err(format!("{}: ended before it was trained; train it again to continue", path.display()));
    }
    trained.remove_checkpoint();
    if let Some(reason) = trained.divergence() {
        return Err(failed(&reason));
    }
    Ok(format!("trained {}: validation loss {:.5}", path.display(), trained.training.validation_loss()))
}

fn evaluate(name: &str, seed: u64) -> Result<String, String> {
    let model = dynamics::named(name).map_err(|error| error.to_string())?;
    let tasks: Vec<_> = task::shipped().into_iter().filter(|task| model.check_task(task).is_ok()).collect();
    let config = EvaluationConfig { seed, ..EvaluationConfig::default() };
    let evaluation = dynamics::evaluate(&model, &tasks, &config).map_err(|error| error.to_string())?;
    let launches = evaluation.launches.iter().map(|launches| {
        let (ours, still) = (&launches.errors.model.one_step, &launches.errors.constant_velocity.one_step);
        format!("{} {:.4} ({:.4})", launches.tool, ours.mean, still.mean)
    });
    let scenes = evaluation.scenes.iter().filter_map(|scene| {
        let hits = &scene.rollout.model.first()?;
        Some(format!("{} {:.4}", scene.task, hits.mean))
    });
    Ok(format!(
        "{name}: error after one prediction (constant velocity): {}; after one action: {}",
        launches.collect::<Vec<_>>().join(", "),
        scenes.collect::<Vec<_>>().join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Model;

    fn wait(mut job: ModelJob) -> Result<String, String> {
        loop {
            if let Some(outcome) = job.outcome() {
                return outcome;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_model_is_trained_into_a_new_folder_and_can_be_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("models/mine.safetensors");
        let told = wait(ModelJob::train(&[ToolKind::Box], &path, Some(1), 0).unwrap()).unwrap();
        assert!(told.contains("validation loss"), "{told}");
        assert!(Model::load(&path).is_ok());
    }

    #[test]
    fn what_cannot_be_measured_is_named() {
        let error = wait(ModelJob::evaluate("nowhere.safetensors", 0).unwrap()).unwrap_err();
        assert!(error.contains("nowhere.safetensors"), "{error}");
    }
}
