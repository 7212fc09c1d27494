//! Dynamics models, including those written in Python: predictions and rollouts as arrays.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::arguments::{numbers, numbers_or_nan, steps};
use super::arrays::rows;
use super::error::exception;
use super::pool::{Caller, abandonable, build, work, work_on};
use super::state::{BALL, State, ball_row};
use super::task::Task;
use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, DynamicsError, Predictor, Rollout, rollouts};
use mge_env::{Action, Environment, Snapshot};
use mge_guidance::{RapierPhysics, RolloutModel, TruePhysics};
use mge_physics::{BallState, Tool, to_normalised, to_units};
use mge_task::{self as task, ToolSpec};

/// Number of balls predicted between two looks at the stop request.
const AT_ONCE: usize = 1024;
/// Columns of a tool: type, x, y, size, angle, radius, elasticity, friction.
const TOOL: usize = 8;

fn ball_of(row: &[f32]) -> BallState {
    BallState {
        position: to_units([row[0], row[1]]),
        velocity: [row[2], row[3]],
        angular_velocity: row[4],
        ..BallState::default()
    }
}

fn tool_row(tool: &Tool) -> [f32; TOOL] {
    let [x, y] = to_normalised(tool.centre());
    let [size, angle, radius] = [tool.size, tool.angle, tool.radius].map(|value| value as f32);
    [tool.kind.index() as f32, x, y, size, angle, radius, tool.elasticity as f32, tool.friction as f32]
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
        serde_json::json!(self.0.provenance()).to_string()
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
        let mut states = balls_of(&numbers(balls, "balls", "[n, 5]")?);
        let wanted = format!("[{}, m, 2]", states.len());
        let placed = placed.map(|placed| numbers_or_nan(&placed, "placed", &wanted)).transpose()?;
        let tools = tools_of(&task.0, states.len(), placed);
        let tools: Vec<&[Tool]> = tools.iter().map(Vec::as_slice).collect();
        let predicted = work(py, |caller| -> Result<Vec<BallState>, DynamicsError> {
            for (balls, tools) in states.chunks_mut(AT_ONCE).zip(tools.chunks(AT_ONCE)) {
                for _ in 0..steps {
                    caller.stop().check()?;
                    balls.copy_from_slice(&model.advance(balls, tools)?);
                }
            }
            Ok(states)
        })?;
        ball_array(py, &predicted.map_err(exception)?)
    }

    fn __repr__(&self) -> String {
        format!("Model({:?})", self.0.name())
    }
}

fn balls_of(balls: &PyReadonlyArray2<'_, f32>) -> Vec<BallState> {
    balls.as_array().outer_iter().map(|row| ball_of(&row.to_vec())).collect()
}

fn ball_array<'py>(py: Python<'py>, balls: &[BallState]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    rows(py, balls.iter().map(ball_row))
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

/// Any model that predicts rollouts.
pub enum AnyModel {
    Learned(Arc<dynamics::Model>),
    Physics,
    Rapier,
    Python(Arc<PythonModel>),
}

impl AnyModel {
    /// Converts a [`Model`], `"physics"`, `"rapier"`, the name or path of a model, or an object with `interval`
    /// and `advance(balls, tools)`.
    pub fn of(model: &Bound<'_, PyAny>, task: &task::Task) -> PyResult<Self> {
        let learned = if let Ok(model) = model.cast::<Model>() {
            model.get().0.clone()
        } else if let Ok(name) = model.extract::<PathBuf>() {
            match &*name.to_string_lossy() {
                "physics" => return Ok(Self::Physics),
                "rapier" => return Ok(Self::Rapier),
                _ => Model::new(model.py(), name)?.0,
            }
        } else {
            return PythonModel::of(model, task).map(Arc::new).map(Self::Python);
        };
        learned.check_task(task).map_err(exception)?;
        Ok(Self::Learned(learned))
    }

    /// Runs `using` with this model on a pool, without holding the GIL. An exception raised by a model in Python is
    /// returned unchanged.
    pub fn used<T: Send>(
        &self,
        py: Python<'_>,
        using: impl FnOnce(&dyn RolloutModel, &Stop) -> Result<T, DynamicsError> + Send,
    ) -> PyResult<T> {
        let model: &dyn RolloutModel = match self {
            Self::Learned(model) => &**model,
            Self::Physics => &TruePhysics,
            Self::Rapier => &RapierPhysics,
            Self::Python(model) => return model.used(py, using),
        };
        work(py, |caller| using(model, caller.stop()))?.map_err(exception)
    }
}

/// A model that is a Python object.
pub struct PythonModel {
    object: Py<PyAny>,
    name: String,
    interval: u32,
}

/// A use of a model that is a Python object.
struct Asked<'a> {
    model: &'a Arc<PythonModel>,
    caller: &'a Caller,
    /// The exception that the model raised.
    raised: &'a Mutex<Option<PyErr>>,
}

impl std::fmt::Debug for Asked<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Asked({})", self.model.name)
    }
}

impl PythonModel {
    fn of(object: &Bound<'_, PyAny>, task: &task::Task) -> PyResult<Self> {
        if !object.hasattr("advance")? || !object.hasattr("interval")? {
            let kind = object.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "{kind} is not a model: use mge.Model, \"physics\", \"rapier\", the name or path of a model, or an object with `interval` and `advance(balls, tools)`"
            )));
        }
        let interval: u32 = object.getattr("interval")?.extract()?;
        let action = task.rules.steps_per_action;
        if interval == 0 || !action.is_multiple_of(interval) {
            return Err(PyValueError::new_err(format!(
                "the model's interval is {interval}, and should divide the {action} physics steps of an action"
            )));
        }
        let name = object.get_type().name()?.to_string();
        Ok(Self { object: object.clone().unbind(), name, interval })
    }

    fn used<T: Send>(
        self: &Arc<Self>,
        py: Python<'_>,
        using: impl FnOnce(&dyn RolloutModel, &Stop) -> Result<T, DynamicsError> + Send,
    ) -> PyResult<T> {
        let raised = Mutex::new(None);
        // Threads of its own: `advance` may itself wait for work in the shared pool.
        let result = work_on(py, Some(&*build(0)?), |caller| {
            using(&Asked { model: self, caller, raised: &raised }, caller.stop())
        })?;
        match raised.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(raised) => Err(raised),
            None => result.map_err(exception),
        }
    }

    /// The answer of `advance` for balls among tools, of which `tools` has the rows, equally many for each ball.
    fn ask(&self, py: Python<'_>, balls: &[BallState], tools: Vec<f32>) -> PyResult<Vec<BallState>> {
        let most = tools.len() / TOOL / balls.len();
        let tools = tools.into_pyarray(py).reshape([balls.len(), most, TOOL])?;
        let answer = self.object.bind(py).call_method1("advance", (ball_array(py, balls)?, tools))?;
        Ok(balls_of(&numbers(&answer, "advance(...)", &format!("[{}, {BALL}]", balls.len()))?))
    }
}

impl Predictor for Asked<'_> {
    fn interval(&self) -> u32 {
        self.model.interval
    }

    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>, DynamicsError> {
        if balls.is_empty() {
            return Ok(Vec::new());
        }
        let most = tools.iter().map(|tools| tools.len()).max().unwrap_or(0);
        let mut values = vec![f32::NAN; balls.len() * most * TOOL];
        for (scene, tools) in tools.iter().enumerate() {
            for (place, tool) in tools.iter().enumerate() {
                values[(scene * most + place) * TOOL..][..TOOL].copy_from_slice(&tool_row(tool));
            }
        }
        let (model, balls) = (self.model.clone(), balls.to_vec());
        let answer = self.caller.call(move |py| model.ask(py, &balls, values)).ok_or(DynamicsError::Stopped)?;
        answer.map_err(|error| {
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            DynamicsError::Stopped
        })
    }
}

impl RolloutModel for Asked<'_> {
    fn name(&self) -> String {
        self.model.name.clone()
    }

    fn rollouts(
        &self,
        starts: &[&Snapshot],
        sequences: &[Vec<Action>],
        stop: &Stop,
    ) -> Result<Vec<Rollout>, DynamicsError> {
        rollouts(self, starts, sequences, stop)
    }
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
    let model = AnyModel::of(model, &task.0)?;
    let rolled = model.used(py, |model, stop| model.rollouts(&starts, &sequences, stop))?;
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

/// Names of the tool types, indexed by their number in observations and in `advance`.
#[pyfunction]
pub fn tool_types() -> Vec<&'static str> {
    mge_physics::ToolKind::PAPER.map(mge_physics::ToolKind::name).to_vec()
}
