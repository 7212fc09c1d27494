//! Dynamics models: predictions and rollouts as arrays.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::arguments::{numbers, numbers_or_nan, steps};
use super::arrays::rows;
use super::error::exception;
use super::pool::{abandonable, work};
use super::state::{BALL, State, ball_row};
use super::task::Task;
use mge_dynamics::{self as dynamics, Predictor, Rollout};
use mge_env::{Action, Environment, Snapshot};
use mge_guidance::{RapierPhysics, RolloutModel, TruePhysics};
use mge_physics::{BallState, Tool, to_units};
use mge_task::{self as task, ToolSpec};

fn ball_of(row: &[f32]) -> BallState {
    BallState {
        position: to_units([row[0], row[1]]),
        velocity: [row[2], row[3]],
        angular_velocity: row[4],
        ..BallState::default()
    }
}

/// Model(name): a shipped dynamics model by its name, or the one in the file at that path.
#[pyclass(module = "mge", frozen)]
pub struct Model(Arc<dynamics::Model>);

#[pymethods]
impl Model {
    #[new]
    fn new(py: Python<'_>, name: PathBuf) -> PyResult<Self> {
        abandonable(py, move || dynamics::named(&name, None))?.map(Self).map_err(exception)
    }

    /// The model in the bytes of a model file.
    #[staticmethod]
    fn from_bytes(file: &[u8]) -> PyResult<Self> {
        dynamics::Model::from_bytes(file, "model").map(|model| Self(Arc::new(model))).map_err(exception)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let file = PyBytes::new(py, &self.0.to_file().to_bytes());
        Ok((py.get_type::<Self>().getattr("from_bytes")?, (file,)))
    }

    /// The shipped model for the tools of a task.
    #[staticmethod]
    fn shipped_for(task: Task) -> PyResult<Self> {
        let tools = task.0.tool_set();
        dynamics::shipped_for(&tools).map(Self).ok_or_else(|| {
            PyValueError::new_err(format!("no shipped model knows the tools of `{}`: train one", task.0.name))
        })
    }

    /// The names of its tools, joined by hyphens.
    #[getter]
    fn name(&self) -> String {
        self.0.name()
    }

    /// The tool types it was trained on.
    #[getter]
    fn tools(&self) -> Vec<&'static str> {
        self.0.tools().iter().map(|kind| kind.name()).collect()
    }

    /// Physics steps (1/30 s) from one prediction to the next.
    #[getter]
    fn interval(&self) -> u32 {
        self.0.interval()
    }

    /// How it was trained, as JSON.
    #[getter]
    fn provenance(&self) -> String {
        serde_json::json!(&self.0.provenance).to_string()
    }

    /// Predicts the balls `steps` prediction intervals later, among the tools of a task and those placed.
    ///
    /// `balls`: n x 5: x, y (normalised), velocity x, y (units/s), spin (radians/s).
    /// `placed`: n x m x 2, normalised places of further tools; rows with NaN are ignored. Returns
    /// float32 in the shape of `balls`. Balls outside the screen are predicted too.
    #[pyo3(signature = (task, balls, placed = None, steps = 1))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        task: Task,
        balls: &Bound<'py, PyAny>,
        placed: Option<Bound<'py, PyAny>>,
        #[pyo3(from_py_with = steps)] steps: u32,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let model = self.0.for_task(&task.0).map_err(exception)?;
        let balls: PyReadonlyArray2<'_, f32> = numbers(balls, "balls", "[n, 5]")?;
        let states: Vec<BallState> = balls.as_array().outer_iter().map(|row| ball_of(&row.to_vec())).collect();
        let wanted = format!("[{}, m, 2]", states.len());
        let placed = placed.map(|placed| numbers_or_nan(&placed, "placed", &wanted)).transpose()?;
        let tools = tools_of(&task.0, states.len(), placed);
        let tools: Vec<&[Tool]> = tools.iter().map(Vec::as_slice).collect();
        let predicted =
            work(py, |stop| (0..steps).try_fold(states, |balls, _| model.advance_until(stop, &balls, &tools)))?;
        rows(py, predicted.map_err(exception)?.iter().map(ball_row))
    }

    fn __repr__(&self) -> String {
        format!("Model({:?})", self.0.name())
    }
}

/// The tools around each of `count` balls.
fn tools_of(task: &task::Task, count: usize, placed: Option<PyReadonlyArray3<'_, f32>>) -> Vec<Vec<Tool>> {
    let fixed: Vec<Tool> = task.tools.iter().map(ToolSpec::tool).collect();
    let mut scenes = vec![fixed; count];
    let Some(placed) = placed else { return scenes };
    for (scene, places) in scenes.iter_mut().zip(placed.as_array().outer_iter()) {
        let places = places.outer_iter().map(|place| [place[0], place[1]]);
        scene
            .extend(places.filter(|place| !place.iter().any(|value| value.is_nan())).map(|at| task.placeable.tool(at)));
    }
    scenes
}

/// The model that is a [`Model`], `"physics"`, `"rapier"`, or the name or path of a model.
pub fn any_model(model: &Bound<'_, PyAny>, task: &task::Task) -> PyResult<Arc<dyn RolloutModel>> {
    let learned = if let Ok(model) = model.cast::<Model>() {
        model.get().0.clone()
    } else if let Ok(name) = model.extract::<PathBuf>() {
        match &*name.to_string_lossy() {
            "physics" => return Ok(Arc::new(TruePhysics)),
            "rapier" => return Ok(Arc::new(RapierPhysics)),
            _ => Model::new(model.py(), name)?.0,
        }
    } else {
        return Err(PyTypeError::new_err(format!(
            "{} is not a model: use mge.Model, \"physics\", \"rapier\", or the name or path of a model",
            model.get_type().name()?
        )));
    };
    learned.check_task(task).map_err(exception)?;
    Ok(learned)
}

/// Rolls out sequences of actions in a model, in one batch.
///
/// `actions`: n x length x 2. `start`: one state for all sequences or one for each; by default the start
/// of the task. A rollout ends when it reaches the next stage after its start, when the ball leaves the
/// screen, or when the sequence or the episode ends. Entries after the end are NaN or False.
#[pyfunction]
#[pyo3(signature = (task, model, actions, start = None))]
pub fn rollout<'py>(
    py: Python<'py>,
    task: Task,
    model: &Bound<'py, PyAny>,
    actions: &Bound<'py, PyAny>,
    start: Option<&State>,
) -> PyResult<Bound<'py, PyDict>> {
    let actions: PyReadonlyArray3<'_, f32> = numbers(actions, "actions", "[n, length, 2]")?;
    let [count, length] = [actions.shape()[0], actions.shape()[1]];
    let actions = actions.as_array();
    let sequence = |rows: numpy::ndarray::ArrayView2<'_, f32>| rows.outer_iter().map(|row| [row[0], row[1]]).collect();
    let sequences: Vec<Vec<Action>> = actions.outer_iter().map(sequence).collect();
    let beginning = Environment::new(task.0.clone());
    let starts: Vec<&Snapshot> = match start {
        None => vec![beginning.snapshot(); count],
        Some(State(states)) if states.len() == 1 || states.len() == count => {
            if states.iter().any(|state| **state.task() != *task.0) {
                return Err(PyValueError::new_err("a state is one of another task"));
            }
            states.iter().cycle().take(count).map(|state| state.environment().snapshot()).collect()
        }
        Some(State(states)) => {
            return Err(PyValueError::new_err(format!("{} states for {count} sequences", states.len())));
        }
    };
    let model = any_model(model, &task.0)?;
    let rolled = work(py, |stop| model.rollouts(&starts, &sequences, stop))?.map_err(exception)?;
    arrays(py, &rolled, length)
}

fn arrays<'py>(py: Python<'py>, rolled: &[Rollout], length: usize) -> PyResult<Bound<'py, PyDict>> {
    let count = rolled.len();
    let path = rolled.iter().map(|rollout| rollout.path.len()).max().unwrap_or(0);
    let flags = |of: fn(&dynamics::RolloutAction) -> bool| {
        let of_each = rolled.iter().flat_map(|r| (0..length).map(move |n| r.actions.get(n).is_some_and(of)));
        PyArray1::from_iter(py, of_each).reshape([count, length])
    };
    let paths = rolled.iter().flat_map(|r| (0..path).map(move |n| r.path.get(n).copied().unwrap_or([f32::NAN; 2])));
    let balls = rolled.iter().flat_map(|r| (0..length).map(move |n| r.balls.get(n).map_or([f32::NAN; BALL], ball_row)));
    let dict = PyDict::new(py);
    dict.set_item("hit", PyArray1::from_iter(py, rolled.iter().map(|r| r.hit)))?;
    dict.set_item("length", PyArray1::from_iter(py, rolled.iter().map(|r| r.actions.len() as i64)))?;
    dict.set_item("placed", flags(|action| action.placed)?)?;
    dict.set_item("touched", flags(|action| action.touched)?)?;
    dict.set_item("path", rows(py, paths)?.reshape([count, path, 2])?)?;
    dict.set_item("balls", rows(py, balls)?.reshape([count, length, BALL])?)?;
    Ok(dict)
}

/// Names of the shipped models.
#[pyfunction]
pub fn model_names() -> Vec<&'static str> {
    dynamics::shipped_models().iter().map(|(name, _)| *name).collect()
}

/// Names of the tool types, indexed by their number in observations.
#[pyfunction]
pub fn tool_types() -> Vec<&'static str> {
    mge_physics::ToolKind::PAPER.map(mge_physics::ToolKind::name).to_vec()
}
