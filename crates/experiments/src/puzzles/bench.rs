//! Methods on generated puzzles: proposes subgoals for each puzzle, then writes a sweep over all of them.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::index::Index;
use super::proposals::SubgoalSearch;
use crate::error::ExperimentError;
use mge_base::atomic::{Format, Target};
use mge_results::ReportFolder;
use mge_run::RunError;
use mge_trainer::Method;
use mge_trainer::batch::{Batch, BatchProgress};

/// Name of the bench's sweep in its folder.
const SWEEP: &str = "sweep.json";

/// The format of such sweeps: their tasks are in the folder `tasks` of a bench.
const FORMAT: Format<'static> = Format { name: "the sweep of a bench", suffix: "", is: &is_of_a_bench };

fn is_of_a_bench(found: &[u8]) -> bool {
    let sweep: Option<Map<String, Value>> = serde_json::from_slice(found).ok();
    let tasks = sweep.as_ref().and_then(|sweep| sweep.get("task")?.as_array());
    let is_in_tasks = |task: &Value| {
        let folder = task.as_str().and_then(|path| Path::new(path).parent()?.file_name());
        folder.is_some_and(|folder| folder == "tasks")
    };
    tasks.is_some_and(|tasks| tasks.iter().all(is_in_tasks))
        && sweep.is_some_and(|sweep| ["method", "seed", "episodes", "model"].iter().all(|key| sweep.contains_key(*key)))
}

/// The methods, puzzles and settings of a bench.
#[derive(Debug, Clone)]
pub struct BenchPlan {
    /// The puzzles and the search for their subgoals.
    pub search: SubgoalSearch,
    /// The methods.
    pub methods: Vec<Method>,
    /// Number of episodes of a training.
    pub episodes: u32,
    /// Number of trainings of a method on a puzzle, with seeds 0 to `seeds - 1`.
    pub seeds: u64,
    /// Other settings of all trainings, by JSON path.
    pub settings: Vec<(String, String)>,
}

impl BenchPlan {
    /// The [sweep](crate::sweep) over the tasks in these files.
    ///
    /// # Errors
    /// [`ExperimentError::SettingOfOption`].
    pub fn sweep(&self, tasks: &[PathBuf]) -> Result<String, ExperimentError> {
        let of_option = |key: &str| ["task", "method", "seed", "episodes", "model", "prior"].contains(&key);
        if let Some((key, _)) = self.settings.iter().find(|(key, _)| of_option(key)) {
            return Err(ExperimentError::SettingOfOption(key.clone()));
        }
        let mut sweep = Map::new();
        sweep.insert("task".into(), tasks.iter().map(|task| task.display().to_string()).collect());
        sweep.insert("method".into(), self.methods.iter().map(|method| method.name()).collect());
        sweep.insert("seed".into(), (0..self.seeds).collect());
        sweep.insert("episodes".into(), json!(self.episodes));
        sweep.insert("model".into(), Value::String(self.search.model.clone().into()));
        sweep.extend(self.settings.iter().map(|(key, value)| (key.clone(), Value::String(value.clone()))));
        Ok(format!("{:#}\n", Value::Object(sweep)))
    }
}

/// Writes the puzzles with proposed subgoals to `out/tasks`, except existing ones, and the
/// [sweep](crate::sweep) over them to `out/sweep.json`, whose path and text are returned.
///
/// # Errors
/// When the model cannot predict a puzzle, or a file cannot be read or written;
/// [`ExperimentError::Interrupted`].
pub fn prepare(
    plan: &BenchPlan,
    index: &Index,
    out: impl Into<Target>,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<(PathBuf, String), ExperimentError> {
    let out = out.into();
    let sweep = out.join(SWEEP);
    sweep.check(&FORMAT).map_err(RunError::io("write", &sweep.path))?;
    ReportFolder::new(out.clone())?;
    let tasks = plan.search.propose(index, &out, batch, on_progress)?;
    let text = plan.sweep(&tasks)?;
    sweep.write(text.as_bytes(), &FORMAT).map_err(RunError::io("write", &sweep.path))?;
    Ok((sweep.path, text))
}
