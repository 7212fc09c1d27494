//! States of environments, and their scenes.

use std::sync::Arc;

use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use super::arguments::whole;
use super::arrays::rows;
use super::error::exception;
use super::figures::Figure;
use super::pool::{pool_for, work_on};
use mge_env as env;
use mge_figures::{Moment, Mover};
use mge_physics::{BallState, PHYSICS_DT, to_normalised};
use mge_task::GoalShape;

/// Columns of a ball: x, y, velocity x, y, spin.
pub const BALL: usize = 5;

/// A ball as numbers: normalised position, velocity in units/s, spin in radians/s.
pub fn ball_row(ball: &BallState) -> [f32; BALL] {
    let ([x, y], [vx, vy]) = (to_normalised(ball.position), ball.velocity);
    [x, y, vx, vy, ball.angular_velocity]
}

/// The current scene; planks as they were placed.
pub fn scene(env: &env::Environment) -> Moment {
    let (mut task, now) = (env.task().as_ref().clone(), env.snapshot());
    let world = &now.world;
    // In the order of the world: the target, the marker, a goal that is a ball, then the others.
    let goal = (task.goal.shape == GoalShape::Ball).then_some(1 + usize::from(task.marker.is_some()));
    if let Some(goal) = goal {
        task.goal.position = to_normalised(world.ball(goal).position);
    }
    let mover = |index: usize| Mover {
        position: to_normalised(world.ball(index).position),
        radius: world.ball_material(index).radius,
        angle: world.is_box(index).then(|| world.ball(index).angle),
    };
    let movers = (1..world.ball_count()).filter(|index| Some(*index) != goal).map(mover).collect();
    Moment {
        time: now.actions as f32 * task.rules.steps_per_action as f32 * PHYSICS_DT,
        ball: to_normalised(now.ball().position),
        movers,
        placed: world.tools().skip(task.tools.len()).copied().collect(),
        reached: now.reached.iter().filter(|reached| **reached).count() + usize::from(now.goal_reached),
        task,
    }
}

/// States of one or several environments: episodes and random streams. Returned by an environment's
/// `get_state()`; can be pickled.
#[pyclass(module = "mge", frozen)]
pub struct State(pub Vec<env::State>);

#[pymethods]
impl State {
    /// The states from JSON, as written by `__reduce__`; `task` is the JSON of their task.
    #[staticmethod]
    fn parse(py: Python<'_>, task: &str, states: Vec<String>) -> PyResult<Self> {
        if states.is_empty() {
            return Ok(Self(Vec::new()));
        }
        let task = Arc::new(mge_task::parse(task, "state").map_err(exception)?);
        let parse = |text: &String| env::State::parse(text, &task);
        let states: Result<Vec<env::State>, _> = work_on(py, pool_for(states.len(), None)?.as_deref(), |stop| {
            stop.until(states.iter()).map(parse).collect()
        })?;
        states.map(Self).map_err(exception)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, index: &Bound<'_, PyAny>) -> PyResult<Self> {
        let missing = || PyIndexError::new_err(format!("there is no state {index}: there are {}", self.0.len()));
        let place: i128 = whole(index, "index of a state", i64::MIN.into()..=i64::MAX.into())?;
        let place = if place < 0 { place.saturating_add(self.0.len() as i128) } else { place };
        let state = usize::try_from(place).ok().and_then(|place| self.0.get(place));
        Ok(Self(vec![state.ok_or_else(missing)?.clone()]))
    }

    /// The scene of the first state as a figure.
    fn figure(&self) -> PyResult<Figure> {
        let first = self.0.first().ok_or_else(|| PyIndexError::new_err("there is no state"))?;
        Ok(Figure::new(scene(first.environment()), "State.figure()"))
    }

    /// Balls, one row per state: x, y (normalised), velocity x, y (units/s), spin (radians/s); float32.
    #[getter]
    fn balls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        rows(py, self.0.iter().map(|state| ball_row(&state.environment().snapshot().ball())))
    }

    fn __repr__(&self) -> String {
        let name = self.0.first().map_or("", |state| state.task().name.as_str());
        format!("<State of {} environments of {name}>", self.0.len())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, Vec<String>))> {
        let parse = py.get_type::<Self>().getattr("parse")?.unbind();
        let task = self.0.first().map_or_else(String::new, |state| mge_task::to_json(state.task()));
        let states = work_on(py, pool_for(self.0.len(), None)?.as_deref(), |stop| {
            stop.until(self.0.iter()).map(env::State::to_json).collect()
        })?;
        Ok((parse, (task, states)))
    }
}
