//! Action priors and trained actors.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use super::arguments::{self, count, numbers, room, seed, stage};
use super::arrays::rows;
use super::error::exception;
use super::figures::Figure;
use super::model::any_model;
use super::pool::{abandonable, pool_for, work, work_on};
use super::task::Task;
use mge_agent::Ddpg;
use mge_base::streams::Stream;
use mge_figures::{ActionSamples, TaskActions};
use mge_guidance::{self as guidance, GuidanceConfig, StagePrior};
use mge_run::RunDirectory;
use mge_task as task;
use mge_trainer::{RunConfig, saved_prior};
use mge_workbench::RunView;

/// Clusters of rewarding actions for every stage of a task: the distributions from which
/// guided exploration samples.
#[pyclass(module = "mge", frozen)]
pub struct ActionPrior {
    prior: guidance::ActionPrior,
    task: Arc<task::Task>,
}

/// Builds the action prior of a task from rollouts in a model.
///
/// `model`: a `Model`, "physics", "rapier", or the name or path of a model.
/// `settings`: those of `guidance` that differ from their defaults, such as `model_rollouts=1000`.
#[pyfunction]
#[pyo3(signature = (task, model, seed = 0, **settings))]
pub fn build_prior(
    py: Python<'_>,
    task: Task,
    model: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = seed)] seed: u64,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<ActionPrior> {
    let settings = settings.map_or(Ok(json!({})), |settings| arguments::json(settings, "settings"))?;
    let config: GuidanceConfig = serde_json::from_value(settings).map_err(exception)?;
    config.validate().map_err(exception)?;
    let model = any_model(model, &task.0)?;
    let built = work(py, |stop| guidance::build(&task.0, &*model, &config, seed, stop, |_| ()))?;
    let prior = built.map_err(exception)?;
    Ok(ActionPrior { prior, task: task.0 })
}

#[pymethods]
impl ActionPrior {
    /// The prior from the text of a `prior.json`.
    #[staticmethod]
    #[pyo3(signature = (text, task, origin = "prior"))]
    fn parse(text: &str, task: Task, origin: &str) -> PyResult<Self> {
        let prior = guidance::ActionPrior::parse(text, origin, &task.0).map_err(exception)?;
        Ok(Self { prior, task: task.0 })
    }

    /// The prior that a run used last.
    #[staticmethod]
    fn of_run(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let missing = format!("the run {} has no action prior", path.display());
        let read = move || -> PyResult<_> {
            let directory = RunDirectory::open(path).map_err(exception)?;
            let config = RunConfig::of(&directory).map_err(exception)?;
            let prior = saved_prior(&directory, &config.task).map_err(exception)?;
            Ok(prior.map(|prior| Self { prior, task: config.task }))
        };
        abandonable(py, read)??.ok_or_else(|| PyValueError::new_err(missing))
    }

    /// The JSON text, as in a run's `prior.json`.
    fn to_json(&self) -> String {
        self.prior.to_json()
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, Task))> {
        Ok((py.get_type::<Self>().getattr("parse")?.unbind(), (self.to_json(), Task(self.task.clone()))))
    }

    /// Name of the task.
    #[getter]
    fn task(&self) -> &str {
        &self.prior.task
    }

    /// Name of the model that predicted the rollouts.
    #[getter]
    fn model(&self) -> &str {
        &self.prior.model
    }

    /// Number of stages: subgoals, then the goal.
    fn __len__(&self) -> usize {
        self.prior.stages.len()
    }

    /// The clusters of a stage, the largest first: arrays `mean` and `std` (k x 2, float32), `weight`
    /// and `count` (k).
    fn clusters<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = stage)] stage: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let clusters = &self.stage(stage)?.clusters;
        let dict = PyDict::new(py);
        dict.set_item("mean", rows(py, clusters.iter().map(|cluster| cluster.mean))?)?;
        dict.set_item("std", rows(py, clusters.iter().map(|cluster| cluster.std))?)?;
        dict.set_item("weight", PyArray1::from_iter(py, clusters.iter().map(|cluster| cluster.weight)))?;
        dict.set_item("count", PyArray1::from_iter(py, clusters.iter().map(|cluster| cluster.count as i64)))?;
        Ok(dict)
    }

    /// Samples `count` actions for a stage, float32 of count x 2; uniformly if the stage has no clusters.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = stage)] stage: usize,
        #[pyo3(from_py_with = count)] count: usize,
        #[pyo3(from_py_with = seed)] seed: u64,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let stage = self.stage(stage)?;
        let mut rng = Stream::Episode.of(seed);
        let mut actions = room(count.saturating_mul(2))?;
        let actions: Vec<f32> = work_on(py, pool_for(count, None)?.as_deref(), |stop| {
            actions.extend(stop.until(0..count).flat_map(|_| stage.sample(&mut rng)));
            actions
        })?;
        actions.into_pyarray(py).reshape([count, 2])
    }

    fn __repr__(&self) -> String {
        format!("<ActionPrior of {} by {}, {} stages>", self.prior.task, self.prior.model, self.prior.stages.len())
    }
}

impl ActionPrior {
    fn stage(&self, stage: usize) -> PyResult<&StagePrior> {
        let missing = || PyIndexError::new_err(format!("there is no stage {stage}: they are counted from 0"));
        self.prior.stages.get(stage).ok_or_else(missing)
    }
}

/// Actor(run): the actor in the newest checkpoint of a run.
#[pyclass(module = "mge", frozen)]
pub struct Actor(Ddpg);

#[pymethods]
impl Actor {
    #[new]
    fn new(py: Python<'_>, run: PathBuf) -> PyResult<Self> {
        let read = move || RunView::open(&run).map_err(exception)?.saved.agent().map_err(exception);
        abandonable(py, read)?.map(|(_, agent)| Self(agent))
    }

    /// The actions for observations: float32 of n x 2 for n x length.
    fn act<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let agent = &self.0;
        let observations = self.observations(observations)?;
        let count = observations.shape()[0];
        let rows = observations.as_slice()?.chunks(AT_ONCE * agent.observation_len());
        let actions = work(py, |stop| stop.until(rows).flat_map(|rows| agent.act(rows)).collect())?;
        Vec::into_pyarray(actions, py).reshape([count, agent.action_len()])
    }

    /// The critic's values of pairs of observations and actions, float32 of n.
    fn values<'py>(
        &self,
        py: Python<'py>,
        observations: &Bound<'py, PyAny>,
        actions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let agent = &self.0;
        let observations = self.observations(observations)?;
        let wanted = format!("[{}, {}]", observations.shape()[0], agent.action_len());
        let actions: PyReadonlyArray2<'_, f32> = numbers(actions, "actions", &wanted)?;
        let rows = observations.as_slice()?.chunks(AT_ONCE * agent.observation_len());
        let pairs = rows.zip(actions.as_slice()?.chunks(AT_ONCE * agent.action_len()));
        let values = work(py, |stop| stop.until(pairs).flat_map(|(o, a)| agent.q_values(o, a)).collect())?;
        Ok(Vec::into_pyarray(values, py))
    }

    fn __repr__(&self) -> String {
        format!("<Actor: {} numbers to {}>", self.0.observation_len(), self.0.action_len())
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err(
            "an actor cannot be pickled: give the path of its run, and open it with mge.Actor there",
        ))
    }
}

impl Actor {
    fn observations<'py>(&self, values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray2<'py, f32>> {
        numbers(values, "observations", &format!("[n, {}]", self.0.observation_len()))
    }
}

/// Number of observations that networks evaluate between two looks at the stop request.
const AT_ONCE: usize = 256;

/// Actions drawn from the clusters of each stage, on the scene.
#[pyfunction]
#[pyo3(signature = (task, prior, seed = 0))]
pub fn figure_clusters(task: Task, prior: &ActionPrior, #[pyo3(from_py_with = seed)] seed: u64) -> Figure {
    let tasks = vec![TaskActions::sample(&task.0, &prior.prior, seed)];
    Figure::new(ActionSamples { tasks }, "mge.figures.clusters()")
}
