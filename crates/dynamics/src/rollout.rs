//! Model rollouts: every prediction is one batch over thousands of action sequences.

use super::error::Result;
use super::predictor::Predictor;
use mge_base::stop::Stop;
use mge_env::{Action, Placement, Snapshot};
use mge_physics::{BallState, SCREEN, Tool, to_normalised, to_units};
use mge_task::Region;

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
    /// The region of the next stage.
    target: Region,
    /// Number of actions that the episode still allows.
    actions_left: usize,
    over: bool,
    outcome: Rollout,
}

/// Rolls out `sequences[i]` from `starts[i]`, each until the next stage of its start is
/// predicted to be reached, the ball leaves the screen, the episode's action limit is reached or
/// the sequence ends.
///
/// # Errors
/// When the predictor cannot predict a scene of the task, or `stop` is requested.
pub fn rollouts(
    predictor: &dyn Predictor,
    starts: &[&Snapshot],
    sequences: &[Vec<Action>],
    stop: &Stop,
) -> Result<Vec<Rollout>> {
    let mut rollouts: Vec<OngoingRollout> = starts.iter().map(|start| OngoingRollout::new(start)).collect();
    let steps = starts.first().map_or(0, |start| start.task.rules.steps_per_action);
    let horizon = sequences.iter().map(Vec::len).max().unwrap_or(0);
    for index in 0..horizon {
        for (rollout, sequence) in rollouts.iter_mut().zip(sequences) {
            match sequence.get(index) {
                Some(&action) if !rollout.over && index < rollout.actions_left => rollout.place(action),
                _ => rollout.over = true,
            }
        }
        for _ in 0..steps / predictor.interval() {
            advance(predictor, &mut rollouts, stop)?;
        }
        rollouts.iter_mut().for_each(OngoingRollout::end_action);
    }
    Ok(rollouts.into_iter().map(|rollout| rollout.outcome).collect())
}

/// One prediction for all rollouts that are not over.
fn advance(predictor: &dyn Predictor, rollouts: &mut [OngoingRollout], stop: &Stop) -> Result<()> {
    let mut running: Vec<&mut OngoingRollout> = rollouts.iter_mut().filter(|rollout| !rollout.over).collect();
    let balls: Vec<BallState> = running.iter().map(|rollout| rollout.ball).collect();
    let tools: Vec<&[Tool]> = running.iter().map(|rollout| rollout.tools.as_slice()).collect();
    let next = predictor.advance_until(stop, &balls, &tools)?;
    for (rollout, next) in running.iter_mut().zip(next) {
        rollout.go_to(next);
    }
    Ok(())
}

impl OngoingRollout {
    fn new(start: &Snapshot) -> Self {
        let task = &start.task;
        let tools: Vec<Tool> = start.world.tools().copied().collect();
        let ball = start.ball();
        let stages = task.stages();
        Self {
            snapshot: start.clone(),
            ball,
            radius: task.ball.radius,
            placed_by: vec![None; tools.len()],
            tools,
            target: stages[start.stage().min(stages.len() - 1)],
            actions_left: task.rules.max_actions.saturating_sub(start.actions) as usize,
            over: start.end().is_some(),
            outcome: Rollout { path: vec![to_normalised(ball.position)], ..Rollout::default() },
        }
    }

    /// Places the task's tool, if it may be placed there.
    fn place(&mut self, action: Action) {
        self.snapshot.set_ball(self.ball);
        let placed = self.snapshot.place(action) == Placement::Placed;
        if placed {
            self.placed_by.push(Some(self.outcome.actions.len()));
            self.tools.extend(self.snapshot.world.tools().last().copied());
        }
        self.outcome.actions.push(RolloutAction { action, placed, touched: false });
    }

    /// Whether the target is reached on the way to the state `next`.
    fn reaches(&self, next: &BallState) -> bool {
        let target = to_units(self.target.position);
        distance_to_segment(target, self.ball.position, next.position) <= self.target.radius + self.radius
    }

    /// Notes the ball after its latest action, if that has not ended before.
    fn end_action(&mut self) {
        if self.outcome.balls.len() < self.outcome.actions.len() {
            self.outcome.balls.push(self.ball);
        }
    }

    fn go_to(&mut self, next: BallState) {
        let (radius, hit) = (self.radius, self.reaches(&next));
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
