//! One episode of a task: placements, physics, stages reached, reward, end.

use super::action::{Action, EndReason, Placement, Step};
use crate::physics::{Ball, BallState, ObjectId, SCREEN, Sensor, World, to_normalised, to_units};
use crate::task::{Goal, GoalShape, Region, SubgoalCheck, Task};

/// Index of the target ball in the world.
pub(super) const TARGET: usize = 0;
/// Index of the marker ball in the world of a task that has one.
pub(super) const MARKER: usize = 1;

/// The goal among the objects of the world.
pub(super) fn goal_object(task: &Task) -> ObjectId {
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
    named.chain((0..task.balls.len()).map(|index| format!("ball{index}"))).collect()
}

/// Index of the first subgoal's sensor; the marker's subgoals come after the target's.
fn first_subgoal(task: &Task) -> usize {
    usize::from(matches!(goal_object(task), ObjectId::Sensor(_)))
}

/// Everything that changes during an episode. Cheap enough to take by the thousand.
#[derive(Debug, Clone)]
pub struct Snapshot {
    world: World,
    start: [f32; 2],
    placed: Vec<Action>,
    reached: Vec<bool>,
    reached_by_marker: Vec<bool>,
    goal: bool,
    goal_touched: bool,
    marker_touched: bool,
    target_moved: bool,
    actions: u32,
    still: u32,
    end: Option<EndReason>,
}

impl Snapshot {
    pub(super) fn new(task: &Task, shift: [f32; 2]) -> Self {
        let mut world = World::new(task.rules.gravity);
        let mut ball = task.ball;
        ball.position = [ball.position[0] + shift[0], ball.position[1] + shift[1]];
        world.add_ball(ball.material(), ball.start());
        if let Some(marker) = &task.marker {
            world.add_ball(marker.ball.material(), marker.ball.start());
        }
        match goal_sensor(&task.goal) {
            Some(sensor) => {
                world.add_sensor(&sensor);
            }
            None => {
                let material = Ball { radius: task.goal.radius, ..Ball::default() };
                world.add_ball(material, BallState::at_rest(to_units(task.goal.position)));
            }
        }
        for other in &task.balls {
            world.add_ball(other.material(), other.start());
        }
        let marker_subgoals = task.marker.iter().flat_map(|marker| &marker.subgoals);
        for subgoal in task.subgoals.iter().chain(marker_subgoals) {
            world.add_sensor(&circle(subgoal));
        }
        for tool in &task.tools {
            world.add_tool(tool.tool());
        }
        Self {
            world,
            start: ball.position,
            placed: Vec::new(),
            reached: vec![false; task.subgoals.len()],
            reached_by_marker: vec![false; task.marker.as_ref().map_or(0, |marker| marker.subgoals.len())],
            goal: false,
            goal_touched: false,
            marker_touched: false,
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

    /// Whether a tool could be placed at `action`, without placing it.
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
            self.world.add_tool(task.placeable.tool(action));
            self.placed.push(action);
        }
        placement
    }

    /// Runs one physics step and notes what it brought: touches, stages, the goal.
    pub(super) fn advance(&mut self, task: &Task, step: &mut Step) {
        self.world.step();
        if !step.goal && step.subgoals.is_empty() {
            self.note_touched_tools(task, step);
        }
        if task.rules.subgoal_check == SubgoalCheck::AnyStep {
            self.check_subgoals(task, step);
        }
        self.marker_touched |= task.marker.is_some() && self.touches(TARGET, ObjectId::Ball(MARKER));
        let touches_goal = self.touches(TARGET, goal_object(task));
        self.goal_touched |= touches_goal;
        if task.rules.goal_ends_episode && touches_goal && self.goal_counts(task) {
            self.reach_goal(task, step);
        }
    }

    fn note_touched_tools(&self, task: &Task, step: &mut Step) {
        for touch in self.world.touches().iter().filter(|touch| touch.ball == TARGET) {
            if let ObjectId::Tool(index) = touch.object
                && let Some(placed) = index.checked_sub(task.tools.len())
                && !step.touched.contains(&placed)
            {
                step.touched.push(placed);
            }
        }
    }

    /// Whether the latest physics step found the ball touching the object.
    fn touches(&self, ball: usize, object: ObjectId) -> bool {
        self.world.touches().iter().any(|touch| touch.ball == ball && touch.object == object)
    }

    fn check_subgoals(&mut self, task: &Task, step: &mut Step) {
        for index in 0..self.reached.len() {
            if self.reached[index] {
                continue;
            }
            let sensor = first_subgoal(task) + index;
            if self.touches(TARGET, ObjectId::Sensor(sensor)) {
                self.reach_subgoal(index, task, step);
            } else if task.rules.in_order {
                break;
            }
        }
    }

    fn reach_subgoal(&mut self, index: usize, task: &Task, step: &mut Step) {
        self.reached[index] = true;
        self.world.remove_sensor(first_subgoal(task) + index);
        step.subgoals.push(index);
        step.reward += self.worth(task, task.rules.rewards.subgoal).max(0.0);
    }

    /// Counts the next stage as reached, as a model predicts it.
    pub(super) fn reach_stage(&mut self, task: &Task, step: &mut Step) {
        match self.stage() {
            goal if goal == self.reached.len() => self.reach_goal(task, step),
            subgoal => self.reach_subgoal(subgoal, task, step),
        }
    }

    /// The marker's subgoals, at the end of an action.
    fn check_marker_subgoals(&mut self, task: &Task, step: &mut Step) {
        for index in 0..self.reached_by_marker.len() {
            let sensor = first_subgoal(task) + self.reached.len() + index;
            if !self.reached_by_marker[index] && self.touches(MARKER, ObjectId::Sensor(sensor)) {
                self.reached_by_marker[index] = true;
                self.world.remove_sensor(sensor);
                step.reward += self.worth(task, task.rules.rewards.subgoal).max(0.0);
            }
        }
    }

    /// Whether reaching the goal counts now.
    fn goal_counts(&self, task: &Task) -> bool {
        !self.goal && self.target_moved && (!task.rules.in_order || self.reached.iter().all(|reached| *reached))
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

    pub(super) fn finish_action(&mut self, task: &Task, step: &mut Step) {
        let rules = &task.rules;
        self.actions += 1;
        if !rules.goal_ends_episode && self.goal_counts(task) && self.goal_touched {
            self.reach_goal(task, step);
        }
        if rules.subgoal_check == SubgoalCheck::ActionEnd {
            self.check_subgoals(task, step);
        }
        self.check_marker_subgoals(task, step);
        self.check_target_moved(task, step);
        self.end = self.find_end(task);
        step.end = self.end;
        step.truncated = self.end == Some(EndReason::MaxActions);
        step.terminated = self.end.is_some() && !step.truncated;
    }

    fn check_target_moved(&mut self, task: &Task, step: &mut Step) {
        let Some(marker) = &task.marker else { return };
        if self.target_moved || (marker.must_hit && !self.marker_touched) {
            return;
        }
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
        } else if task.marker.is_some() && !self.target_moved && !inside(MARKER) {
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

fn circle(region: &Region) -> Sensor {
    Sensor::Circle { position: to_units(region.position), radius: region.radius }
}

/// The sensor of a goal that does not move.
fn goal_sensor(goal: &Goal) -> Option<Sensor> {
    let centre = to_units(goal.position);
    match goal.shape {
        GoalShape::Ball => None,
        GoalShape::Circle => Some(circle(&goal.region())),
        // The engine keeps a star's convex hull, a pentagon with one corner straight up.
        GoalShape::Star => Some(regular_polygon(centre, goal.radius, 5, std::f32::consts::FRAC_PI_2)),
        GoalShape::Basket => {
            let corner_radius = goal.radius * std::f32::consts::SQRT_2;
            Some(regular_polygon(centre, corner_radius, 4, std::f32::consts::FRAC_PI_4))
        }
    }
}

fn regular_polygon(centre: [f32; 2], radius: f32, corners: usize, first_angle: f32) -> Sensor {
    let corner = |index| {
        let angle = first_angle + index as f32 * std::f32::consts::TAU / corners as f32;
        [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
    };
    Sensor::Polygon { vertices: (0..corners).map(corner).collect() }
}
