//! Vectors of environments.

use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arguments::{num_envs, num_threads, room};
use super::arrays::{fill, zeros};
use super::error::{exception, vector_exception};
use super::facts::Facts;
use super::pool::{abandonable, pool_for, work_on};
use super::state::{State, scene};
use super::task::Task;
use mge_base::stop::Stop;
use mge_env::{self as env, Action, ActionSet, Autoreset, Choice, Environment, VectorEnvironment, VectorError};
use mge_figures::Figure;
use mge_physics::ToolSplit;

/// Memory of an environment without its observation, in bytes.
const ENVIRONMENT: usize = 4096;

/// Ended episodes: indices of their environments, last observations, facts.
type Ended<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyDict>);

/// Environments of one task, with arrays that every reset and step overwrites.
#[pyclass(module = "mge._mge")]
pub struct VectorCore {
    env: VectorEnvironment,
    threads: Option<usize>,
    observations: Py<PyArray2<f32>>,
    rewards: Py<PyArray1<f64>>,
    terminated: Py<PyArray1<bool>>,
    truncated: Py<PyArray1<bool>>,
    facts: Facts,
}

#[pymethods]
impl VectorCore {
    #[new]
    #[pyo3(signature = (task, num_envs, autoreset, num_threads = None, tools = None))]
    fn new(
        py: Python<'_>,
        task: Task,
        #[pyo3(from_py_with = num_envs)] num_envs: usize,
        autoreset: &str,
        #[pyo3(from_py_with = num_threads)] num_threads: Option<usize>,
        tools: Option<&str>,
    ) -> PyResult<Self> {
        let autoreset = match autoreset {
            "NextStep" => Autoreset::NextStep,
            "SameStep" => Autoreset::SameStep,
            "Disabled" => Autoreset::Disabled,
            other => {
                let known = "`NextStep`, `SameStep` or `Disabled`";
                return Err(PyValueError::new_err(format!("there is no autoreset mode `{other}`: use {known}")));
            }
        };
        let tools: Option<ToolSplit> = tools.map(str::parse).transpose().map_err(PyValueError::new_err)?;
        drop(room::<u8>(num_envs.saturating_mul(ENVIRONMENT))?);
        let env = VectorEnvironment::new(Environment::new(task.0).with_tools(tools), num_envs, autoreset);
        Ok(Self {
            threads: num_threads,
            observations: PyArray2::zeros(py, [num_envs, env.observation_len()], false).unbind(),
            rewards: zeros(py, num_envs),
            terminated: zeros(py, num_envs),
            truncated: zeros(py, num_envs),
            facts: Facts::new(py, num_envs, &env),
            env,
        })
    }

    /// Begins episodes in all environments or in the masked ones.
    #[pyo3(signature = (seeds, mask = None))]
    fn reset(slf: &Bound<'_, Self>, seeds: Vec<Option<u64>>, mask: Option<PyReadonlyArray1<'_, bool>>) -> PyResult<()> {
        let (py, this) = (slf.py(), &mut *alone(slf)?);
        let count = this.env.count();
        if seeds.len() != count || mask.as_ref().is_some_and(|mask| mask.len() != count) {
            return Err(PyValueError::new_err(format!(
                "a seed and a place in the mask for each of {count} environments"
            )));
        }
        // A copy, because a mask need not be contiguous.
        let mask: Option<Vec<bool>> = mask.map(|mask| mask.as_array().to_vec());
        this.change(py, count, |env, rows, _| {
            env.reset(&seeds, mask.as_deref(), rows);
            Ok(())
        })
    }

    /// Number of tools an agent chooses among; None if it has only the task's own tool.
    #[getter]
    fn tool_count(&self) -> Option<usize> {
        self.env.tool_count()
    }

    /// Lower and upper bounds of an observation, float32.
    fn bounds<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray1<f32>>; 2] {
        self.env.template().observation_bounds().map(|bounds| bounds.into_pyarray(py))
    }

    /// The parts of an observation in order: their names and shapes.
    fn parts(&self) -> Vec<(&'static str, Vec<usize>)> {
        self.env.template().observation_parts().into_iter().map(|part| (part.name, part.shape)).collect()
    }

    /// Takes one action in each environment: a place and, where agents choose tools, the index of a tool. The package
    /// has checked that there is one for each environment.
    #[pyo3(signature = (places, tools = None))]
    fn step(
        slf: &Bound<'_, Self>,
        places: PyReadonlyArray2<'_, f32>,
        tools: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<()> {
        let (py, this) = (slf.py(), &mut *alone(slf)?);
        let (places, _) = places.as_slice()?.as_chunks::<2>();
        match tools {
            None => this.take(py, places),
            Some(tools) => this.take(py, &choices(places, &tools.as_array().to_vec())?),
        }
    }

    /// The arrays of observations, rewards, terminations, truncations.
    fn arrays(&self, py: Python<'_>) -> (Py<PyArray2<f32>>, Py<PyArray1<f64>>, Py<PyArray1<bool>>, Py<PyArray1<bool>>) {
        let Self { observations, rewards, terminated, truncated, .. } = self;
        (observations.clone_ref(py), rewards.clone_ref(py), terminated.clone_ref(py), truncated.clone_ref(py))
    }

    /// The arrays of facts, by name.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.facts.dict(py)
    }

    /// The episodes that the latest step ended and replaced (autoreset): their environments, last
    /// observations, and facts. None if there are none.
    fn ended<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Ended<'py>>> {
        let (py, this) = (slf.py(), alone(slf)?);
        let ended = || this.env.outcomes().filter_map(|outcome| outcome.ended.as_ref());
        let which: Vec<i64> = (0..)
            .zip(this.env.outcomes())
            .filter_map(|(index, outcome)| outcome.ended.is_some().then_some(index))
            .collect();
        if which.is_empty() {
            return Ok(None);
        }
        let rows: Vec<f32> = ended().flat_map(|ended| ended.observation.iter().copied()).collect();
        let rows = rows.into_pyarray(py).reshape([which.len(), this.env.observation_len()])?;
        let facts = Facts::new(py, which.len(), &this.env);
        facts.write(py, ended().map(|ended| &ended.info))?;
        facts.write_tools(py, ended().flat_map(|ended| ended.tools.iter().copied()))?;
        Ok(Some((which.into_pyarray(py), rows, facts.dict(py)?)))
    }

    /// The states of these environments.
    fn state(slf: &Bound<'_, Self>, indices: Vec<usize>) -> PyResult<State> {
        let (py, this) = (slf.py(), alone(slf)?);
        let env = &this.env;
        let states: Result<Vec<env::State>, _> = work_on(py, pool_for(indices.len(), None)?.as_deref(), |stop| {
            stop.until(indices.iter()).map(|index| env.state(*index)).collect()
        })?;
        states.map(State).map_err(|error| vector_exception(py, error))
    }

    /// Puts these environments, whose indices the package has checked, into these states, or all into a single state.
    fn restore(slf: &Bound<'_, Self>, indices: Vec<usize>, state: &State) -> PyResult<()> {
        let (py, this) = (slf.py(), &mut *alone(slf)?);
        if state.0.len() != 1 && state.0.len() != indices.len() {
            let (states, places) = (state.0.len(), indices.len());
            return Err(PyValueError::new_err(format!("{states} states cannot be those of {places} environments")));
        }
        let length = this.env.observation_len();
        let pairs = indices.iter().zip(state.0.iter().cycle());
        this.change(py, indices.len(), |env, rows, stop| {
            let mut pairs = stop.until(pairs);
            pairs.try_for_each(|(index, state)| env.restore(*index, state, &mut rows[index * length..][..length]))
        })
    }

    /// The scene of an environment as rows of pixels, uint8 of height x width x 3.
    fn render<'py>(
        slf: &Bound<'py, Self>,
        index: usize,
        width: u32,
        height: u32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let (py, this) = (slf.py(), alone(slf)?);
        let env = this.env.environment(index).ok_or_else(|| PyIndexError::new_err("there is no such environment"))?;
        let scene = scene(env);
        let pixels = abandonable(py, move || scene.to_rgb(width, height))?.map_err(exception)?;
        pixels.into_pyarray(py).reshape([height as usize, width as usize, 3])
    }
}

/// Borrows the environments, unless another Python thread is using them.
fn alone<'py>(core: &Bound<'py, VectorCore>) -> PyResult<PyRefMut<'py, VectorCore>> {
    let hint = "another thread is using these environments: give each thread its own, or take turns with a lock";
    core.try_borrow_mut().map_err(|_| PyRuntimeError::new_err(hint))
}

/// Combines tools and places.
fn choices(places: &[Action], tools: &[i64]) -> PyResult<Vec<Choice>> {
    let choice = |(index, (place, tool)): (usize, (&Action, &i64))| match usize::try_from(*tool) {
        Ok(tool) => Ok(Choice { tool, place: *place }),
        Err(_) => Err(PyValueError::new_err(format!(
            "the action of environment {index} asks for tool {tool}: the first is 0"
        ))),
    };
    places.iter().zip(tools).enumerate().map(choice).collect()
}

impl VectorCore {
    /// Takes an action in each environment.
    fn take<A: Into<Choice> + Copy + Sync>(&mut self, py: Python<'_>, actions: &[A]) -> PyResult<()> {
        self.change(py, actions.len(), |env, rows, _| env.step(actions, rows))
    }

    /// Changes environments and their observations `times` times without holding the GIL, then all arrays. After a
    /// signal, which may leave some environments changed and others not, all need a reset.
    fn change(
        &mut self,
        py: Python<'_>,
        times: usize,
        change: impl FnOnce(&mut VectorEnvironment, &mut [f32], &Stop) -> Result<(), VectorError> + Send,
    ) -> PyResult<()> {
        let pool = pool_for(times.max(self.env.count()), self.threads)?;
        let mut observations = self.observations.bind(py).try_readwrite()?;
        let (rows, env) = (observations.as_slice_mut()?, &mut self.env);
        let changed = work_on(py, pool.as_deref(), |stop| {
            env.stop_on(stop);
            change(env, rows, stop)
        });
        drop(observations);
        match changed {
            Err(signal) => {
                self.env.forget_episodes();
                Err(signal)
            }
            Ok(changed) => {
                changed.map_err(|error| vector_exception(py, error))?;
                self.write_results(py)
            }
        }
    }

    /// Writes the results of the latest reset or step to the arrays.
    fn write_results(&mut self, py: Python<'_>) -> PyResult<()> {
        fill(py, &self.rewards, self.env.outcomes().map(|outcome| outcome.reward.into()))?;
        fill(py, &self.terminated, self.env.outcomes().map(|outcome| outcome.terminated))?;
        fill(py, &self.truncated, self.env.outcomes().map(|outcome| outcome.truncated))?;
        self.facts.write(py, self.env.outcomes().map(|outcome| &outcome.info))?;
        self.facts.write_tools(py, self.env.action_sets().flat_map(ActionSet::numbers))
    }
}
