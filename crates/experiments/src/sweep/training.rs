//! The agents of a sweep: turns combinations of settings into configurations of runs.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use super::file::{Axis, Choice, Grid};
use mge_base::identity::FileId;
use mge_base::json;
use mge_base::paths::expanded;
use mge_base::validation::ValidationError;
use mge_dynamics::tool_set_name;
use mge_guidance::EpsilonSchedule;
use mge_task::{self as task, Task};
use mge_trainer::{ModelFile, PriorSource, RunConfig, check_model, set_the_same};

/// Aliases of settings, as on the command line.
const ALIASES: [(&str, &str); 2] = [("threshold", "epsilon"), ("model", "prior")];

/// In the path of a model, what stands for the name of the task's tool set.
const TOOLS: &str = "{tools}";

/// The path of the setting with this name in a sweep file.
pub(super) fn setting(key: &str) -> &str {
    ALIASES.iter().find(|(alias, _)| *alias == key).map_or(key, |(_, setting)| setting)
}

/// The content of the files that a setting names by their path, which may change while the content stays.
pub(super) fn file_behind(config: &RunConfig, key: &str, value: &str) -> Option<FileId> {
    match (setting(key), &config.prior) {
        ("prior", PriorSource::ModelFile(ModelFile { id, .. })) if value.contains('/') => id.clone(),
        _ => None,
    }
}

/// The grid with absolute paths of tasks and models, so that its commands work in any folder.
pub(super) fn absolute_paths(grid: &Grid) -> Grid {
    let mut grid = grid.clone();
    for axis in grid.axes.iter_mut().filter(|axis| ["task", "model", "prior"].contains(&axis.key.as_str())) {
        for value in &mut axis.values {
            // Names that are no files stay.
            let path =
                value.as_str().map(expanded).filter(|path| path.is_file() || path.to_string_lossy().contains(TOOLS));
            if let Some(path) = path.and_then(|path| std::path::absolute(path).ok()) {
                *value = path.display().to_string().into();
            }
        }
    }
    grid
}

/// Refuses a setting given twice, also under another name, with its group, or with an alternative to it.
pub(super) fn check_aliases(grid: &Grid) -> Result<(), ValidationError> {
    for (index, axis) in grid.axes.iter().enumerate() {
        let same = |other: &&Axis| set_the_same(setting(&other.key), setting(&axis.key));
        if let Some(other) = grid.axes[..index].iter().find(same) {
            let message = format!("sets the same as `{}`: give only one of them", other.key);
            return Err(ValidationError::new(&axis.key, message));
        }
    }
    Ok(())
}

/// Makes configurations; loads every task and checks every model only once.
#[derive(Default)]
pub(super) struct Agents {
    tasks: BTreeMap<String, Arc<Task>>,
    sources: BTreeMap<String, PriorSource>,
    /// What the models of configurations already checked depend on.
    models: HashSet<String>,
}

impl Agents {
    /// The configuration of a combination. Settings without effect, whatever their value, are left out of it, so that
    /// runs differing only in these are equal.
    pub fn config(&mut self, combination: &[Choice<'_>]) -> Result<RunConfig, ValidationError> {
        let start = RunConfig::usual_for(self.task(combination)?);
        let mut chosen = combination.to_vec();
        chosen.retain(|choice| choice.key() != "task");
        // The method comes first: it determines the defaults of other settings.
        chosen.sort_by_key(|choice| choice.key() != "method");
        let mut config = self.with_settings(&start, &chosen)?;
        for choice in chosen.clone() {
            let key = setting(choice.key());
            if !config.uses(key) {
                let mut others = chosen.clone();
                others.retain(|other| other.key() != choice.key());
                let without = self.with_settings(&start, &others)?;
                if !without.uses(key) {
                    (config, chosen) = (without, others);
                }
            }
        }
        if !config.method.uses("epsilon") {
            config.epsilon = EpsilonSchedule::Constant(0.0);
        }
        self.check_model(combination, &config)?;
        Ok(config)
    }

    /// A configuration with the chosen values of settings.
    fn with_settings(&mut self, start: &RunConfig, chosen: &[Choice<'_>]) -> Result<RunConfig, ValidationError> {
        let mut config = start.clone();
        for choice in chosen {
            let text = json::text(choice.value());
            config = match setting(choice.key()) {
                // Read only once.
                "prior" => RunConfig { prior: self.source(&text, &config.task), ..config },
                key => config.with_unchecked_setting(key, &text).map_err(|error| choice.wrong(error))?,
            };
        }
        config.validate().map_err(|error| {
            let of_error = |choice: &&Choice<'_>| set_the_same(setting(choice.key()), &error.path);
            chosen.iter().find(of_error).map_or_else(|| error.clone(), |choice| choice.wrong(&error))
        })?;
        Ok(config)
    }

    /// The source of rollouts with this name, for a task.
    pub fn source(&mut self, name: &str, task: &Task) -> PriorSource {
        let read = |name: &String| PriorSource::from(name.clone()).identified();
        let name = name.replace(TOOLS, &tool_set_name(&task.tool_set()));
        self.sources.entry(name).or_insert_with_key(read).clone()
    }

    /// The task of a combination.
    pub fn task(&mut self, chosen: &[Choice<'_>]) -> Result<Arc<Task>, ValidationError> {
        let Some(choice) = chosen.iter().find(|choice| choice.key() == "task") else {
            let shipped = task::shipped().iter().map(|task| task.name.clone()).collect::<Vec<_>>().join(", ");
            let message = format!("is missing: name one or more of {shipped}, or task files");
            return Err(ValidationError::new("task", message));
        };
        let name = json::text(choice.value());
        if let Some(known) = self.tasks.get(&name) {
            return Ok(known.clone());
        }
        let task = Arc::new(task::load(&name).map_err(|error| choice.wrong(error))?);
        self.tasks.insert(name, task.clone());
        Ok(task)
    }

    /// Checks that the model exists and covers the tools, before the run would fail.
    pub fn check_model(&mut self, chosen: &[Choice<'_>], config: &RunConfig) -> Result<(), ValidationError> {
        let RunConfig { task, method, prior, .. } = config;
        let key = format!("{:?}", (&task.name, method, prior, config.is_guided()));
        if self.models.contains(&key) {
            return Ok(());
        }
        let model = chosen.iter().find(|choice| setting(choice.key()) == "prior");
        let path = model.map_or_else(|| "task".to_owned(), Choice::path);
        check_model(config).map_err(|error| ValidationError::new(path, error))?;
        self.models.insert(key);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn names_of_files_become_absolute_and_other_names_stay() {
        let axis = |key: &str, value: &str| Axis {
            key: key.to_owned(),
            values: vec![json!(value)],
            is_list: false,
            is_sampled: false,
        };
        // Relative to the folder of the package.
        let axes = vec![axis("task", "task1"), axis("model", "Cargo.toml"), axis("prior", "src")];
        let grid = absolute_paths(&Grid { axes, ..Grid::default() });
        let values: Vec<&str> = grid.axes.iter().filter_map(|axis| axis.values[0].as_str()).collect();
        assert_eq!(values, ["task1", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"), "src"]);
    }
}
