//! The available dynamics models, and the tasks that can be opened by their names.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::models::{MODELS, is_listed};
use mge_base::paths::{entries, suffix};
use mge_dynamics::{Evaluation, LaunchErrors, Model, OneTool, shipped_evaluation, shipped_models};
use mge_physics::ToolKind;
use mge_task::{Task, level_names, load, shipped_names};
use mge_trainer::PriorSource;

/// An available dynamics model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModelSummary {
    /// The name that selects it.
    pub name: String,
    /// What the name means; a file is known by its content.
    pub source: PriorSource,
    /// Short description.
    pub about: String,
    /// It can be read, and knows the tools of the task.
    pub fits: bool,
    /// The tools that it was trained with; none of a kind of model rather than a single one.
    pub tools: Vec<ToolKind>,
    /// Launches of each tool, and epochs, of its training.
    pub trained: [usize; 2],
    /// Final losses of its training and validation, if its file keeps them.
    pub losses: Option<[f32; 2]>,
    /// Its errors after one action, if they are known: by tool its own and that of constant velocity.
    pub errors: Vec<(ToolKind, [f64; 2])>,
}

impl ModelSummary {
    /// The mean of its errors over the tools, if they are known.
    pub fn mean_error(&self) -> Option<f64> {
        let sum = self.errors.iter().map(|(_, [own, _])| own).sum::<f64>();
        (!self.errors.is_empty()).then(|| sum / self.errors.len() as f64)
    }

    /// Whether it predicts one of its tools no better than constant velocity does.
    pub fn is_no_better(&self) -> bool {
        self.errors.iter().any(|(_, [own, velocity])| own >= velocity)
    }

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
        files.retain(|path| path.is_file() && is_listed(path));
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
        let source = PriorSource::from(name.to_owned()).identified();
        Self { name: name.to_owned(), source, about: about.to_owned(), fits: true, ..Self::default() }
    }

    /// A model, described by why it does not fit the task, or by `fitting` if it does, by its training and its errors.
    fn checked(name: &str, model: &Model, task: &Task, fitting: &str) -> Self {
        let tools = task.tool_set().into_iter().filter(|kind| !model.tools().contains(kind));
        let lacking: Vec<&str> = tools.map(|kind| kind.name()).collect();
        let checked = model.check_task(task);
        let about = match &checked {
            Ok(()) => fitting.to_owned(),
            Err(_) if !lacking.is_empty() => format!("wrong tools: lacks {}", lacking.join(", ")),
            Err(error) => error.to_string(),
        };
        let (launches, epochs) = (model.provenance.training.observations, model.provenance.epoch);
        let errors = errors(name, model).unwrap_or_default();
        let mut about = format!("{about}; {launches} launches of each tool, {epochs} epochs");
        for (place, (tool, [own, velocity])) in errors.iter().enumerate() {
            let before = if place == 0 { "; error after one action: " } else { ", " };
            let warning = if own >= velocity { " ! no better" } else { "" };
            about += &format!("{before}{tool} {own:.4} (constant velocity {velocity:.4}{warning})");
        }
        let (tools, trained, losses) = (model.tools().to_vec(), [launches, epochs as usize], model.provenance.losses);
        Self { fits: checked.is_ok(), tools, trained, losses, errors, ..Self::new(name, &about) }
    }
}

/// The errors of a shipped model by tool, or those that `mge dynamics evaluate` wrote beside its file, if they are of this
/// very model.
fn errors(name: &str, model: &Model) -> Option<Vec<(ToolKind, [f64; 2])>> {
    let beside = || mge_base::bounded::read_text(Path::new(&format!("{name}.evaluation.json"))).ok();
    let text = shipped_evaluation(name).map(str::to_owned).or_else(beside)?;
    let evaluation: Evaluation = serde_json::from_str(&text).ok()?;
    let of_tool = |launches: &LaunchErrors| {
        let mean = |errors: &OneTool| errors.rollout.last().map_or(f64::NAN, |errors| errors.mean);
        (launches.tool, [&launches.errors.model, &launches.errors.constant_velocity].map(mean))
    };
    let is_own = evaluation.model_sha256 == model.id().sha256;
    is_own.then(|| evaluation.launches.iter().map(of_tool).collect())
}

/// Maximum number of files that are read.
const FILES: usize = 100;

/// The shipped tasks, those in files here and in the folder `tasks`, and CREATE's levels, by what `task` takes.
pub fn named_tasks() -> Vec<(String, Task)> {
    let files = ["tasks", "."].into_iter().flat_map(|folder| entries(folder.as_ref()).unwrap_or_default());
    let files = files.filter(|path| suffix(path) == "json").take(FILES);
    let files = files.map(|path| path.strip_prefix(".").unwrap_or(&path).display().to_string());
    let levels = level_names().map(|level| format!("create/{level}"));
    let mut all: Vec<(String, Task)> = Vec::new();
    for name in shipped_names().map(str::to_owned).chain(files.collect::<BTreeSet<_>>()).chain(levels) {
        // Other files are in these folders, too, and copies of the shipped tasks.
        let task = load(&name).ok().filter(|task| all.iter().all(|(_, known)| known != task));
        all.extend(task.map(|task| (name, task)));
    }
    all
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

    #[test]
    fn a_model_tells_how_it_was_trained_and_what_it_lacks() {
        let all = ModelSummary::all(&mge_task::load("task3").unwrap());
        let of = |name: &str| all.iter().find(|model| model.name == name).unwrap();
        let wrong = of("bucket-box");
        assert!(!wrong.fits && wrong.about.starts_with("wrong tools: lacks "), "{}", wrong.about);
        assert!(of("square-floor").about.contains(" launches of each tool, "), "{}", of("square-floor").about);
        for (name, _) in shipped_models() {
            let tools: Vec<ToolKind> = of(name).errors.iter().map(|(tool, _)| *tool).collect();
            assert_eq!(tools, of(name).tools, "its evaluation is that of the shipped file");
            assert!(!of(name).is_no_better(), "{}", of(name).about);
        }
    }
}
