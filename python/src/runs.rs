//! The data of runs, as columns.

use std::path::PathBuf;

use numpy::IntoPyArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PySlice};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::arguments::{dpi, resamples, seed};
use super::error::exception;
use super::pool::{abandonable, abandonable_on_threads};
use mge_figures::DEFAULT_DPI;
use mge_results::{FoundRun, find_runs, read_runs};
use mge_run::{EpisodeRecord, RunDirectory, RunError, RunHistory};
use mge_stats::Bootstrap;
use mge_trainer::RunConfig;

/// Rows as columns, in order of first appearance: arrays of bool, int64 or float64 (NaN where
/// there is no number), else lists.
fn columns<'py>(py: Python<'py>, rows: &[Map<String, Value>]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let mut names: Vec<&String> = Vec::new();
    for name in rows.iter().flat_map(Map::keys) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        let values: Vec<&Value> = rows.iter().map(|row| row.get(name).unwrap_or(&Value::Null)).collect();
        dict.set_item(name, column(py, &values)?)?;
    }
    Ok(dict)
}

/// The columns of `rows`; without rows, empty ones of the kinds that `example` would have.
fn columns_like<'py>(
    py: Python<'py>,
    rows: &[Map<String, Value>],
    example: Map<String, Value>,
) -> PyResult<Bound<'py, PyDict>> {
    if !rows.is_empty() {
        return columns(py, rows);
    }
    let dict = PyDict::new(py);
    for (name, column) in columns(py, &[example])? {
        dict.set_item(name, column.get_item(PySlice::new(py, 0, 0, 1))?)?;
    }
    Ok(dict)
}

fn column<'py>(py: Python<'py>, values: &[&Value]) -> PyResult<Bound<'py, PyAny>> {
    // Our files have non-finite numbers as strings.
    let number = |value: &Value| match value {
        Value::Null => Some(f64::NAN),
        Value::String(word) => matches!(word.as_str(), "NaN" | "inf" | "-inf").then(|| word.parse().ok()).flatten(),
        value => value.as_f64(),
    };
    if let Some(values) = values.iter().map(|value| value.as_bool()).collect::<Option<Vec<bool>>>() {
        return Ok(values.into_pyarray(py).into_any());
    }
    if let Some(values) = values.iter().map(|value| value.as_i64()).collect::<Option<Vec<i64>>>() {
        return Ok(values.into_pyarray(py).into_any());
    }
    if let Some(values) = values.iter().map(|value| number(value)).collect::<Option<Vec<f64>>>() {
        return Ok(values.into_pyarray(py).into_any());
    }
    let text = |value: &&Value| match value {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        value => Some(value.to_string()),
    };
    Ok(PyList::new(py, values.iter().map(text))?.into_any())
}

fn row(value: &impl Serialize) -> Map<String, Value> {
    // Plain structs of numbers and strings always serialise to objects.
    match serde_json::to_value(value) {
        Ok(Value::Object(row)) => row,
        _ => Map::new(),
    }
}

/// A run: its configuration (JSON), state, and columns of its episodes and of its greedy evaluations.
#[pyfunction]
pub fn read_run<'py>(
    py: Python<'py>,
    path: PathBuf,
) -> PyResult<(String, String, Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let read = move || -> Result<_, RunError> {
        let directory = RunDirectory::open(path)?;
        let config = RunConfig::of(&directory)?;
        let history = match RunHistory::read(&directory) {
            // The run was created but has not begun.
            Err(error) if error.is_not_found() => RunHistory::default(),
            read => read?,
        };
        Ok((config, history, directory.status()?.state))
    };
    let (config, history, state) = abandonable(py, read)?.map_err(exception)?;
    let episodes: Vec<_> = history.records.iter().map(row).collect();
    let episodes = columns_like(py, &episodes, row(&EpisodeRecord::default()))?;
    let evaluation = |episode: u64, success: f64, mean_return: f64| {
        row(&json!({"episode": episode, "success": success, "mean_return": mean_return}))
    };
    let evaluations: Vec<_> =
        history.evaluations.iter().map(|one| evaluation(one.episode, one.success, one.mean_return)).collect();
    let evaluations = columns_like(py, &evaluations, evaluation(0, 0.0, 0.0))?;
    Ok((json!(config).to_string(), state.name().to_owned(), episodes, evaluations))
}

/// Finds and reads the runs in folders.
pub fn found(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<Vec<FoundRun>> {
    abandonable_on_threads(py, move || read_runs(&find_runs(&folders)?))?.map_err(exception)
}

/// The results of the runs in folders, as columns: one row per run, with its label in figures and the effective values
/// of all settings in which any two runs differ.
#[pyfunction]
pub fn read_results(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<Bound<'_, PyDict>> {
    let rows: Vec<_> = found(py, folders)?
        .iter()
        .map(|run| {
            let mut cells = Map::new();
            cells.insert("run".to_owned(), json!(run.path));
            cells.insert("state".to_owned(), json!(run.state.name()));
            cells.insert("label".to_owned(), json!(run.trained.row.label()));
            let mut measures = row(&run.trained.row);
            for differing in ["settings", "implied"] {
                if let Some(Value::Object(settings)) = measures.remove(differing) {
                    cells.extend(settings);
                }
            }
            cells.extend(measures);
            cells.insert("charged".to_owned(), json!(run.trained.row.charged));
            cells
        })
        .collect();
    columns(py, &rows)
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
