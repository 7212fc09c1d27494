//! The data of runs, as JSON.

use std::path::PathBuf;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Value, json};

use super::arguments::{dpi, resamples, seed};
use super::error::exception;
use super::pool::{abandonable, abandonable_on_threads};
use mge_figures::DEFAULT_DPI;
use mge_results::{FoundRun, find_runs, read_runs};
use mge_run::{EpisodeRecord, EvaluationRecord, RunDirectory, RunError, RunHistory};
use mge_stats::Bootstrap;
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

/// Writes a report of the runs in folders to `out`, like `mge report`, and returns its `report.json`.
#[pyfunction]
#[pyo3(signature = (folders, out, resamples = 2000, confidence = 0.95, seed = 0, dpi = None))]
pub fn write_report(
    py: Python<'_>,
    folders: Vec<PathBuf>,
    out: PathBuf,
    #[pyo3(from_py_with = resamples)] resamples: u32,
    confidence: f64,
    #[pyo3(from_py_with = seed)] seed: u64,
    #[pyo3(from_py_with = dpi)] dpi: Option<u32>,
) -> PyResult<String> {
    if !(confidence > 0.0 && confidence < 1.0) {
        return Err(PyValueError::new_err(format!("`confidence` is {confidence}, and should be between 0 and 1")));
    }
    let bootstrap = Bootstrap { resamples, confidence, seed };
    let dpi = dpi.unwrap_or(DEFAULT_DPI);
    let write =
        move || mge_results::report(&folders, &out, &bootstrap, None, "mge.write_report()", dpi, &mut |_, _| {});
    let report = abandonable_on_threads(py, write)?.map_err(exception)?;
    serde_json::to_string(&report).map_err(exception)
}
