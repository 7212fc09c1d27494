//! The available dynamics models.

use std::path::{Path, PathBuf};

use crate::MODELS;
use mge_base::paths::{entries, suffix};
use mge_dynamics::{Model, shipped_models};
use mge_task::Task;

/// An available dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSummary {
    /// The name that selects it.
    pub name: String,
    /// Short description.
    pub about: String,
    /// It can be read, and knows the tools of the task.
    pub fits: bool,
}

impl ModelSummary {
    /// All models, described in relation to a task. Reads those in the folder of models.
    pub fn all(task: &Task) -> Vec<Self> {
        let mut models = vec![
            Self::new("trained", "trained for the task's tools with the seed of the run"),
            Self::new("learned", "the shipped dynamics model of the task's tool set"),
            Self::new("rapier", "rapier's own solver: an approximation that learns nothing"),
            Self::new("true", "the environment's own physics: the upper bound of guidance"),
            Self::new("uniform", "no model: uniform random actions in place of clusters"),
        ];
        let shipped = shipped_models().iter();
        models.extend(shipped.map(|(name, model)| Self::checked(name, model, task, "shipped")));
        models.extend(Self::in_folder(Path::new(MODELS), task));
        models
    }

    /// The models in a folder, by name.
    fn in_folder(folder: &Path, task: &Task) -> Vec<Self> {
        let mut files = match entries(folder) {
            Ok(files) => files,
            Err(error) => return vec![Self::new(&folder.display().to_string(), &error.to_string())],
        };
        files.retain(|path| path.is_file() && ["safetensors", ""].contains(&&*suffix(path)));
        files.sort();
        let read = |path: &PathBuf| {
            let name = path.display().to_string();
            match Model::load(path) {
                Ok(model) => Self::checked(&name, &model, task, &format!("trained by you: {}", model.name())),
                Err(error) => Self { fits: false, ..Self::new(&name, &error.to_string()) },
            }
        };
        files.iter().map(read).collect()
    }

    fn new(name: &str, about: &str) -> Self {
        Self { name: name.to_owned(), about: about.to_owned(), fits: true }
    }

    /// A model, described by why it does not fit the task, or by `fitting` if it does.
    fn checked(name: &str, model: &Model, task: &Task, fitting: &str) -> Self {
        let checked = model.check_task(task);
        let about = checked.as_ref().map_or_else(|error| error.to_string(), |()| fitting.to_owned());
        Self { fits: checked.is_ok(), ..Self::new(name, &about) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_model_says_why() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("mine.safetensors"), "no model").unwrap();
        std::fs::write(folder.path().join("notes.txt"), "no model either").unwrap();
        let found = ModelSummary::in_folder(folder.path(), &mge_task::load("task1").unwrap());
        assert!(found.len() == 1 && found[0].name.ends_with("mine.safetensors"));
        assert!(!found[0].about.contains("trained by you"), "{}", found[0].about);
    }
}
