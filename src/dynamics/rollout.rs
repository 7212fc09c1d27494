//! Model rollouts: thousands of action sequences as one batch for every prediction.

use super::error::DynamicsError;
use super::model::Model;
use super::predictor::Predictor;
use crate::env::{Action, Placement, Snapshot};
use crate::physics::{Ball, BallState, SCREEN, Tool, to_normalised, to_units};
use crate::task::{Region, Task};

/// A ball counts as having touched a tool when its surface was predicted to be nearer to
/// the tool's than this, in units: predictions see the ball only once in an interval.
const TOUCH_GAP: f32 = 2.0;

/// What a model predicts for one sequence of actions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Predicted {
    /// For each action taken, whether its tool was placed.
    pub placed: Vec<bool>,
    /// For each action taken, whether the ball touched its tool before the stage was reached.
    pub touched: Vec<bool>,
    /// The next stage was reached, in the last action taken.
    pub hit: bool,
    /// Normalised positions of the ball from the start on, one a prediction.
    pub path: Vec<[f32; 2]>,
    /// Motion of the ball after each action taken, in units.
    pub balls: Vec<BallState>,
}

/// One rollout under way.
struct Scene {
    snapshot: Snapshot,
    ball: BallState,
    tools: Vec<Tool>,
    /// The action that placed each tool; tools of the start belong to none.
    placed_by: Vec<Option<usize>>,
    stage: Region,
    /// Actions that the episode still allows.
    actions_left: usize,
    over: bool,
    predicted: Predicted,
}

impl Model {
    /// Rolls out `sequences[i]` from `starts[i]` as [`rollouts`] does.
    ///
    /// # Errors
    /// When the model does not fit the task, see [`check_task`](Self::check_task), or a
    /// start has an object that is not finite.
    pub fn rollouts(
        &self,
        task: &Task,
        starts: &[&Snapshot],
        sequences: &[Vec<Action>],
    ) -> Result<Vec<Predicted>, DynamicsError> {
        self.check_task(task)?;
        rollouts(self, task, starts, sequences)
    }
}

/// Rolls out `sequences[i]` from `starts[i]`, each until the next stage of its start is
/// predicted to be reached, the ball leaves the screen, the episode's limit of actions or
/// the end of the sequence.
///
/// # Errors
/// When the predictor cannot predict a scene of the task.
pub fn rollouts(
    predictor: &dyn Predictor,
    task: &Task,
    starts: &[&Snapshot],
    sequences: &[Vec<Action>],
) -> Result<Vec<Predicted>, DynamicsError> {
    let stages = task.stages();
    let mut scenes: Vec<Scene> = starts.iter().map(|start| Scene::new(task, &stages, start)).collect();
    let horizon = sequences.iter().map(Vec::len).max().unwrap_or(0);
    for index in 0..horizon {
        for (scene, sequence) in scenes.iter_mut().zip(sequences) {
            match sequence.get(index) {
                Some(&action) if !scene.over && index < scene.actions_left => scene.place(task, action),
                _ => scene.over = true,
            }
        }
        for _ in 0..task.rules.steps_per_action / predictor.interval() {
            advance(predictor, &mut scenes)?;
        }
        for scene in scenes.iter_mut().filter(|scene| scene.predicted.balls.len() < scene.predicted.placed.len()) {
            scene.predicted.balls.push(scene.ball);
        }
    }
    Ok(scenes.into_iter().map(|scene| scene.predicted).collect())
}

/// One prediction for all rollouts that are not over.
fn advance(predictor: &dyn Predictor, scenes: &mut [Scene]) -> Result<(), DynamicsError> {
    let mut running: Vec<&mut Scene> = scenes.iter_mut().filter(|scene| !scene.over).collect();
    let balls: Vec<BallState> = running.iter().map(|scene| scene.ball).collect();
    let tools: Vec<&[Tool]> = running.iter().map(|scene| scene.tools.as_slice()).collect();
    let next = predictor.advance(&balls, &tools)?;
    for (scene, next) in running.iter_mut().zip(next) {
        scene.go_to(next);
    }
    Ok(())
}

impl Scene {
    fn new(task: &Task, stages: &[Region], start: &Snapshot) -> Self {
        let tools: Vec<Tool> = start.world().tools().copied().collect();
        let ball = start.ball();
        Self {
            snapshot: start.clone(),
            ball,
            placed_by: vec![None; tools.len()],
            tools,
            stage: stages[start.stage().min(stages.len() - 1)],
            actions_left: task.rules.max_actions.saturating_sub(start.actions()) as usize,
            over: start.end().is_some(),
            predicted: Predicted { path: vec![to_normalised(ball.position)], ..Predicted::default() },
        }
    }

    fn place(&mut self, task: &Task, action: Action) {
        self.snapshot.set_ball(self.ball);
        let placed = self.snapshot.place(task, action) == Placement::Placed;
        if placed {
            self.placed_by.push(Some(self.predicted.placed.len()));
            self.tools.extend(self.snapshot.world().tools().last().copied());
        }
        self.predicted.placed.push(placed);
        self.predicted.touched.push(false);
    }

    fn go_to(&mut self, next: BallState) {
        let radius = Ball::default().radius;
        let centre = to_units(self.stage.position);
        self.predicted.hit = distance_to_way(centre, self.ball.position, next.position) <= self.stage.radius + radius;
        for (tool, action) in self.tools.iter().zip(&self.placed_by).filter_map(|(tool, by)| Some((tool, (*by)?))) {
            let near = |ball: &BallState| tool.surface(ball.position).0 - radius < TOUCH_GAP;
            if !self.predicted.touched[action] && (near(&self.ball) || (!self.predicted.hit && near(&next))) {
                self.predicted.touched[action] = true;
            }
        }
        self.ball = next;
        self.predicted.path.push(to_normalised(next.position));
        let inside = next.position.iter().all(|p| *p > 0.0 && *p < SCREEN);
        self.over = self.predicted.hit || !inside;
    }
}

/// Distance from a point to the straight way from `from` to `to`.
pub(super) fn distance_to_way(point: [f32; 2], from: [f32; 2], to: [f32; 2]) -> f32 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let offset = [point[0] - from[0], point[1] - from[1]];
    let length = way[0] * way[0] + way[1] * way[1];
    let share = if length > 0.0 { ((offset[0] * way[0] + offset[1] * way[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (offset[0] - share * way[0]).hypot(offset[1] - share * way[1])
}
