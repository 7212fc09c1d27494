//! The library's figures for Python.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use super::arguments::dpi;
use super::error::exception;
use super::pool::abandonable;
use super::runs::found;
use super::task::Task;
use mge_figures::{self as figures, Against, DEFAULT_DPI, Provenance, Success, TaskGrid};
use mge_results::TrainedRun;
use mge_results::figures::{learning_curves, method_scores};
use mge_stats::Bootstrap;

/// A figure: displayed by notebooks, written by `save`.
#[pyclass(module = "mge.figures", frozen)]
pub struct Figure(Arc<Drawn>);

struct Drawn {
    figure: Box<dyn figures::Figure + Send + Sync>,
    provenance: Provenance,
}

impl Figure {
    /// A figure made by the call `command`, which its metadata records.
    pub fn new(figure: impl figures::Figure + Send + Sync + 'static, command: &str) -> Self {
        Self(Arc::new(Drawn { figure: Box::new(figure), provenance: Provenance::new(command, &[], "") }))
    }

    /// Draws without holding the GIL.
    fn drawn<T: Send + 'static>(&self, py: Python<'_>, draw: impl FnOnce(&Drawn) -> T + Send + 'static) -> PyResult<T> {
        let drawn = self.0.clone();
        abandonable(py, move || draw(&drawn))
    }
}

#[pymethods]
impl Figure {
    /// The figure as SVG.
    fn svg(&self, py: Python<'_>) -> PyResult<String> {
        self.drawn(py, |drawn| drawn.figure.to_svg(&drawn.provenance))
    }

    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.svg(py)
    }

    /// The figure's data as CSV.
    fn csv(&self, py: Python<'_>) -> PyResult<String> {
        self.drawn(py, |drawn| String::from_utf8_lossy(&drawn.figure.table().to_csv()).into_owned())
    }

    /// Writes the figure in the format of the path's extension (.png, .svg), and its data beside
    /// it as CSV.
    #[pyo3(signature = (path, dpi = None))]
    fn save(&self, py: Python<'_>, path: PathBuf, #[pyo3(from_py_with = dpi)] dpi: Option<u32>) -> PyResult<()> {
        let dpi = dpi.unwrap_or(DEFAULT_DPI);
        self.drawn(py, move |drawn| drawn.figure.write(&(&path).into(), &drawn.provenance, dpi))?.map_err(exception)
    }

    fn __repr__(&self) -> String {
        format!("<Figure of {}>", self.0.provenance.command)
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err(
            "a figure cannot be pickled: keep its `svg()` or `csv()`, or the file that `save` writes",
        ))
    }
}

/// Tasks side by side.
#[pyfunction]
pub fn figure_tasks(tasks: Vec<Task>) -> Figure {
    let tasks = tasks.iter().map(|task| task.0.as_ref().clone()).collect();
    Figure::new(TaskGrid { tasks }, "mge.figures.tasks()")
}

/// Learning curves of the runs in folders: interquartile mean over seeds of the rolling success, against
/// episodes or, with `steps`, against charged actions; or of the greedy evaluations.
#[pyfunction]
#[pyo3(signature = (folders, greedy = false, steps = false))]
pub fn figure_learning(py: Python<'_>, folders: Vec<PathBuf>, greedy: bool, steps: bool) -> PyResult<Figure> {
    if greedy && steps {
        return Err(PyValueError::new_err("`greedy` and `steps` cannot be combined: evaluations are by episode"));
    }
    let runs: Vec<TrainedRun> = found(py, folders)?.into_iter().map(|run| run.trained).collect();
    let success = if greedy { Success::Greedy } else { Success::Training };
    let against = if steps { Against::Charged } else { Against::Episodes };
    let curves = abandonable(py, move || learning_curves(&runs, &Bootstrap::default(), success, against, None))?;
    Ok(Figure::new(curves.map_err(exception)?, "mge.figures.learning_curves()"))
}

/// Area under the learning curve of every method in folders of runs.
#[pyfunction]
pub fn figure_methods(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<Figure> {
    let rows: Vec<_> = found(py, folders)?.into_iter().map(|run| run.trained.row).collect();
    let scores = abandonable(py, move || method_scores(&rows, &Bootstrap::default(), None))?;
    Ok(Figure::new(scores.map_err(exception)?, "mge.figures.methods()"))
}
