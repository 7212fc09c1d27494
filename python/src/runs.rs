//! The data of runs, as JSON.

use std::path::PathBuf;

use pyo3::prelude::*;
use serde_json::{Value, json};

use super::error::exception;
use super::pool::{abandonable, abandonable_on_threads};
use mge_results::{FoundRun, find_runs, read_runs};
use mge_run::{EpisodeRecord, EvaluationRecord, RunDirectory, RunError, RunHistory};
use mge_trainer::RunConfig;

/// A run as JSON: its configuration, its state, rows of its episodes and of its greedy evaluations, and a row of each by
/// default.
#[pyfunction]
pub fn read_run(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let read = move || -> Result<_, RunError> {
        let directory = RunDirectory::open(path)?;
        let config = RunConfig::of(&directory)?;
        let history = match RunHistory::read(&directory) {
            // The run was created but has not begun.
            Err(error) if error.is_not_found() => RunHistory::default(),
            read => read?,
        };
        let run = json!({
            "config": config,
            "state": directory.status()?.state.name(),
            "episodes": history.records.iter().collect::<Vec<_>>(),
            "episode": EpisodeRecord { charged_actions: Some(0), ..EpisodeRecord::default() },
            "evaluations": history.evaluations.iter().collect::<Vec<_>>(),
            "evaluation": EvaluationRecord::default(),
        });
        Ok(run.to_string())
    };
    abandonable(py, read)?.map_err(exception)
}

/// Finds and reads the runs in folders.
pub fn found(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<Vec<FoundRun>> {
    abandonable_on_threads(py, move || read_runs(&find_runs(&folders)?))?.map_err(exception)
}

/// The results of the runs in folders as JSON: for each its path, state and label in figures, and its measures, of which
/// `settings` and `implied` are the effective values of all settings in which any two runs differ.
#[pyfunction]
pub fn read_results(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<String> {
    let found = found(py, folders)?;
    let rows = found.iter().map(|FoundRun { path, state, trained, .. }| {
        let row = &trained.row;
        json!({"run": path.to_string_lossy(), "state": state.name(), "label": row.label(), "measures": row})
    });
    Ok(Value::from_iter(rows).to_string())
}
