//! The available dynamics models. A model file is read once, and again when it has changed.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use super::ModelSummary;
use mge_base::paths::suffix;
use mge_dynamics::{Model, shipped_models};
use mge_task::Task;
use mge_workbench::{MODELS, saved_evaluation};

/// The model files read so far, each with its modification time and the model or the reason why it cannot be read.
#[derive(Default)]
pub struct Models {
    files: HashMap<PathBuf, (Option<SystemTime>, Result<Model, String>)>,
}

impl Models {
    /// All models, described in relation to a task.
    pub fn summaries(&mut self, task: &Task) -> Vec<ModelSummary> {
        let mut models = vec![
            summary("learned", "the shipped dynamics model of the task's tool set"),
            summary("rapier", "rapier's own solver: an approximation that learns nothing"),
            summary("true", "the environment's own physics: the upper bound of guidance"),
            summary("uniform", "no model: uniform random actions in place of clusters"),
        ];
        let shipped = shipped_models().iter();
        models.extend(shipped.map(|(name, model)| measured(name, model, &about(model, task, || "shipped".to_owned()))));
        self.read(Path::new(MODELS));
        let mut files: Vec<_> = self.files.iter().collect();
        files.sort_by_key(|(path, _)| *path);
        models.extend(files.into_iter().map(|(path, (_, model))| {
            let name = path.display().to_string();
            match model {
                Ok(model) => {
                    measured(&name, model, &about(model, task, || format!("trained by you: {}", model.name())))
                }
                Err(error) => summary(&name, error),
            }
        }));
        models
    }

    /// Reads new and changed files and drops those that no longer exist.
    fn read(&mut self, folder: &Path) {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let files = entries.map(|entry| entry.path());
        let mut known = std::mem::take(&mut self.files);
        for path in files.filter(|path| suffix(path) == "safetensors") {
            let changed = std::fs::metadata(&path).and_then(|data| data.modified()).ok();
            let model = match known.remove(&path) {
                Some((then, model)) if then == changed && changed.is_some() => model,
                _ => Model::load(&path).map_err(|error| error.to_string()),
            };
            self.files.insert(path, (changed, model));
        }
    }
}

/// Why the model does not fit the task, or the description `fitting` if it does.
fn about(model: &Model, task: &Task, fitting: impl FnOnce() -> String) -> String {
    model.check_task(task).map_or_else(|error| error.to_string(), |()| fitting())
}

fn summary(name: &str, about: &str) -> ModelSummary {
    ModelSummary { name: name.to_owned(), about: about.to_owned(), evaluation: None }
}

/// A model with its stored evaluation.
fn measured(name: &str, model: &Model, about: &str) -> ModelSummary {
    ModelSummary { evaluation: saved_evaluation(name, model).map(Arc::new), ..summary(name, about) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_files_are_read_and_deleted_ones_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.safetensors");
        std::fs::write(&path, "no model").unwrap();
        std::fs::write(folder.path().join("notes.txt"), "no model either").unwrap();
        let mut models = Models::default();
        models.read(folder.path());
        assert!(models.files.values().all(|(_, model)| model.is_err()));
        assert_eq!(models.files.keys().collect::<Vec<_>>(), [&path]);
        let known = |models: &Models| models.files[&path].1.as_ref().err().is_some_and(|error| error == "known");
        models.files.get_mut(&path).unwrap().1 = Err("known".to_owned());
        models.read(folder.path());
        assert!(known(&models), "an unchanged file is not read again");
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
        models.read(folder.path());
        assert!(!known(&models), "a changed file is");
        std::fs::remove_file(&path).unwrap();
        models.read(folder.path());
        assert!(models.files.is_empty());
    }
}
