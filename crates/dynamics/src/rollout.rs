//! Model rollouts: every prediction is one batch over thousands of action sequences.

use super::error::Result;
use super::predictor::Predictor;
use mge_env::{Action, ActionSet, Choice, Placement, Snapshot};
use mge_physics::{BallState, SCREEN, Tool, to_normalised, to_units};
use mge_task::{Region, SubgoalCheck};

/// Largest predicted gap between the surfaces of ball and tool that counts as a touch, in units;
/// above 0 because the ball is predicted only once per interval.
const TOUCH_GAP: f32 = 2.0;

/// The outcome of one sequence of actions, predicted or simulated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rollout {
    /// The actions taken, up to the end of the rollout.
    pub actions: Vec<RolloutAction>,
    /// The next stage was reached, during the last of `actions`.
    pub hit: bool,
    /// Normalised positions of the ball, the start and then one per prediction.
    pub path: Vec<[f32; 2]>,
    /// Motion of the ball after each of `actions`, in units.
    pub balls: Vec<BallState>,
}

/// One action of a rollout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RolloutAction {
    /// The requested position of the tool.
    pub action: Action,
    /// The tool was placed.
    pub placed: bool,
    /// The ball touched that tool before the stage was reached.
    pub touched: bool,
}

/// A rollout in progress.
struct OngoingRollout {
    snapshot: Snapshot,
    ball: BallState,
    /// Radius of the ball in units.
    radius: f32,
    tools: Vec<Tool>,
    /// The index of the action that placed each tool; none for initial tools.
    placed_by: Vec<Option<usize>>,
    targets: Vec<Target>,
    /// Number of actions that the episode still allows.
    actions_left: usize,
    over: bool,
    outcome: Rollout,
}

/// A region that the ball should reach.
struct Target {
    region: Region,
    /// Whether the ball must be there at the end of an action, not just at any time.
    at_end: bool,
}

/// Rolls out `sequences[i]` from `starts[i]`, each until the next stage of its start is
/// predicted to be reached, the ball leaves the screen, the episode's action limit is reached or
/// the sequence ends.
///
/// # Errors
/// When the predictor cannot predict a scene of the task.
pub fn rollouts(predictor: &dyn Predictor, starts: &[&Snapshot], sequences: &[Vec<Action>]) -> Result<Vec<Rollout>> {
    let next = |start: &Snapshot| {
        let stages = start.task().stages();
        vec![Target { region: stages[start.stage().min(stages.len() - 1)], at_end: false }]
    };
    roll_out(predictor, None, next, starts, sequences)
}

/// Like [`rollouts`], for an agent that chooses among the tools of `set`, until any stage that can be
/// reached next is predicted to be reached.
///
/// # Errors
/// When the predictor cannot predict a scene of the task or one of the tools.
pub fn rollouts_with_tools(
    predictor: &dyn Predictor,
    set: &ActionSet,
    starts: &[&Snapshot],
    sequences: &[Vec<Choice>],
) -> Result<Vec<Rollout>> {
    let open = |start: &Snapshot| {
        let task = start.task();
        let at_end = task.rules.subgoal_check == SubgoalCheck::ActionEnd;
        let subgoals = task.subgoals.iter().zip(start.reached()).filter(|(_, reached)| !**reached);
        let subgoals = subgoals.map(|(region, _)| Target { region: *region, at_end });
        let goal = (!start.goal_reached()).then(|| Target { region: task.goal.region(), at_end: false });
        let open = subgoals.chain(goal);
        if task.rules.in_order { open.take(1).collect() } else { open.collect() }
    };
    roll_out(predictor, Some(set), open, starts, sequences)
}

fn roll_out<C: Copy + Into<Choice>>(
    predictor: &dyn Predictor,
    set: Option<&ActionSet>,
    targets: impl Fn(&Snapshot) -> Vec<Target>,
    starts: &[&Snapshot],
    sequences: &[Vec<C>],
) -> Result<Vec<Rollout>> {
    let mut rollouts: Vec<OngoingRollout> =
        starts.iter().map(|start| OngoingRollout::new(targets(start), start)).collect();
    let steps = starts.first().map_or(0, |start| start.task().rules.steps_per_action);
    let horizon = sequences.iter().map(Vec::len).max().unwrap_or(0);
    for index in 0..horizon {
        for (rollout, sequence) in rollouts.iter_mut().zip(sequences) {
            match sequence.get(index) {
                Some(&choice) if !rollout.over && index < rollout.actions_left => {
                    rollout.place(set, choice.into());
                }
                _ => rollout.over = true,
            }
        }
        for _ in 0..steps / predictor.interval() {
            advance(predictor, &mut rollouts)?;
        }
        for rollout in rollouts.iter_mut().filter(|rollout| rollout.is_in_action()) {
            rollout.end_action();
        }
    }
    Ok(rollouts.into_iter().map(|rollout| rollout.outcome).collect())
}

/// One prediction for all rollouts that are not over.
fn advance(predictor: &dyn Predictor, rollouts: &mut [OngoingRollout]) -> Result<()> {
    let mut running: Vec<&mut OngoingRollout> = rollouts.iter_mut().filter(|rollout| !rollout.over).collect();
    let balls: Vec<BallState> = running.iter().map(|rollout| rollout.ball).collect();
    let tools: Vec<&[Tool]> = running.iter().map(|rollout| rollout.tools.as_slice()).collect();
    let next = predictor.advance(&balls, &tools)?;
    for (rollout, next) in running.iter_mut().zip(next) {
        rollout.go_to(next);
    }
    Ok(())
}

impl OngoingRollout {
    fn new(targets: Vec<Target>, start: &Snapshot) -> Self {
        let task = start.task();
        let tools: Vec<Tool> = start.world().tools().copied().collect();
        let ball = start.ball();
        Self {
            snapshot: start.clone(),
            ball,
            radius: task.ball.radius,
            placed_by: vec![None; tools.len()],
            tools,
            targets,
            actions_left: task.rules.max_actions.saturating_sub(start.actions()) as usize,
            over: start.end().is_some(),
            outcome: Rollout { path: vec![to_normalised(ball.position)], ..Rollout::default() },
        }
    }

    /// Places the task's tool, or the chosen tool of `set`. The no-op and choices outside the set place nothing.
    fn place(&mut self, set: Option<&ActionSet>, Choice { tool, place: action }: Choice) {
        self.snapshot.set_ball(self.ball);
        let placement = match set {
            None => self.snapshot.place(action),
            Some(set) => match set.get(tool).flatten() {
                Some(tool) => self.snapshot.place_tool(tool, action),
                None => Placement::NoOp,
            },
        };
        let placed = placement == Placement::Placed;
        if placed {
            self.placed_by.push(Some(self.outcome.actions.len()));
            self.tools.extend(self.snapshot.world().tools().last().copied());
        }
        self.outcome.actions.push(RolloutAction { action, placed, touched: false });
    }

    /// Whether a target is reached: for `at_end`, one that counts at the end of an action, by the state `next`
    /// itself; otherwise one that counts at any time, on the way to `next`.
    fn reaches(&self, next: &BallState, at_end: bool) -> bool {
        let from = if at_end { next.position } else { self.ball.position };
        self.targets.iter().filter(|target| target.at_end == at_end).any(|Target { region, .. }| {
            distance_to_segment(to_units(region.position), from, next.position) <= region.radius + self.radius
        })
    }

    /// Whether its latest action has not ended.
    fn is_in_action(&self) -> bool {
        self.outcome.balls.len() < self.outcome.actions.len()
    }

    fn end_action(&mut self) {
        if !self.over && self.reaches(&self.ball, true) {
            (self.outcome.hit, self.over) = (true, true);
        }
        self.outcome.balls.push(self.ball);
    }

    fn go_to(&mut self, next: BallState) {
        let (radius, hit) = (self.radius, self.reaches(&next, false));
        self.outcome.hit = hit;
        for (tool, action) in self.tools.iter().zip(&self.placed_by).filter_map(|(tool, by)| Some((tool, (*by)?))) {
            let near = |ball: &BallState| {
                !tool.is_beyond(ball.position, radius + TOUCH_GAP) && tool.surface(ball.position).0 - radius < TOUCH_GAP
            };
            let touched = &mut self.outcome.actions[action].touched;
            *touched = *touched || near(&self.ball) || (!hit && near(&next));
        }
        self.ball = next;
        self.outcome.path.push(to_normalised(next.position));
        let inside = next.position.iter().all(|p| *p > 0.0 && *p < SCREEN);
        self.over = hit || !inside;
    }
}

/// Distance from a point to the segment between `from` and `to`.
pub(super) fn distance_to_segment(point: [f32; 2], from: [f32; 2], to: [f32; 2]) -> f32 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let offset = [point[0] - from[0], point[1] - from[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let share =
        if length > 0.0 { ((offset[0] * along[0] + offset[1] * along[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (offset[0] - share * along[0]).hypot(offset[1] - share * along[1])
}
