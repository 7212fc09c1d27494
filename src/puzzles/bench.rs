//! Methods on generated puzzles: proposes subgoals for each puzzle, then writes a sweep over all of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::error::PuzzleError;
use super::index::Index;
use super::proposals::SubgoalSearch;
use crate::batch::{Batch, BatchProgress};
use crate::task;
use crate::trainer::{Method, RunConfig, SettingError};

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
    /// Checks the settings before any work is done for them.
    fn check(&self) -> Result<(), PuzzleError> {
        let of_options = |key: &str| ["task", "method", "seed", "episodes", "model"].contains(&key);
        if let Some((key, _)) = self.settings.iter().find(|(key, _)| of_options(key)) {
            return Err(PuzzleError::SettingOfOption(key.clone()));
        }
        let task = Arc::new(task::load("task1")?);
        for method in &self.methods {
            let mut config = RunConfig::default_for(task.clone(), *method);
            for (key, value) in &self.settings {
                config = config.with_unchecked_setting(key, value)?;
            }
            config.validate().map_err(SettingError::from)?;
        }
        Ok(())
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
    plan.check()?;
    let tasks = plan.search.propose(index, out, batch, on_progress)?;
    let mut sweep = Map::new();
    sweep.insert("task".into(), tasks.iter().map(|task| task.display().to_string()).collect());
    sweep.insert("method".into(), plan.methods.iter().map(|method| method.name()).collect());
    sweep.insert("seed".into(), (0..plan.seeds).collect());
    sweep.insert("episodes".into(), json!(plan.episodes));
    sweep.insert("model".into(), Value::String(plan.search.model.clone().into()));
    sweep.extend(plan.settings.iter().map(|(key, value)| (key.clone(), Value::String(value.clone()))));
    let path = out.join(SWEEP);
    let text = format!("{:#}\n", Value::Object(sweep));
    crate::atomic::write(&path, text.as_bytes()).map_err(PuzzleError::io(&path))?;
    Ok(path)
}
