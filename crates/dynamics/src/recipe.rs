//! Models that are trained when they are needed, and kept in the user's cache so that none is trained twice.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::config::{ModelConfig, TrainConfig};
use super::error::Result;
use super::model::{Model, VERSION, check_task, is_plain, read_model};
use super::tool_set::{canonical_tool_set, model_name, tool_set_name};
use super::train::{Progress, Training};
use mge_base::identity::{FileId, sha256, version};
use mge_base::stop::Stop;
use mge_base::sync::hold_folder;
use mge_base::validation::{Setting, ValidationError, check_settings};
use mge_base::{atomic, bounded, json};
use mge_nn::processor;
use mge_physics::{Ball, ToolKind};
use mge_task::Task;

/// The settings of a model that is trained for a task's tools.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TaskModelConfig {
    /// Launches for each tool type of the task.
    pub launches: usize,
    /// Passes over the launches, at most: fewer if the launches of all tools are many.
    pub epochs: u32,
}

impl Default for TaskModelConfig {
    fn default() -> Self {
        Self { launches: 200, epochs: 4000 }
    }
}

/// The numeric settings of [`TaskModelConfig`].
pub const TASK_MODEL_SETTINGS: [Setting; 2] = [
    Setting::count("launches", 1, 1_000_000, "launches for each tool type of the task that train its model"),
    Setting::count("epochs", 1, 10_000_000, "passes over the launches, at most: fewer for many launches"),
];

/// Most rows of launches that a training uses, so that it takes a few seconds.
const MAX_ROWS: usize = 800_000;

impl TaskModelConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        check_settings(self, &TASK_MODEL_SETTINGS)
    }

    /// The model of exactly the tools of a task. Few launches need few layers, a higher learning rate than the paper's
    /// and [bystanders](TrainConfig::bystanders).
    pub fn recipe(self, task: &Task, seed: u64) -> Recipe {
        let properties = !is_plain(task) || task.ball.radius != Ball::default().radius;
        let config = ModelConfig { properties, layers: 5, ..ModelConfig::default() };
        let tools = task.tool_set();
        let training = TrainConfig {
            observations: self.launches,
            epochs: self.epochs.min((MAX_ROWS / (tools.len() * self.launches).max(1)).max(1) as u32),
            learning_rate: 1e-3,
            bystanders: 0.5,
            seed,
            ..TrainConfig::default()
        };
        Recipe { tools, config, training }
    }
}

/// Everything that determines a trained model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recipe {
    /// Tool types.
    pub tools: Vec<ToolKind>,
    /// Structure, inputs and targets.
    pub config: ModelConfig,
    /// How it is trained.
    pub training: TrainConfig,
}

impl Recipe {
    /// The same with its tools in canonical order.
    ///
    /// # Errors
    /// When a setting is out of range, or the tool set is not usable.
    pub(super) fn checked(&self) -> Result<Self> {
        self.config.validate()?;
        self.training.validate()?;
        Ok(Self { tools: canonical_tool_set(&self.tools)?, ..self.clone() })
    }

    /// Launches at all of its tools.
    pub fn launches(&self) -> usize {
        self.tools.len() * self.training.observations
    }

    /// Checks that the model could predict the task's scenes, before it is trained.
    ///
    /// # Errors
    /// As [`Model::check_task`].
    pub fn check_task(&self, task: &Task) -> Result<()> {
        check_task(task, &self.config, &self.tools)
    }

    /// The model in a file, if it was trained by this recipe.
    ///
    /// # Errors
    /// When the file cannot be read, or is no model.
    pub fn read(&self, path: &Path) -> Result<Option<Model>> {
        self.of_bytes(&read_model(path)?, &path.display().to_string())
    }

    fn of_bytes(&self, bytes: &[u8], origin: &str) -> Result<Option<Model>> {
        let model = Some(Model::from_bytes(bytes, origin)?).filter(|model| self.is_of(model));
        Ok(model.map(|model| self.named(model, bytes)))
    }

    fn is_of(&self, model: &Model) -> bool {
        (&self.config, &self.training, &*self.tools) == (model.config(), &model.provenance.training, model.tools())
    }

    /// The model from the user's cache, or else newly trained, and then kept there. `on_progress` is called after every
    /// epoch. Entries of the cache that are damaged are replaced; without a cache, the model is trained each time.
    ///
    /// # Errors
    /// When a setting is out of range, or soon after `stop` is requested.
    pub fn model(&self, stop: &Stop, on_progress: impl FnMut(&Progress)) -> Result<Arc<Model>> {
        self.model_in(cache().as_deref(), stop, on_progress)
    }

    fn model_in(&self, cache: Option<&Path>, stop: &Stop, on_progress: impl FnMut(&Progress)) -> Result<Arc<Model>> {
        let folder = cache.map(|cache| cache.join(self.key())).filter(|folder| std::fs::create_dir_all(folder).is_ok());
        let Some(folder) = folder else { return Ok(Arc::new(self.train(stop, on_progress)?)) };
        let entry = folder.join(ENTRY);
        if let Some(model) = self.cached(&entry) {
            return Ok(Arc::new(model));
        }
        // Another process may be training the same model: wait for it.
        let held = hold_folder(&folder, || !stop.is_requested());
        stop.check()?;
        if let Some(model) = self.cached(&entry) {
            return Ok(Arc::new(model));
        }
        let model = self.train(stop, on_progress)?;
        let bytes = model.to_file().to_bytes();
        // Without an entry, the model is trained again.
        let _ = atomic::write(&entry, &[sha256(&bytes).as_bytes(), &bytes].concat());
        drop(held);
        Ok(Arc::new(model))
    }

    /// The name of its folder in the cache: the hash of what determines the bytes of its file.
    fn key(&self) -> String {
        sha256(json::pretty(&(VERSION, version(), processor(), self)).as_bytes())
    }

    /// The model in a file of the cache, unless the file is missing or damaged.
    fn cached(&self, entry: &Path) -> Option<Model> {
        let content = bounded::regular(entry).and_then(|()| bounded::read(entry, bounded::MODEL)).ok()?;
        let (hash, bytes) = content.split_at_checked(HASH)?;
        if sha256(bytes).as_bytes() == hash { self.of_bytes(bytes, "").ok()? } else { None }
    }

    fn train(&self, stop: &Stop, on_progress: impl FnMut(&Progress)) -> Result<Model> {
        let mut training = Training::new(self, &self.command(), stop)?;
        // A training that diverged leaves the model of the epoch before.
        training.run(stop, on_progress)?;
        let bytes = training.model.to_file().to_bytes();
        Ok(self.named(training.model.clone(), &bytes))
    }

    fn named(&self, mut model: Model, bytes: &[u8]) -> Model {
        model.file = Some(FileId { name: self.name(), ..FileId::new("", bytes) });
        model
    }

    fn name(&self) -> String {
        model_name(&self.config, &self.tools)
    }

    /// The command that reproduces the model, for its provenance.
    fn command(&self) -> String {
        let TrainConfig { observations, epochs, learning_rate, bystanders, seed, .. } = &self.training;
        let tools = tool_set_name(&self.tools).replace('-', ",");
        format!(
            "mge dynamics train --tools {tools} --seed {seed} --epochs {epochs} --layers {} --learning-rate \
             {learning_rate} --observations {observations} --bystanders {bystanders} --out {}.safetensors",
            self.config.layers,
            self.name()
        )
    }
}

/// The file of a model in its folder of the cache: the hash of the model file in hexadecimal digits, then that file.
const ENTRY: &str = "model";
/// Digits of the hash.
const HASH: usize = 64;

/// The folder of models in the user's cache; none if the user has no home folder.
fn cache() -> Option<PathBuf> {
    let given = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let home = || std::env::home_dir().filter(|home| home.is_absolute()).map(|home| home.join(".cache"));
    Some(given.or_else(home)?.join("mge").join("models"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(epochs: u32) -> Recipe {
        TaskModelConfig { launches: 3, epochs }.recipe(&mge_task::load("task1").unwrap(), 5)
    }

    fn bytes(model: &Model) -> Vec<u8> {
        model.to_file().to_bytes()
    }

    #[test]
    fn a_model_from_the_cache_has_the_bytes_of_a_new_one() {
        let cache = tempfile::tempdir().unwrap();
        let mut trained = 0;
        let mut model = |recipe: &Recipe| {
            recipe.model_in(Some(cache.path()), &Stop::default(), |_| trained += 1).map(|model| {
                assert_eq!(model.id().sha256, sha256(&bytes(&model)));
                bytes(&model)
            })
        };
        let new = model(&recipe(2)).unwrap();
        assert_eq!(new, model(&recipe(2)).unwrap());
        assert_ne!(new, model(&recipe(3)).unwrap());
        assert_eq!(trained, 5, "the second one came from the cache");
        let alone = recipe(2).model_in(None, &Stop::default(), |_| ()).unwrap();
        assert_eq!(new, bytes(&alone));
        assert!(recipe(2).is_of(&alone) && !recipe(3).is_of(&alone));
    }

    #[test]
    fn a_damaged_entry_is_made_again() {
        let cache = tempfile::tempdir().unwrap();
        let make = || bytes(&recipe(1).model_in(Some(cache.path()), &Stop::default(), |_| ()).unwrap());
        let whole = make();
        let entry = cache.path().join(recipe(1).key()).join(ENTRY);
        let kept = std::fs::read(&entry).unwrap();
        let changed = |place: usize| {
            let mut changed = kept.clone();
            changed[place] ^= 1;
            changed
        };
        for damaged in [Vec::new(), kept[..100].to_vec(), changed(3), changed(kept.len() - 1)] {
            std::fs::write(&entry, damaged).unwrap();
            assert_eq!(make(), whole);
            assert_eq!(std::fs::read(&entry).unwrap(), kept);
        }
    }

    #[test]
    fn many_launches_are_used_in_fewer_epochs() {
        let epochs = |config: TaskModelConfig| config.recipe(&mge_task::load("task1").unwrap(), 0).training.epochs;
        assert_eq!(epochs(TaskModelConfig::default()), 2000);
        assert_eq!(epochs(TaskModelConfig { launches: 100, ..TaskModelConfig::default() }), 4000);
        assert_eq!(epochs(TaskModelConfig { launches: 1000, ..TaskModelConfig::default() }), 400);
        assert_eq!(epochs(TaskModelConfig { launches: 1_000_000, epochs: 3 }), 1);
    }

    #[test]
    fn a_stop_ends_the_training_and_leaves_no_entry() {
        let cache = tempfile::tempdir().unwrap();
        let stop = Stop::default();
        let stopped = recipe(100_000).model_in(Some(cache.path()), &stop, |_| stop.request());
        assert!(matches!(stopped, Err(crate::DynamicsError::Stopped(_))));
        assert!(!cache.path().join(recipe(100_000).key()).join(ENTRY).exists());
    }

    #[test]
    fn every_combination_of_the_paper_s_tools_has_a_model() {
        let [first, .., last] = ToolKind::PAPER;
        let mut task = mge_task::load("task1").unwrap();
        task.placeable.kind = last;
        task.tools.iter_mut().for_each(|tool| tool.kind = first);
        let recipe = TaskModelConfig { launches: 2, epochs: 1 }.recipe(&task, 0);
        recipe.check_task(&task).unwrap();
        let model = recipe.model_in(None, &Stop::default(), |_| ()).unwrap();
        assert_eq!(model.tools(), task.tool_set());
        model.check_task(&task).unwrap();
    }
}
