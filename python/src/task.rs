//! Tasks.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyArray2;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arguments::settings;
use super::arrays::rows;
use super::error::exception;
use super::pool::abandonable;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_env::observation_len;
use mge_task::{self as task, load, parse, save, shipped_names, to_json};

/// Task(name, **rules): a shipped task by its name, or the task in the file at that path, with other rules, such as
/// `start_noise=0.1` or `rewards={"step": -0.1}`.
#[pyclass(module = "mge", frozen, eq)]
#[derive(PartialEq)]
pub struct Task(pub Arc<task::Task>);

/// What every call that takes a task accepts.
impl FromPyObject<'_, '_> for Task {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        if let Ok(task) = value.cast::<Self>() {
            return Ok(Self(task.get().0.clone()));
        }
        let Ok(name) = value.extract::<PathBuf>() else {
            let kind = value.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "{kind} is not a task: give a mge.Task, the name of a shipped task, or the path of a task file"
            )));
        };
        let loaded = abandonable(value.py(), move || load(&name.to_string_lossy()))?;
        loaded.map(|task| Self(Arc::new(task))).map_err(exception)
    }
}

#[pymethods]
impl Task {
    #[new]
    #[pyo3(signature = (name, **rules))]
    fn new(name: Self, rules: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let Some(given) = rules else { return Ok(name) };
        let mut task = task::Task::clone(&name.0);
        let mut rules = json::to_value(&task.rules);
        for (path, value) in settings(given)? {
            let usual = rules.clone();
            *json::at_mut(&mut rules, &path).ok_or_else(|| {
                let known: Vec<String> = json::leaf_values(&usual).into_iter().map(|(known, _)| known).collect();
                let hint = did_you_mean(known.iter().map(String::as_str), &path);
                PyTypeError::new_err(format!("a task has no rule `{path}`{hint}"))
            })? = value;
        }
        task.rules = serde_json::from_value(rules).map_err(exception)?;
        task.validate().map_err(exception)?;
        Ok(Self(Arc::new(task)))
    }

    /// A task from its JSON text, in the format of task files.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "task"))]
    fn parse(text: &str, origin: &str) -> PyResult<Self> {
        parse(text, origin).map(|task| Self(Arc::new(task))).map_err(exception)
    }

    /// The JSON text of the task file.
    fn to_json(&self) -> String {
        to_json(&self.0)
    }

    /// Writes the task file.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        save(&self.0, &path).map_err(exception)
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// A description in one sentence.
    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    /// Maximum number of actions per episode.
    #[getter]
    fn max_actions(&self) -> u32 {
        self.0.rules.max_actions
    }

    /// Length of an observation.
    #[getter]
    fn observation_len(&self) -> usize {
        observation_len(&self.0)
    }

    /// Subgoals in order, then the goal: one row each of x, y (normalised) and radius (units), float32.
    #[getter]
    fn stages<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        rows(py, self.0.stages().iter().map(|stage| [stage.position[0], stage.position[1], stage.radius]))
    }

    fn __repr__(&self) -> String {
        format!("Task({:?})", self.0.name)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, String))> {
        let parse = py.get_type::<Self>().getattr("parse")?.unbind();
        Ok((parse, (self.to_json(), self.0.name.clone())))
    }
}

/// Names of the shipped tasks.
#[pyfunction]
pub fn task_names() -> Vec<&'static str> {
    shipped_names().collect()
}

/// Names of CREATE's levels: `create/NAME` is a task, `create/NAME-random` its random variant.
#[pyfunction]
pub fn level_names() -> Vec<&'static str> {
    task::level_names().collect()
}
