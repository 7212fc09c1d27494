//! Action priors and trained actors.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::numbers;
use super::error::exception;
use super::figures::Figure;
use super::model::AnyModel;
use super::pool::work;
use super::task::Task;
use mge::agent::Ddpg;
use mge::figures::{ActionSamples, TaskActions};
use mge::guidance::{self, GuidanceConfig, StagePrior};
use mge::run::RunDirectory;
use mge::streams::Stream;
use mge::trainer::{RunConfig, saved_prior};
use mge::workbench::RunView;

/// Clusters of rewarding actions for every stage of a task: the distributions from which
/// guided exploration samples.
#[pyclass(module = "mge", frozen)]
pub struct ActionPrior(pub guidance::ActionPrior);

/// Builds the action prior of a task from rollouts in a model.
///
/// `model`: a `Model`, "physics", "rapier", the name or path of a model, or a Python object with an
/// `interval` (physics steps per prediction) and `advance(balls, tools)`, which returns the balls, float32 of n x 5
/// (x, y, velocity x, y, spin), one interval later, among tools, float32 of n x m x 8 (type, x, y,
/// size, angle, radius, elasticity, friction; NaN where a scene has fewer).
/// `settings`: JSON of the guidance settings that differ from their defaults.
#[pyfunction]
#[pyo3(signature = (task, model, seed = 0, settings = "{}"))]
pub fn build_prior(
    py: Python<'_>,
    task: &Task,
    model: &Bound<'_, PyAny>,
    seed: u64,
    settings: &str,
) -> PyResult<ActionPrior> {
    let config: GuidanceConfig = serde_json::from_str(settings).map_err(exception)?;
    config.validate().map_err(exception)?;
    let model = AnyModel::of(model, &task.0)?;
    model.used(py, |model| guidance::build(&task.0, model, &config, seed, |_| ())).map(ActionPrior)
}

#[pymethods]
impl ActionPrior {
    /// The prior from the text of a `prior.json`.
    #[staticmethod]
    #[pyo3(signature = (text, task, origin = "prior"))]
    fn parse(text: &str, task: &Task, origin: &str) -> PyResult<Self> {
        guidance::ActionPrior::parse(text, origin, &task.0).map(Self).map_err(exception)
    }

    /// The prior that a run used last.
    #[staticmethod]
    fn of_run(path: PathBuf) -> PyResult<Self> {
        let directory = RunDirectory::open(&path).map_err(exception)?;
        let config: RunConfig = directory.config().map_err(exception)?;
        let prior = saved_prior(&directory, &config.task).map_err(exception)?;
        prior.map(Self).ok_or_else(|| PyValueError::new_err(format!("the run {} has no action prior", path.display())))
    }

    /// The JSON text, as in a run's `prior.json`.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Name of the task.
    #[getter]
    fn task(&self) -> &str {
        &self.0.task
    }

    /// Name of the model that predicted the rollouts.
    #[getter]
    fn model(&self) -> &str {
        &self.0.model
    }

    /// Number of stages: subgoals, then the goal.
    fn __len__(&self) -> usize {
        self.0.stages.len()
    }

    /// The clusters of a stage, the largest first: arrays `mean` and `std` (k x 2, float32), `weight`
    /// and `count` (k).
    fn clusters<'py>(&self, py: Python<'py>, stage: usize) -> PyResult<Bound<'py, PyDict>> {
        let clusters = &self.stage(stage)?.clusters;
        let pairs = |values: Vec<[f32; 2]>| values.concat().into_pyarray(py).reshape([clusters.len(), 2]);
        let dict = PyDict::new(py);
        dict.set_item("mean", pairs(clusters.iter().map(|cluster| cluster.mean).collect())?)?;
        dict.set_item("std", pairs(clusters.iter().map(|cluster| cluster.std).collect())?)?;
        let weight: Vec<f32> = clusters.iter().map(|cluster| cluster.weight).collect();
        dict.set_item("weight", weight.into_pyarray(py))?;
        let count: Vec<i64> = clusters.iter().map(|cluster| cluster.count as i64).collect();
        dict.set_item("count", count.into_pyarray(py))?;
        Ok(dict)
    }

    /// The rewarding actions from which the clusters of a stage were computed, float32 of n x 2.
    fn actions<'py>(&self, py: Python<'py>, stage: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let actions = &self.stage(stage)?.actions;
        actions.concat().into_pyarray(py).reshape([actions.len(), 2])
    }

    /// Rollouts made for a stage and how many reached it, in the model; the same in the real environment.
    fn rollouts(&self, stage: usize) -> PyResult<[usize; 4]> {
        let stage = self.stage(stage)?;
        Ok([stage.model_rollouts, stage.model_hits, stage.environment_rollouts, stage.environment_hits])
    }

    /// Samples `count` actions for a stage, float32 of count x 2; uniformly if the stage has no clusters.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        stage: usize,
        count: usize,
        seed: u64,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let stage = self.stage(stage)?;
        let mut rng = Stream::Episode.of(seed);
        let actions: Vec<f32> = (0..count).flat_map(|_| stage.sample(&mut rng)).collect();
        actions.into_pyarray(py).reshape([count, 2])
    }

    fn __repr__(&self) -> String {
        format!("<ActionPrior of {} by {}, {} stages>", self.0.task, self.0.model, self.0.stages.len())
    }
}

impl ActionPrior {
    fn stage(&self, stage: usize) -> PyResult<&StagePrior> {
        let missing = || PyIndexError::new_err(format!("there is no stage {stage}: they are counted from 0"));
        self.0.stages.get(stage).ok_or_else(missing)
    }
}

/// Actor(run): the actor in the newest checkpoint of a run.
#[pyclass(module = "mge", frozen)]
pub struct Actor(Ddpg);

#[pymethods]
impl Actor {
    #[new]
    fn new(run: PathBuf) -> PyResult<Self> {
        let run = RunView::open(&run).map_err(exception)?;
        run.saved().agent().map(|(_, agent)| Self(agent)).map_err(exception)
    }

    /// The actions for observations: float32 of n x 2 for n x length.
    fn act<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let agent = &self.0;
        let observations: PyReadonlyArray2<'_, f32> = numbers(observations, "observations", "[n, length]")?;
        let [count, length] = [observations.shape()[0], observations.shape()[1]];
        if length != agent.observation_len() {
            let wanted = agent.observation_len();
            return Err(PyValueError::new_err(format!(
                "the observations have the shape [{count}, {length}], and should have [n, {wanted}]"
            )));
        }
        let observations: Vec<f32> = observations.as_array().iter().copied().collect();
        let actions = work(py, || agent.act(&observations))?;
        actions.into_pyarray(py).reshape([count, agent.action_len()])
    }

    /// The critic's values of pairs of observations and actions, float32 of n.
    fn values<'py>(
        &self,
        py: Python<'py>,
        observations: &Bound<'py, PyAny>,
        actions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, numpy::PyArray1<f32>>> {
        let agent = &self.0;
        let observations: PyReadonlyArray2<'_, f32> = numbers(observations, "observations", "[n, length]")?;
        let actions: PyReadonlyArray2<'_, f32> = numbers(actions, "actions", "[n, 2]")?;
        let count = observations.shape()[0];
        if observations.shape()[1] != agent.observation_len() || actions.shape() != [count, agent.action_len()] {
            let (s, a) = (observations.shape(), actions.shape());
            return Err(PyValueError::new_err(format!(
                "observations of the shape {s:?} and actions of {a:?} do not fit this agent"
            )));
        }
        let observations: Vec<f32> = observations.as_array().iter().copied().collect();
        let actions: Vec<f32> = actions.as_array().iter().copied().collect();
        Ok(work(py, || agent.q_values(&observations, &actions))?.into_pyarray(py))
    }
}

/// Actions drawn from the clusters of each stage, on the scene.
#[pyfunction]
#[pyo3(signature = (task, prior, seed = 0))]
pub fn figure_clusters(task: &Task, prior: &ActionPrior, seed: u64) -> Figure {
    let tasks = vec![TaskActions::sample(&task.0, &prior.0, seed)];
    Figure::new(ActionSamples { tasks }, "mge.figures.clusters()")
}
