//! Gymnasium's view of a task: reset, step, snapshot, restore.

use std::sync::Arc;

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::action::{EpisodeOver, Placement, Step};
use super::action_set::{ActionSet, Choice};
use super::description::{describe, description_bounds, description_parts};
use super::episode::Snapshot;
use super::observation::{ObservationPart, observation_bounds, observation_len, observation_parts, observe};
use mge_physics::{ToolSplit, World};
use mge_task::Task;

/// The random draws of a reset, from which the episode can be started again.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Start noise: shift of the ball, normalised.
    pub shift: [f32; 2],
    /// The drawn value of each of the task's random shifts, normalised.
    pub shifts: Vec<[f32; 2]>,
    /// Numbers of the tools in the action set, if one is drawn.
    pub tools: Vec<usize>,
}

/// A task being played.
///
/// The agent has either the task's own tool or an action set; see [`with_tools`](Self::with_tools).
#[derive(Debug, Clone)]
pub struct Environment {
    /// The task as loaded; that of `now` has its random shifts applied.
    loaded: Arc<Task>,
    start: Start,
    split: Option<ToolSplit>,
    /// The action set; None if the agent has the task's own tool.
    set: Option<ActionSet>,
    /// The start of every episode, if all start alike.
    first: Option<Arc<Snapshot>>,
    now: Snapshot,
}

impl Environment {
    /// An environment at the task's start without noise.
    pub fn new(task: Arc<Task>) -> Self {
        let now = Snapshot::new(task.clone(), [0.0; 2]);
        let first = task.shifts.is_empty().then(|| Arc::new(now.clone()));
        Self { loaded: task, start: Start::default(), split: None, set: None, first, now }
    }

    /// Gives the agent an action set of CREATE's tools. As in CREATE, every [`reset`](Self::reset) draws a new one:
    /// the no-op and 39 tools of the split. The set is empty before the first reset. Actions are then [`Choice`]s,
    /// and observations describe the set.
    /// None gives it the task's own tool.
    #[must_use]
    pub fn with_tools(self, split: impl Into<Option<ToolSplit>>) -> Self {
        let split = split.into();
        Self { split, set: split.map(|_| ActionSet::default()), ..self }
    }

    /// Gives the agent the same action set in every episode; None gives it the task's own tool.
    #[must_use]
    pub fn with_action_set(self, set: impl Into<Option<ActionSet>>) -> Self {
        Self { split: None, set: set.into(), ..self }
    }

    /// The split from which action sets are drawn, if they are drawn.
    pub fn split(&self) -> Option<ToolSplit> {
        self.split
    }

    /// The agent's action set; None if it has the task's own tool.
    pub fn action_set(&self) -> Option<&ActionSet> {
        self.set.as_ref()
    }

    /// The random draws of the current episode's reset.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// The task being played, with its random shifts applied.
    pub fn task(&self) -> &Arc<Task> {
        &self.now.task
    }

    /// The task as loaded, without random shifts; every reset begins from it.
    pub fn loaded_task(&self) -> &Arc<Task> {
        &self.loaded
    }

    /// Starts an episode and returns its first observation.
    pub fn reset(&mut self, rng: &mut impl Rng) -> Vec<f32> {
        let shifts = self.loaded.draw_shifts(rng);
        let tools = self.split.map_or(Vec::new(), |split| split.draw(rng));
        let noise = self.loaded.rules.start_noise;
        let shift = if noise > 0.0 { [0; 2].map(|_| rng.gen_range(-noise..=noise)) } else { [0.0; 2] };
        self.begin(Start { shift, shifts, tools });
        self.observation()
    }

    /// Starts an episode from the start of an earlier one of the same task.
    pub fn begin(&mut self, start: Start) {
        if self.split.is_some() {
            self.set = Some(ActionSet::of_catalogue(&start.tools));
        }
        match &self.first {
            // Reuses the previous episode's memory, which has the size needed.
            Some(first) if start.shift == [0.0; 2] => self.now.clone_from(first),
            _ if self.loaded.shifts.is_empty() => self.now = Snapshot::new(self.loaded.clone(), start.shift),
            _ => self.now = Snapshot::new(Arc::new(self.loaded.shifted(&start.shifts)), start.shift),
        }
        self.start = start;
    }

    /// The state of the episode.
    pub fn snapshot(&self) -> &Snapshot {
        &self.now
    }

    /// Continues from a snapshot of an environment of the same task.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.now.clone_from(snapshot);
    }

    /// The current observation: object vectors and the next stage or, for an agent with an action set, a description
    /// of the objects' properties, the progress and the tools. [`observation_parts`](Self::observation_parts) lists its
    /// parts.
    pub fn observation(&self) -> Vec<f32> {
        match &self.set {
            Some(set) => describe(&self.now, set),
            None => {
                let mut observation = vec![0.0; observation_len(self.task())];
                observe(&self.now, &mut observation);
                observation
            }
        }
    }

    /// Writes the current [`observation`](Self::observation) to `row`, which has exactly its length.
    pub fn write_observation(&self, row: &mut [f32]) {
        match &self.set {
            Some(set) => row.copy_from_slice(&describe(&self.now, set)),
            None => observe(&self.now, row),
        }
    }

    /// The parts of an observation, in order.
    pub fn observation_parts(&self) -> Vec<ObservationPart> {
        match &self.set {
            Some(_) => description_parts(self.task()),
            None => observation_parts(self.task()),
        }
    }

    /// Length of an observation.
    pub fn observation_len(&self) -> usize {
        self.observation_parts().iter().map(|part| part.shape.iter().product::<usize>()).sum()
    }

    /// Lower and upper bounds of observations; unbounded values are infinite.
    pub fn observation_bounds(&self) -> [Vec<f32>; 2] {
        match &self.set {
            Some(_) => description_bounds(self.task()),
            None => observation_bounds(self.task()),
        }
    }

    /// Places the tool that the action asks for, if it may be placed, then runs the world for one action interval.
    /// The no-op and an index outside the action set place nothing.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step(&mut self, action: impl Into<Choice>) -> Result<Step, EpisodeOver> {
        let mut step = self.step_without_observation(action)?;
        step.observation = self.observation();
        Ok(step)
    }

    /// Like [`Environment::step`], but leaves the observation empty, for callers that
    /// [write](Self::write_observation) it to their own row.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step_without_observation(&mut self, action: impl Into<Choice>) -> Result<Step, EpisodeOver> {
        self.step_watched(action, |_| {})
    }

    /// Like [`step_without_observation`](Self::step_without_observation), calling `watch` with the world after every
    /// physics step.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step_watched(
        &mut self,
        action: impl Into<Choice>,
        mut watch: impl FnMut(&World),
    ) -> Result<Step, EpisodeOver> {
        let mut step = self.begin_step(action.into())?;
        for _ in 0..self.task().rules.steps_per_action {
            self.now.advance(&mut step);
            watch(&self.now.world);
        }
        self.now.finish_action(&mut step);
        Ok(step)
    }

    /// The step right after the placement, before any physics.
    fn begin_step(&mut self, Choice { tool, place }: Choice) -> Result<Step, EpisodeOver> {
        if self.now.end().is_some() {
            return Err(EpisodeOver);
        }
        let placement = match &self.set {
            None if tool == 0 => self.now.place(place),
            None => Placement::Invalid,
            Some(set) => match set.get(tool) {
                None => Placement::Invalid,
                Some(None) => Placement::NoOp,
                Some(Some(tool)) => self.now.place_tool(tool, place),
            },
        };
        let is_free = matches!(placement, Placement::Placed | Placement::NoOp);
        let rewards = &self.task().rules.rewards;
        let blocked = if is_free { 0.0 } else { rewards.blocked };
        Ok(Step {
            observation: Vec::new(),
            reward: rewards.step + blocked,
            terminated: false,
            truncated: false,
            end: None,
            placement,
            subgoals: Vec::new(),
            goal: false,
            touched: Vec::new(),
        })
    }

    /// An action after which the ball has this state, instead of that which the world gives it.
    #[cfg(test)]
    pub(super) fn step_to(&mut self, action: impl Into<Choice>, ball: mge_physics::BallState) -> Step {
        let mut step = self.begin_step(action.into()).unwrap();
        self.now.set_ball(ball);
        self.now.finish_action(&mut step);
        step.observation = self.observation();
        step
    }
}
