//! Environments stepped together, and their states.

use std::sync::Arc;

use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::error::{exception, vector_exception};
use super::pool::pool;
use super::task::Task;
use crate::env::{self, Action, ActionSet, Autoreset, Choice, EndReason, Info, Placement, VectorEnvironment};
use crate::figures::{Animation, Figure, Moment};
use crate::physics::{PHYSICS_DT, ToolSplit, to_normalised};

/// Fewer environments than these are stepped on the caller's thread: handing over would take longer.
const FEW: usize = 64;

/// What became of a tool, by its code; 0 is "not known yet".
const PLACEMENTS: [Placement; 5] =
    [Placement::Placed, Placement::Overlap, Placement::Collision, Placement::Invalid, Placement::NoOp];
/// Why an episode is over, by its code; 0 is "it is not".
const ENDS: [EndReason; 5] =
    [EndReason::Goal, EndReason::OutOfBounds, EndReason::MarkerOut, EndReason::Standstill, EndReason::MaxActions];

fn code<T: PartialEq>(of: &[T], value: Option<T>) -> u8 {
    // Fewer than 256 of each.
    value.and_then(|value| of.iter().position(|known| *known == value)).map_or(0, |place| place as u8 + 1)
}

/// The words for the codes of `placement` and `end`, as in `mge env serve`; None for code 0.
#[pyfunction]
pub fn words() -> [Vec<Option<String>>; 2] {
    fn names(values: &[impl serde::Serialize]) -> Vec<Option<String>> {
        let name = |value| serde_json::to_value(value).ok().and_then(|name| name.as_str().map(str::to_owned));
        std::iter::once(None).chain(values.iter().map(name)).collect()
    }
    [names(&PLACEMENTS), names(&ENDS)]
}

/// Facts about some episodes, as columns.
struct Facts {
    success: Py<PyArray1<bool>>,
    subgoals: Py<PyArray2<bool>>,
    placed: Py<PyArray1<i64>>,
    placement: Py<PyArray1<u8>>,
    end: Py<PyArray1<u8>>,
    /// Numbers of the tools in the action sets, where agents choose among tools.
    tools: Option<Py<PyArray2<i64>>>,
}

fn zeros<T: Element>(py: Python<'_>, count: usize) -> Py<PyArray1<T>> {
    PyArray1::zeros(py, count, false).unbind()
}

/// Writes one value for each row.
fn fill<T: Element>(py: Python<'_>, array: &Py<PyArray1<T>>, values: impl Iterator<Item = T>) -> PyResult<()> {
    let mut array = array.bind(py).try_readwrite()?;
    array.as_slice_mut()?.iter_mut().zip(values).for_each(|(slot, value)| *slot = value);
    Ok(())
}

impl Facts {
    fn new(py: Python<'_>, count: usize, env: &VectorEnvironment) -> Self {
        let tools = env.tool_count().map(|tools| PyArray2::zeros(py, [count, tools], false).unbind());
        Self {
            tools,
            success: zeros(py, count),
            subgoals: PyArray2::zeros(py, [count, env.task().subgoals.len()], false).unbind(),
            placed: zeros(py, count),
            placement: zeros(py, count),
            end: zeros(py, count),
        }
    }

    fn note<'a>(&self, py: Python<'_>, infos: impl Iterator<Item = &'a Info> + Clone) -> PyResult<()> {
        fill(py, &self.success, infos.clone().map(|info| info.goal))?;
        fill(py, &self.placed, infos.clone().map(|info| info.placed as i64))?;
        fill(py, &self.placement, infos.clone().map(|info| code(&PLACEMENTS, info.placement)))?;
        fill(py, &self.end, infos.clone().map(|info| code(&ENDS, info.end)))?;
        let mut subgoals = self.subgoals.bind(py).try_readwrite()?;
        let values = infos.flat_map(|info| info.subgoals.iter().copied());
        subgoals.as_slice_mut()?.iter_mut().zip(values).for_each(|(slot, value)| *slot = value);
        Ok(())
    }

    /// Notes the numbers of the tools in action sets.
    fn note_tools(&self, py: Python<'_>, numbers: impl Iterator<Item = usize>) -> PyResult<()> {
        let Some(tools) = &self.tools else { return Ok(()) };
        let mut tools = tools.bind(py).try_readwrite()?;
        tools.as_slice_mut()?.iter_mut().zip(numbers).for_each(|(slot, number)| *slot = number as i64);
        Ok(())
    }

    fn dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("is_success", &self.success)?;
        dict.set_item("subgoals", &self.subgoals)?;
        dict.set_item("placed", &self.placed)?;
        dict.set_item("placement", &self.placement)?;
        dict.set_item("end", &self.end)?;
        if let Some(tools) = &self.tools {
            dict.set_item("tools", tools)?;
        }
        Ok(dict)
    }
}

/// Environments of one task, with arrays that every reset and step writes anew.
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
    #[pyo3(signature = (task, count, autoreset, threads = None, tools = None))]
    fn new(
        py: Python<'_>,
        task: &Task,
        count: usize,
        autoreset: &str,
        threads: Option<usize>,
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
        if count == 0 || threads == Some(0) {
            return Err(PyValueError::new_err("the numbers of environments and of threads are at least 1"));
        }
        let tools: Option<ToolSplit> = tools.map(str::parse).transpose().map_err(PyValueError::new_err)?;
        let env = match tools {
            None => VectorEnvironment::new(task.0.clone(), count, autoreset),
            Some(tools) => VectorEnvironment::with_tools(task.0.clone(), tools, count, autoreset),
        };
        Ok(Self {
            threads,
            observations: PyArray2::zeros(py, [count, env.observation_len()], false).unbind(),
            rewards: zeros(py, count),
            terminated: zeros(py, count),
            truncated: zeros(py, count),
            facts: Facts::new(py, count, &env),
            env,
        })
    }

    /// Begins episodes, in all environments or in those of the mask.
    #[pyo3(signature = (seeds, mask = None))]
    fn reset(
        &mut self,
        py: Python<'_>,
        seeds: Vec<Option<u64>>,
        mask: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<()> {
        let count = self.env.count();
        if seeds.len() != count || mask.as_ref().is_some_and(|mask| mask.len() != count) {
            return Err(PyValueError::new_err(format!(
                "a seed and a place in the mask for each of {count} environments"
            )));
        }
        // A copy, because a mask need not be contiguous.
        let mask: Option<Vec<bool>> = mask.map(|mask| mask.as_array().to_vec());
        let mut observations = self.observations.bind(py).try_readwrite()?;
        self.env.reset(&seeds, mask.as_deref(), observations.as_slice_mut()?);
        drop(observations);
        self.note(py)
    }

    /// Tools among which an agent chooses; None if it has the task's own tool.
    #[getter]
    fn tool_count(&self) -> Option<usize> {
        self.env.tool_count()
    }

    /// Least and greatest values of an observation, float32.
    fn bounds<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray1<f32>>; 2] {
        self.env.observation_bounds().map(|bounds| bounds.into_pyarray(py))
    }

    /// The parts of an observation in order: their names and shapes.
    fn parts(&self) -> Vec<(&'static str, Vec<usize>)> {
        self.env.observation_parts().into_iter().map(|part| (part.name, part.shape)).collect()
    }

    /// One action in each environment: a place, and the index of a tool where agents choose.
    #[pyo3(signature = (places, tools = None))]
    fn step(
        &mut self,
        py: Python<'_>,
        places: PyReadonlyArray2<'_, f32>,
        tools: Option<PyReadonlyArray1<'_, i64>>,
    ) -> PyResult<()> {
        let count = self.env.count();
        if places.shape() != [count, 2] {
            let found = places.shape();
            return Err(PyValueError::new_err(format!(
                "the actions have the shape {found:?}, and should have [{count}, 2]"
            )));
        }
        let (places, _) = places.as_slice()?.as_chunks::<2>();
        match tools {
            None if self.env.tool_count().is_some() => {
                Err(PyValueError::new_err("an action needs the index of a tool beside the place"))
            }
            None => self.take(py, places),
            Some(_) if self.env.tool_count().is_none() => {
                Err(PyValueError::new_err("an action is a place alone: the task has one tool"))
            }
            Some(tools) => {
                let choices = choices(places, &tools.as_array().to_vec())?;
                self.take(py, &choices)
            }
        }
    }

    /// Seconds in which the library alone takes these actions, float32 of steps x count x 2: what
    /// `step` is measured against.
    fn time_alone(&mut self, py: Python<'_>, actions: PyReadonlyArray3<'_, f32>) -> PyResult<f64> {
        let count = self.env.count();
        if actions.shape()[1..] != [count, 2] {
            return Err(PyValueError::new_err(format!("the actions should have the shape [steps, {count}, 2]")));
        }
        let (actions, _) = actions.as_slice()?.as_chunks::<2>();
        let mut rows = vec![0.0; count * self.env.observation_len()];
        let pool = pool(self.threads)?;
        let is_alone = self.threads == Some(1) || count < FEW;
        let env = &mut self.env;
        let mut play = || {
            let start = std::time::Instant::now();
            for actions in actions.chunks(count) {
                if is_alone { env.step(actions, &mut rows)? } else { env.par_step(actions, &mut rows)? }
            }
            Ok(start.elapsed().as_secs_f64())
        };
        let played = py.detach(|| if is_alone { play() } else { pool.install(play) });
        played.map_err(|error| vector_exception(py, error))
    }

    /// The arrays of observations, rewards, terminations, truncations.
    fn arrays<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>)
    {
        let Self { observations, rewards, terminated, truncated, .. } = self;
        (
            observations.bind(py).clone(),
            rewards.bind(py).clone(),
            terminated.bind(py).clone(),
            truncated.bind(py).clone(),
        )
    }

    /// The arrays of facts, by name.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.facts.dict(py)
    }

    /// Of the episodes that the latest step ended and followed by the next: which environments, their
    /// last observations, the facts about them. None if there are none.
    fn ended<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyDict>)>> {
        let ended = || self.env.outcomes().filter_map(|outcome| outcome.ended.as_ref());
        let which: Vec<i64> = (0..)
            .zip(self.env.outcomes())
            .filter_map(|(index, outcome)| outcome.ended.is_some().then_some(index))
            .collect();
        if which.is_empty() {
            return Ok(None);
        }
        let rows: Vec<f32> = ended().flat_map(|ended| ended.observation.iter().copied()).collect();
        let rows = rows.into_pyarray(py).reshape([which.len(), self.env.observation_len()])?;
        let facts = Facts::new(py, which.len(), &self.env);
        facts.note(py, ended().map(|ended| &ended.info))?;
        facts.note_tools(py, ended().flat_map(|ended| ended.tools.iter().copied()))?;
        Ok(Some((which.into_pyarray(py), rows, facts.dict(py)?)))
    }

    /// The states of these environments.
    fn state(&self, py: Python<'_>, indices: Vec<usize>) -> PyResult<State> {
        let states: Result<Vec<env::State>, _> = indices.iter().map(|index| self.env.state(*index)).collect();
        states.map(State).map_err(|error| vector_exception(py, error))
    }

    /// Puts these environments into these states, or all into a single one.
    fn restore(&mut self, py: Python<'_>, indices: Vec<usize>, state: &State) -> PyResult<()> {
        if state.0.len() != 1 && state.0.len() != indices.len() {
            let (states, places) = (state.0.len(), indices.len());
            return Err(PyValueError::new_err(format!("{states} states cannot be those of {places} environments")));
        }
        if let Some(index) = indices.iter().find(|index| **index >= self.env.count()) {
            return Err(PyIndexError::new_err(format!("there is no environment {index}")));
        }
        let mut observations = self.observations.bind(py).try_readwrite()?;
        let rows = observations.as_slice_mut()?;
        let length = self.env.observation_len();
        for (index, state) in indices.iter().zip(state.0.iter().cycle()) {
            let row = &mut rows[index * length..][..length];
            self.env.restore(*index, state, row).map_err(|error| vector_exception(py, error))?;
        }
        drop(observations);
        self.note(py)
    }

    /// The scene of an environment as rows of pixels, uint8 of height x width x 3.
    fn render<'py>(
        &self,
        py: Python<'py>,
        index: usize,
        width: u32,
        height: u32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let env = self.env.environment(index).ok_or_else(|| PyIndexError::new_err("there is no such environment"))?;
        let scene = scene(env);
        let pixels = py.detach(|| scene.to_rgb(width, height)).map_err(exception)?;
        pixels.into_pyarray(py).reshape([height as usize, width as usize, 3])
    }
}

/// Tools and places together.
fn choices(places: &[Action], tools: &[i64]) -> PyResult<Vec<Choice>> {
    if tools.len() != places.len() {
        let (tools, places) = (tools.len(), places.len());
        return Err(PyValueError::new_err(format!("{tools} tools cannot be those of {places} environments")));
    }
    let choice = |(index, (place, tool)): (usize, (&Action, &i64))| match usize::try_from(*tool) {
        Ok(tool) => Ok(Choice { tool, place: *place }),
        Err(_) => Err(PyValueError::new_err(format!(
            "the action of environment {index} asks for tool {tool}: the first is 0"
        ))),
    };
    places.iter().zip(tools).enumerate().map(choice).collect()
}

impl VectorCore {
    /// Takes an action in each environment, while other threads of Python go on.
    fn take<A: Into<Choice> + Copy + Sync>(&mut self, py: Python<'_>, actions: &[A]) -> PyResult<()> {
        let mut observations = self.observations.bind(py).try_readwrite()?;
        let (rows, env) = (observations.as_slice_mut()?, &mut self.env);
        let stepped = if self.threads == Some(1) || actions.len() < FEW {
            py.detach(|| env.step(actions, rows))
        } else {
            let pool = pool(self.threads)?;
            py.detach(|| pool.install(|| env.par_step(actions, rows)))
        };
        stepped.map_err(|error| vector_exception(py, error))?;
        drop(observations);
        self.note(py)
    }

    /// Writes what the latest reset or step brought to the arrays.
    fn note(&mut self, py: Python<'_>) -> PyResult<()> {
        fill(py, &self.rewards, self.env.outcomes().map(|outcome| outcome.reward.into()))?;
        fill(py, &self.terminated, self.env.outcomes().map(|outcome| outcome.terminated))?;
        fill(py, &self.truncated, self.env.outcomes().map(|outcome| outcome.truncated))?;
        self.facts.note(py, self.env.outcomes().map(|outcome| &outcome.info))?;
        self.facts.note_tools(py, self.env.action_sets().flat_map(ActionSet::numbers))
    }
}

/// The scene as it is now.
pub fn scene(env: &env::Environment) -> Animation {
    let (task, now) = (env.task(), env.snapshot());
    let time = now.actions() as f32 * task.rules.steps_per_action as f32 * PHYSICS_DT;
    let reached = now.stage() + usize::from(now.goal_reached());
    let moment = Moment { time, ball: to_normalised(now.ball().position), placed: now.placed().to_vec(), reached };
    Animation { task: task.as_ref().clone(), moments: vec![moment], frame_ms: 0, trail: 0 }
}

/// States of one or several environments: episodes and random numbers. Made by `get_state()` of
/// an environment; can be pickled.
#[pyclass(module = "mge", frozen)]
pub struct State(pub Vec<env::State>);

#[pymethods]
impl State {
    /// The states that `to_json` wrote.
    #[staticmethod]
    fn parse(task: &str, states: Vec<String>) -> PyResult<Self> {
        let task = Arc::new(crate::task::parse(task, "state").map_err(exception)?);
        let states: Result<Vec<env::State>, _> = states.iter().map(|text| env::State::parse(text, &task)).collect();
        states.map(Self).map_err(exception)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, index: isize) -> PyResult<Self> {
        let place = if index < 0 { index + self.0.len() as isize } else { index };
        let state = usize::try_from(place).ok().and_then(|place| self.0.get(place));
        let state = state.ok_or_else(|| PyIndexError::new_err(format!("there is no state {index}")))?;
        Ok(Self(vec![state.clone()]))
    }

    /// The scenes as figures, for `save` and notebooks.
    fn figure(&self) -> PyResult<super::figures::Figure> {
        let first = self.0.first().ok_or_else(|| PyIndexError::new_err("there is no state"))?;
        Ok(super::figures::Figure::new(scene(first.environment()), "State.figure()"))
    }

    /// Balls, one row a state: x, y (normalised), velocity x, y (units/s), spin (radians/s); float32.
    #[getter]
    fn balls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let balls: Vec<f32> =
            self.0.iter().flat_map(|state| super::model::ball_row(&state.environment().snapshot().ball())).collect();
        balls.into_pyarray(py).reshape([self.0.len(), super::model::BALL])
    }

    fn __repr__(&self) -> String {
        let name = self.0.first().map_or("", |state| state.task().name.as_str());
        format!("<State of {} environments of {name}>", self.0.len())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, Vec<String>))> {
        let parse = py.get_type::<Self>().getattr("parse")?.unbind();
        let task = self.0.first().map_or_else(String::new, |state| crate::task::to_json(state.task()));
        Ok((parse, (task, self.0.iter().map(env::State::to_json).collect())))
    }
}
