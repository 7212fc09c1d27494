//! One episode of a task: placements, physics, stages reached, reward, end.

use std::sync::Arc;

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::observation::observe;
use crate::physics::{Ball, BallState, ObjectId, SCREEN, Sensor, Tool, World, to_normalised, to_units};
use crate::task::{GoalShape, SubgoalCheck, Task};

/// A tool placement: normalised x and y in [-1, 1].
pub type Action = [f32; 2];

/// What became of an action's tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// It stands in the scene.
    Placed,
    /// Too near a tool placed earlier in the episode.
    Overlap,
    /// Its shape would touch something.
    Collision,
    /// The action is not a pair of finite numbers.
    Invalid,
}

/// Why an episode is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndReason {
    /// The goal was reached (terminated).
    Goal,
    /// The target ball's centre left the screen (terminated).
    OutOfBounds,
    /// The marker ball left the screen before the target moved (terminated).
    MarkerOut,
    /// Nothing moves any more (terminated).
    Standstill,
    /// The limit of actions was reached (truncated).
    MaxActions,
}

impl std::fmt::Display for EndReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Goal => "goal",
            Self::OutOfBounds => "left the screen",
            Self::MarkerOut => "marker left the screen",
            Self::Standstill => "standstill",
            Self::MaxActions => "out of actions",
        })
    }
}

/// The outcome of one action.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The observation after the action.
    pub observation: Vec<f32>,
    /// Sum of the reward terms that applied.
    pub reward: f32,
    /// The task itself ended the episode.
    pub terminated: bool,
    /// The limit of actions ended the episode.
    pub truncated: bool,
    /// Why, if the episode is over.
    pub end: Option<EndReason>,
    /// What became of the tool.
    pub placement: Placement,
    /// Subgoals reached in this action.
    pub subgoals: Vec<usize>,
    /// The goal was reached in this action.
    pub goal: bool,
    /// Tools placed by the agent (by order of placement) that the ball touched in this
    /// action before it reached the first of `subgoals` or the goal.
    pub touched: Vec<usize>,
}

/// `step` was called after the episode was over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the episode is over: reset the environment before the next step")]
pub struct EpisodeOver;

/// Everything that changes during an episode. Cheap enough to take by the thousand.
#[derive(Debug, Clone)]
pub struct Snapshot {
    world: World,
    start: [f32; 2],
    placed: Vec<Action>,
    reached: Vec<bool>,
    goal: bool,
    goal_touched: bool,
    target_moved: bool,
    actions: u32,
    still: u32,
    end: Option<EndReason>,
}

/// A task being played.
#[derive(Debug, Clone)]
pub struct Environment {
    task: Arc<Task>,
    now: Snapshot,
}

/// Index of the target ball in the world.
pub const TARGET: usize = 0;

impl Environment {
    /// The environment of a task, at its start without noise.
    pub fn new(task: Arc<Task>) -> Self {
        let now = Snapshot::new(&task, [0.0; 2]);
        Self { task, now }
    }

    /// The task being played.
    pub fn task(&self) -> &Arc<Task> {
        &self.task
    }

    /// Starts an episode and returns its first observation.
    pub fn reset(&mut self, rng: &mut impl Rng) -> Vec<f32> {
        let noise = self.task.rules.start_noise;
        let shift = if noise > 0.0 { [0; 2].map(|_| rng.gen_range(-noise..=noise)) } else { [0.0; 2] };
        self.now = Snapshot::new(&self.task, shift);
        self.observation()
    }

    /// Everything that changes during an episode.
    pub fn snapshot(&self) -> &Snapshot {
        &self.now
    }

    /// Goes on from a snapshot of an environment of the same task.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.now.clone_from(snapshot);
    }

    /// The current observation.
    pub fn observation(&self) -> Vec<f32> {
        let mut observation = Vec::new();
        let stages = self.task.subgoals.len() + 1;
        observe(&self.now.world, self.task.tools.len(), self.now.stage(), stages, &mut observation);
        observation
    }

    /// Places the tool if it may be placed, then lets the world run for one action
    /// interval.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step(&mut self, action: Action) -> Result<Step, EpisodeOver> {
        self.step_watched(action, |_| {})
    }

    /// Like [`Environment::step`]; `watch` sees the world after every physics step.
    ///
    /// # Errors
    /// When the episode is over.
    pub fn step_watched(&mut self, action: Action, mut watch: impl FnMut(&World)) -> Result<Step, EpisodeOver> {
        if self.now.end.is_some() {
            return Err(EpisodeOver);
        }
        let placement = self.now.place(&self.task, action);
        let mut step = Step {
            observation: Vec::new(),
            reward: self.task.rules.rewards.step,
            terminated: false,
            truncated: false,
            end: None,
            placement,
            subgoals: Vec::new(),
            goal: false,
            touched: Vec::new(),
        };
        if placement != Placement::Placed {
            step.reward += self.task.rules.rewards.blocked;
        }
        for _ in 0..self.task.rules.steps_per_action {
            self.now.world.step();
            self.now.notice(&self.task, &mut step);
            watch(&self.now.world);
        }
        self.now.finish_action(&self.task, &mut step);
        step.observation = self.observation();
        Ok(step)
    }
}

impl Snapshot {
    fn new(task: &Task, shift: [f32; 2]) -> Self {
        let mut world = World::new(task.rules.gravity);
        let mut ball = task.ball;
        ball.position = [ball.position[0] + shift[0], ball.position[1] + shift[1]];
        world.add_ball(ball.material(), ball.start());
        if let Some(marker) = &task.marker {
            world.add_ball(marker.ball.material(), marker.ball.start());
        }
        let centre = to_units(task.goal.position);
        match task.goal.shape {
            GoalShape::Ball => {
                world.add_ball(Ball { radius: task.goal.radius, ..Ball::default() }, BallState::at_rest(centre));
            }
            GoalShape::Circle => {
                world.add_sensor(&Sensor::Circle { position: centre, radius: task.goal.radius });
            }
            GoalShape::Star => {
                world.add_sensor(&Sensor::Polygon { vertices: star(centre, task.goal.radius) });
            }
        }
        for subgoal in &task.subgoals {
            world.add_sensor(&Sensor::Circle { position: to_units(subgoal.position), radius: subgoal.radius });
        }
        for tool in &task.tools {
            world.add_tool(tool.tool());
        }
        Self {
            world,
            start: ball.position,
            placed: Vec::new(),
            reached: vec![false; task.subgoals.len()],
            goal: false,
            goal_touched: false,
            target_moved: task.marker.is_none(),
            actions: 0,
            still: 0,
            end: None,
        }
    }

    /// The world as it is.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Motion of the target ball, in units.
    pub fn ball(&self) -> BallState {
        self.world.ball(TARGET)
    }

    /// Whether a bucket has captured the target ball.
    pub fn is_captured(&self) -> bool {
        self.world.is_captured(TARGET)
    }

    /// Normalised positions of the tools the agent placed, in order.
    pub fn placed(&self) -> &[Action] {
        &self.placed
    }

    /// Which subgoals have been reached.
    pub fn reached(&self) -> &[bool] {
        &self.reached
    }

    /// Whether the goal has been reached.
    pub fn goal_reached(&self) -> bool {
        self.goal
    }

    /// The next stage: the first subgoal not reached, or their number for the goal.
    pub fn stage(&self) -> usize {
        self.reached.iter().position(|reached| !reached).unwrap_or(self.reached.len())
    }

    /// Actions taken so far.
    pub fn actions(&self) -> u32 {
        self.actions
    }

    /// Why the episode is over, if it is.
    pub fn end(&self) -> Option<EndReason> {
        self.end
    }

    /// What would become of a tool placed at `action`, without placing it.
    pub fn check_placement(&self, task: &Task, action: Action) -> Placement {
        if !action.iter().all(|value| value.is_finite()) {
            return Placement::Invalid;
        }
        let action = action.map(|value| value.clamp(-1.0, 1.0));
        let distance = |other: &Action| (action[0] - other[0]).hypot(action[1] - other[1]);
        if self.placed.iter().any(|other| distance(other) <= task.rules.overlap_threshold) {
            return Placement::Overlap;
        }
        match self.world.obstruction(&task.placeable.tool(action)) {
            Some(_) => Placement::Collision,
            None => Placement::Placed,
        }
    }

    /// Puts the target ball into another state of motion, as a model predicts it.
    pub fn set_ball(&mut self, state: BallState) {
        self.world.set_ball(TARGET, state);
    }

    /// Places a tool at `action` if it may be placed there.
    pub fn place(&mut self, task: &Task, action: Action) -> Placement {
        let placement = self.check_placement(task, action);
        if placement == Placement::Placed {
            let action = action.map(|value| value.clamp(-1.0, 1.0));
            let tool: Tool = task.placeable.tool(action);
            self.world.add_tool(tool);
            self.placed.push(action);
        }
        placement
    }

    /// What the latest physics step brought: touches, stages, the goal.
    fn notice(&mut self, task: &Task, step: &mut Step) {
        let hit_before = step.goal || !step.subgoals.is_empty();
        if !hit_before {
            for touch in self.world.touches().iter().filter(|touch| touch.ball == TARGET) {
                if let ObjectId::Tool(index) = touch.object
                    && let Some(placed) = index.checked_sub(task.tools.len())
                    && !step.touched.contains(&placed)
                {
                    step.touched.push(placed);
                }
            }
        }
        if task.rules.subgoal_check == SubgoalCheck::AnyStep {
            self.check_subgoals(task, step);
        }
        self.goal_touched |= self.touches_goal(task);
        if task.rules.goal_ends_episode && self.goal_counts(task) && self.touches_goal(task) {
            self.reach_goal(task, step);
        }
    }

    fn check_subgoals(&mut self, task: &Task, step: &mut Step) {
        let first_sensor = usize::from(task.goal.shape != GoalShape::Ball);
        for index in 0..self.reached.len() {
            if self.reached[index] {
                continue;
            }
            if self.world.touches_sensor(TARGET, first_sensor + index) {
                self.reached[index] = true;
                self.world.remove_sensor(first_sensor + index);
                step.subgoals.push(index);
                step.reward += self.worth(task, task.rules.rewards.subgoal).max(0.0);
            } else if task.rules.in_order {
                break;
            }
        }
    }

    /// Whether reaching the goal counts now.
    fn goal_counts(&self, task: &Task) -> bool {
        !self.goal && self.target_moved && (!task.rules.in_order || self.reached.iter().all(|reached| *reached))
    }

    fn touches_goal(&self, task: &Task) -> bool {
        match task.goal.shape {
            GoalShape::Ball => {
                let goal = ObjectId::Ball(1 + usize::from(task.marker.is_some()));
                self.world.touches().iter().any(|touch| touch.ball == TARGET && touch.object == goal)
            }
            _ => self.world.touches_sensor(TARGET, 0),
        }
    }

    fn reach_goal(&mut self, task: &Task, step: &mut Step) {
        self.goal = true;
        step.goal = true;
        step.reward += self.worth(task, task.rules.rewards.goal);
    }

    /// A reward less the cost of the tools placed so far.
    fn worth(&self, task: &Task, reward: f32) -> f32 {
        reward - task.rules.rewards.cost_per_tool * self.placed.len() as f32
    }

    fn finish_action(&mut self, task: &Task, step: &mut Step) {
        let rules = &task.rules;
        self.actions += 1;
        if !rules.goal_ends_episode && self.goal_counts(task) && (self.goal_touched || self.touches_goal(task)) {
            self.reach_goal(task, step);
        }
        if rules.subgoal_check == SubgoalCheck::ActionEnd {
            self.check_subgoals(task, step);
        }
        self.check_target_moved(task, step);
        self.end = self.find_end(task);
        step.end = self.end;
        step.truncated = self.end == Some(EndReason::MaxActions);
        step.terminated = self.end.is_some() && !step.truncated;
    }

    fn check_target_moved(&mut self, task: &Task, step: &mut Step) {
        let Some(marker) = task.marker.filter(|_| !self.target_moved) else { return };
        let clip = |position: [f32; 2]| position.map(|value| value.clamp(-1.0, 1.0));
        let [from, to] = [clip(self.start), clip(to_normalised(self.ball().position))];
        if (to[0] - from[0]).hypot(to[1] - from[1]) / 8f32.sqrt() > marker.move_threshold {
            self.target_moved = true;
            step.reward += task.rules.rewards.target_moved;
        }
    }

    fn find_end(&mut self, task: &Task) -> Option<EndReason> {
        let inside = |ball: usize| self.world.ball(ball).position.iter().all(|p| *p > 0.0 && *p < SCREEN);
        let rests = |ball: usize| {
            self.world.ball(ball).speed() < task.rules.min_speed
                || (task.rules.capture_is_standstill && self.world.is_captured(ball))
        };
        if (0..self.world.ball_count()).all(rests) {
            self.still += 1;
        }
        if self.goal && task.rules.goal_ends_episode {
            Some(EndReason::Goal)
        } else if !inside(TARGET) {
            Some(EndReason::OutOfBounds)
        } else if task.marker.is_some() && !self.target_moved && !inside(1) {
            Some(EndReason::MarkerOut)
        } else if self.still >= task.rules.still_actions {
            Some(EndReason::Standstill)
        } else if self.actions >= task.rules.max_actions {
            Some(EndReason::MaxActions)
        } else {
            None
        }
    }
}

/// Vertices of a star's convex hull: a regular pentagon with one vertex straight up.
fn star(centre: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
    (0..5)
        .map(|corner| {
            let angle = std::f32::consts::FRAC_PI_2 + corner as f32 * std::f32::consts::TAU / 5.0;
            [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
        })
        .collect()
}
