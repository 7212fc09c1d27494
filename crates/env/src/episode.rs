//! One episode of a task: placements, physics, stages reached, rewards, termination.

use std::sync::Arc;

use educe::Educe;

use super::action::{Action, EndReason, Placement, Step};
use mge_physics::{Ball, BallState, Motion, ObjectId, SCREEN, Sensor, Tool, World, exact, to_normalised, to_units};
use mge_task::{BallSpec, Goal, GoalShape, Part, Region, SubgoalCheck, Task};

/// Index of the target ball in the world.
pub const TARGET: usize = 0;
/// Index of the marker ball in the world of a task that has one.
pub const MARKER: usize = 1;

/// The goal's object in the world.
pub fn goal_object(task: &Task) -> ObjectId {
    match task.goal.shape {
        GoalShape::Ball => ObjectId::Ball(1 + usize::from(task.marker.is_some())),
        GoalShape::Circle | GoalShape::Star | GoalShape::Basket => ObjectId::Sensor(0),
    }
}

/// Names of the balls of a task's world, by index.
pub fn ball_names(task: &Task) -> Vec<String> {
    let marker = task.marker.is_some().then_some("marker");
    let goal = (task.goal.shape == GoalShape::Ball).then_some("goal_ball");
    let named = ["target"].into_iter().chain(marker).chain(goal).map(str::to_owned);
    let balls = (0..task.balls.len()).map(|index| format!("ball{index}"));
    named.chain(balls).chain((0..task.boxes.len()).map(|index| format!("box{index}"))).collect()
}

/// Index of the first subgoal's sensor; the marker's subgoals come after the target's.
pub(super) fn first_subgoal(task: &Task) -> usize {
    usize::from(matches!(goal_object(task), ObjectId::Sensor(_)))
}

/// The state of an episode. Cheap to clone; a clone from another one reuses allocations.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct Snapshot {
    /// The task being played, with its random shifts applied.
    pub task: Arc<Task>,
    /// The current world.
    pub world: World,
    start: [f32; 2],
    /// Normalised positions of the tools the agent placed, in order.
    pub placed: Vec<Action>,
    /// Which subgoals have been reached.
    pub reached: Vec<bool>,
    /// Which of the marker's subgoals have been reached.
    pub reached_by_marker: Vec<bool>,
    /// Whether the goal has been reached.
    pub goal_reached: bool,
    goal_touched: bool,
    marker_touched: bool,
    /// Whether the target counts as moved; always in tasks without a marker.
    pub target_moved: bool,
    /// Actions taken so far.
    pub actions: u32,
    still: u32,
    /// All reasons why the episode is over, in CREATE's order: several may apply.
    pub reasons: Vec<EndReason>,
}

impl Snapshot {
    pub(super) fn new(task: Arc<Task>, shift: [f32; 2]) -> Self {
        let mut ball = task.ball;
        ball.position = [ball.position[0] + shift[0], ball.position[1] + shift[1]];
        Self {
            world: world(&task, &ball),
            start: ball.position,
            placed: Vec::new(),
            reached: vec![false; task.subgoals.len()],
            reached_by_marker: vec![false; task.marker.as_ref().map_or(0, |marker| marker.subgoals.len())],
            goal_reached: false,
            goal_touched: false,
            marker_touched: false,
            target_moved: task.marker.is_none(),
            actions: 0,
            still: 0,
            reasons: Vec::new(),
            task,
        }
    }

    /// A state that a model predicts for an episode of `task`: after `actions` actions, of which `placed` placed tools,
    /// the first `stage` subgoals are reached, and the ball has this motion.
    pub fn predicted(task: Arc<Task>, actions: u32, placed: &[Action], stage: usize, ball: BallState) -> Self {
        let mut state = Self::new(task, [0.0; 2]);
        for &action in placed {
            let (action, tool) = clipped(&state.task.placeable.tool([0.0; 2]), action);
            state.world.add_tool(tool);
            state.placed.push(action);
        }
        state.reached.iter_mut().take(stage).for_each(|reached| *reached = true);
        state.actions = actions;
        state.set_ball(ball);
        state
    }

    /// Motion of the target ball, in units.
    pub fn ball(&self) -> BallState {
        self.world.ball(TARGET)
    }

    /// Whether a bucket has captured the target ball.
    pub fn is_captured(&self) -> bool {
        self.world.is_captured(TARGET)
    }

    /// Index of the next stage: the first subgoal not reached or, if all are, the number of subgoals, which stands
    /// for the goal.
    pub fn stage(&self) -> usize {
        self.reached.iter().position(|reached| !reached).unwrap_or(self.reached.len())
    }

    /// Why the episode is over, if it is.
    pub fn end(&self) -> Option<EndReason> {
        self.reasons.iter().copied().min()
    }

    /// Whether a tool could be placed at `action`, without placing it.
    pub fn check_tool(&self, tool: &Tool, action: Action) -> Placement {
        if !action.iter().all(|value| value.is_finite()) {
            return Placement::Invalid;
        }
        let (action, tool) = clipped(tool, action);
        let distance = |other: &Action| (action[0] - other[0]).hypot(action[1] - other[1]);
        if self.placed.iter().any(|other| distance(other) <= self.task.rules.overlap_threshold) {
            return Placement::Overlap;
        }
        if self.world.is_obstructed(&tool) { Placement::Collision } else { Placement::Placed }
    }

    /// Why a tool cannot be placed at `action`, in words. None if it can.
    pub fn refusal(&self, tool: &Tool, action: Action) -> Option<String> {
        let reason = match self.check_tool(tool, action) {
            Placement::Placed | Placement::NoOp => return None,
            Placement::Invalid => "needs a finite position",
            Placement::Overlap => "would be too near an earlier tool",
            Placement::Collision => "would touch an object, a subgoal or the goal",
        };
        Some(format!("{} {reason}", tool.kind))
    }

    /// Sets the motion of the target ball, such as a model's prediction.
    pub fn set_ball(&mut self, state: BallState) {
        self.world.set_ball(TARGET, state);
    }

    /// Places the task's tool at `action` if it may be placed there.
    pub fn place(&mut self, action: Action) -> Placement {
        self.place_tool(&self.task.placeable.tool([0.0; 2]), action)
    }

    /// Places a tool at `action` if it may be placed there.
    pub fn place_tool(&mut self, tool: &Tool, action: Action) -> Placement {
        let placement = self.check_tool(tool, action);
        let (action, tool) = clipped(tool, action);
        match placement {
            Placement::Placed => {
                self.world.add_tool(tool);
                self.placed.push(action);
            }
            Placement::Collision => self.world.reject_tool(&tool),
            Placement::Overlap | Placement::Invalid | Placement::NoOp => {}
        }
        placement
    }

    /// Runs one physics step and records touches, stages and the goal.
    pub(super) fn advance(&mut self, step: &mut Step) {
        self.world.step();
        if !step.reached_stage() {
            self.record_touched_tools(step);
        }
        if self.task.rules.subgoal_check == SubgoalCheck::AnyStep {
            self.check_subgoals(step);
        }
        self.marker_touched |= self.task.marker.is_some() && self.touches(TARGET, ObjectId::Ball(MARKER));
        let touches_goal = self.touches(TARGET, goal_object(&self.task));
        self.goal_touched |= touches_goal;
        if self.task.rules.goal_ends_episode && touches_goal && self.goal_counts() {
            self.reach_goal(step);
        }
    }

    fn record_touched_tools(&self, step: &mut Step) {
        for touch in &self.world.touches {
            if let ObjectId::Tool(index) = touch.object
                && let Some(placed) = index.checked_sub(self.task.tools.len())
                && !step.touched.contains(&placed)
            {
                step.touched.push(placed);
            }
        }
    }

    /// Whether the ball touched the object in the latest physics step.
    fn touches(&self, ball: usize, object: ObjectId) -> bool {
        self.world.touches.iter().any(|touch| touch.ball == ball && touch.object == object)
    }

    fn check_subgoals(&mut self, step: &mut Step) {
        for index in 0..self.reached.len() {
            if self.reached[index] {
                continue;
            }
            let sensor = first_subgoal(&self.task) + index;
            let is_reached = match self.task.rules.subgoal_check {
                SubgoalCheck::AnyStep => self.touches(TARGET, ObjectId::Sensor(sensor)),
                SubgoalCheck::ActionEnd => self.world.overlaps_sensor(TARGET, sensor),
            };
            if is_reached {
                self.reach_subgoal(index, step);
            } else if self.task.rules.in_order {
                break;
            }
        }
    }

    fn reach_subgoal(&mut self, index: usize, step: &mut Step) {
        self.reached[index] = true;
        self.world.remove_sensor(first_subgoal(&self.task) + index);
        step.subgoals.push(index);
        step.reward += self.worth(self.task.rules.rewards.subgoal).max(0.0);
    }

    /// Checks the marker's subgoals at the end of an action.
    fn check_marker_subgoals(&mut self, step: &mut Step) {
        for index in 0..self.reached_by_marker.len() {
            let sensor = first_subgoal(&self.task) + self.reached.len() + index;
            if !self.reached_by_marker[index] && self.world.overlaps_sensor(MARKER, sensor) {
                self.reached_by_marker[index] = true;
                self.world.remove_sensor(sensor);
                step.reward += self.worth(self.task.rules.rewards.subgoal).max(0.0);
            }
        }
    }

    /// Whether reaching the goal counts now.
    fn goal_counts(&self) -> bool {
        !self.goal_reached
            && self.target_moved
            && (!self.task.rules.in_order || self.reached.iter().all(|reached| *reached))
    }

    fn reach_goal(&mut self, step: &mut Step) {
        self.goal_reached = true;
        step.goal = true;
        step.reward += self.worth(self.task.rules.rewards.goal);
    }

    /// A reward minus the cost of the tools placed so far.
    fn worth(&self, reward: f32) -> f32 {
        reward - self.task.rules.rewards.cost_per_tool * self.placed.len() as f32
    }

    pub(super) fn finish_action(&mut self, step: &mut Step) {
        self.actions += 1;
        if !self.task.rules.goal_ends_episode && self.goal_counts() && self.goal_touched {
            self.reach_goal(step);
        }
        if self.task.rules.subgoal_check == SubgoalCheck::ActionEnd {
            self.check_subgoals(step);
        }
        self.check_marker_subgoals(step);
        self.check_target_moved(step);
        self.reasons = self.find_end_reasons();
        step.end = self.end();
        step.truncated = step.end == Some(EndReason::MaxActions);
        step.terminated = step.end.is_some() && !step.truncated;
    }

    fn check_target_moved(&mut self, step: &mut Step) {
        let Some(marker) = &self.task.marker else { return };
        if self.target_moved || (marker.must_hit && !self.marker_touched) {
            return;
        }
        let clip = |position: [f32; 2]| position.map(|value| value.clamp(-1.0, 1.0));
        let [from, to] = [clip(self.start), clip(to_normalised(self.ball().position))];
        if (to[0] - from[0]).hypot(to[1] - from[1]) / 8f32.sqrt() > marker.move_threshold {
            self.target_moved = true;
            step.reward += self.task.rules.rewards.target_moved;
        }
    }

    fn find_end_reasons(&mut self) -> Vec<EndReason> {
        let inside = |ball: usize| {
            let screen = f64::from(SCREEN);
            self.world.motion(ball).position.iter().all(|p| *p > 0.0 && *p < screen)
        };
        let target_out = !inside(TARGET);
        let marker_out = self.task.marker.is_some() && !self.target_moved && !inside(MARKER);
        if self.rests() {
            self.still += 1;
        }
        let reasons = [
            (EndReason::MaxActions, self.actions >= self.task.rules.max_actions),
            (EndReason::OutOfBounds, target_out),
            (EndReason::Standstill, self.still >= self.task.rules.still_actions),
            (EndReason::MarkerOut, marker_out),
            (EndReason::Goal, self.goal_reached && self.task.rules.goal_ends_episode),
        ];
        reasons.into_iter().filter_map(|(reason, applies)| applies.then_some(reason)).collect()
    }

    /// Whether all balls, boxes and planks are at rest.
    fn rests(&self) -> bool {
        let is_slow = |motion: Motion| BallState::from(motion).speed() < self.task.rules.min_speed;
        let ball_rests = |ball: usize| {
            is_slow(self.world.motion(ball)) || (self.task.rules.capture_is_standstill && self.world.is_captured(ball))
        };
        (0..self.world.ball_count()).all(ball_rests)
            && (0..self.world.tools().len()).all(|tool| self.world.plank(tool).0.is_none_or(is_slow))
    }
}

/// The world at the start of a task, with the given target ball.
fn world(task: &Task, target: &BallSpec) -> World {
    let mut world = World::new(task.rules.gravity);
    let (mut balls, mut sensors) = (Vec::new(), Vec::new());
    for part in task.parts() {
        match part {
            Part::Target => balls.push((part, world.add_ball(target.material(), target.motion()))),
            Part::Marker => {
                let marker = task.marker.iter().map(|marker| marker.ball);
                balls.extend(marker.map(|ball| (part, world.add_ball(ball.material(), ball.motion()))));
            }
            Part::Goal => match goal_sensor(&task.goal) {
                Some(sensor) => sensors.push((part, world.add_sensor(&sensor))),
                None => {
                    let material = Ball { radius: task.goal.radius, ..Ball::default() };
                    balls.push((part, world.add_ball(material, Motion::at_rest(in_units(task.goal.position)))));
                }
            },
            Part::Ball(index) => {
                let ball = &task.balls[index];
                balls.push((part, world.add_ball(ball.material(), ball.motion())));
            }
            Part::Box(index) => {
                let moving = &task.boxes[index];
                balls.push((part, world.add_box(moving.material(), moving.motion())));
            }
            Part::Subgoal(index) => sensors.push((part, world.add_sensor(&circle(&task.subgoals[index])))),
            Part::MarkerSubgoal(index) => {
                let subgoals = task.marker.iter().map(|marker| &marker.subgoals[index]);
                sensors.extend(subgoals.map(|region| (part, world.add_sensor(&circle(region)))));
            }
            Part::Tool(index) => {
                world.add_tool(task.tools[index].tool());
            }
        }
    }
    if !task.order.is_empty() {
        // Other code indexes balls and sensors in the usual order.
        let arranged = |added: &[(Part, usize)]| -> Vec<usize> {
            let index = |part| added.iter().find(|(other, _)| *other == part).map(|(_, index)| *index);
            task.default_parts().filter_map(index).collect()
        };
        world.arrange(&arranged(&balls), &arranged(&sensors));
    }
    world
}

fn circle(region: &Region) -> Sensor {
    Sensor::Circle { position: in_units(region.position), radius: exact(region.radius) }
}

/// The sensor of a goal that does not move.
fn goal_sensor(goal: &Goal) -> Option<Sensor> {
    let (position, radius) = (in_units(goal.position), exact(goal.radius));
    match goal.shape {
        GoalShape::Ball => None,
        GoalShape::Circle => Some(circle(&goal.region())),
        GoalShape::Star => Some(Sensor::Star { position, radius }),
        GoalShape::Basket => Some(Sensor::Square { position, side: 2.0 * radius }),
    }
}

/// An action clipped to the screen, and the tool there.
fn clipped(tool: &Tool, action: Action) -> (Action, Tool) {
    let action = action.map(|value| value.clamp(-1.0, 1.0));
    (action, tool.at(to_units(action.map(f64::from))))
}

/// A normalised position, in units.
fn in_units(position: [f32; 2]) -> [f64; 2] {
    to_units(position.map(exact))
}
