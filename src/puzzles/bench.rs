//! Methods on generated puzzles: proposes subgoals for each puzzle, then writes a sweep over all of them.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::error::PuzzleError;
use super::index::Index;
use super::proposals::SubgoalSearch;
use crate::batch::{Batch, BatchProgress};
use crate::trainer::Method;

/// Name of the bench's sweep in its folder.
const SWEEP: &str = "sweep.json";

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
    /// [`PuzzleError::SettingOfOption`].
    pub fn sweep(&self, tasks: &[PathBuf]) -> Result<String, PuzzleError> {
        let of_option = |key: &str| ["task", "method", "seed", "episodes", "model", "prior"].contains(&key);
        if let Some((key, _)) = self.settings.iter().find(|(key, _)| of_option(key)) {
            return Err(PuzzleError::SettingOfOption(key.clone()));
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
/// [sweep](crate::sweep) over them to `out/sweep.json`, whose path is returned.
///
/// # Errors
/// When the model cannot predict a puzzle, or a file cannot be read or written;
/// [`PuzzleError::Interrupted`].
pub fn prepare(
    plan: &BenchPlan,
    index: &Index,
    out: &Path,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<PathBuf, PuzzleError> {
    let tasks = plan.search.propose(index, out, batch, on_progress)?;
    let text = plan.sweep(&tasks)?;
    let path = out.join(SWEEP);
    crate::atomic::write(&path, text.as_bytes()).map_err(PuzzleError::io(&path))?;
    Ok(path)
}
