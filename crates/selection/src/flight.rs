//! What happens if nothing more is placed, or one tool.

use mge_env::{Choice, Environment, MARKER, TARGET, goal_object};
use mge_physics::{BallState, ObjectId, SCREEN, to_units};
use mge_task::Task;

/// Actions that are simulated: 12 s.
const ACTIONS: usize = 9;
/// The action that places nothing: every action set begins with it.
pub(super) const NO_OP: Choice = Choice { tool: 0, place: [0.0; 2] };

/// How near a ball came to its aim, in units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Approach {
    /// Least distance of the centres.
    pub distance: f32,
    /// From the ball to the aim, there.
    pub offset: [f32; 2],
    /// The ball's velocity there, in units/s.
    pub velocity: [f32; 2],
    /// The number of physics steps until then.
    pub step: usize,
}

impl Approach {
    /// That of a ball on a path; `aim` tells where its aim is at each step.
    pub(super) fn of(path: &[BallState], aim: impl Fn(usize) -> [f32; 2]) -> Self {
        let at = |(step, ball): (usize, &BallState)| {
            let offset = difference(aim(step), ball.position);
            Self { distance: offset[0].hypot(offset[1]), offset, velocity: ball.velocity, step }
        };
        let nearest = path.iter().enumerate().map(at).min_by(|a, b| a.distance.total_cmp(&b.distance));
        nearest.unwrap_or_default()
    }
}

/// What becomes of an episode within nine actions.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// States of all balls and boxes, by ball, then by physics step; the first is the present one.
    pub paths: Vec<Vec<BallState>>,
    /// Whether the goal is reached.
    pub goal: bool,
    /// Whether the target counts as moved.
    pub target_moved: bool,
    /// Number of subgoals that have been reached.
    pub subgoals: usize,
    /// How near the target comes to the goal.
    pub to_goal: Approach,
    /// How near the marker comes to the target, if there is one.
    pub to_target: Option<Approach>,
}

impl Flight {
    /// Simulates one action, such as the no-op, after which nothing more is placed.
    pub fn after(env: &Environment, action: Choice) -> Self {
        let mut env = env.clone();
        let world = &env.snapshot().world;
        let mut paths: Vec<_> = (0..world.ball_count()).map(|ball| vec![world.ball(ball)]).collect();
        for action in std::iter::once(action).chain([NO_OP; ACTIONS - 1]) {
            let watched = env.step_watched(action, |world| {
                paths.iter_mut().enumerate().for_each(|(ball, path)| path.push(world.ball(ball)));
            });
            if watched.is_err() {
                break;
            }
        }
        let (state, task) = (env.snapshot(), env.task());
        let to_goal = Approach::of(&paths[TARGET], |step| goal_at(task, &paths, step));
        let to_target = task.marker.as_ref().map(|_| Approach::of(&paths[MARKER], |step| paths[TARGET][step].position));
        let subgoals = state.reached.iter().filter(|reached| **reached).count();
        let (goal, target_moved) = (state.goal_reached, state.target_moved);
        Self { paths, goal, target_moved, subgoals, to_goal, to_target }
    }

    /// A number that is higher the more is achieved. Distances count by half a screen.
    pub fn score(&self) -> f32 {
        3.0 * f32::from(self.goal) + 0.5 * f32::from(self.target_moved) + 0.2 * self.subgoals as f32
            - length(self.to_goal.distance)
            - 0.3 * self.to_target.map_or(0.0, |approach| length(approach.distance))
    }

    /// The balls that are not where they were at the end.
    pub fn moving(&self) -> impl Iterator<Item = usize> {
        let moves = |path: &Vec<BallState>| path.first().map(|s| s.position) != path.last().map(|s| s.position);
        (0..self.paths.len()).filter(move |ball| moves(&self.paths[*ball]))
    }
}

/// Where the goal is at a step or, after the last one, at the end, in units.
pub(super) fn goal_at(task: &Task, paths: &[Vec<BallState>], step: usize) -> [f32; 2] {
    match goal_object(task) {
        ObjectId::Ball(ball) => at(&paths[ball], step).position,
        _ => to_units(task.goal.position),
    }
}

/// The state at a step or, after the last one, at the end. No path is empty.
pub(super) fn at(path: &[BallState], step: usize) -> &BallState {
    &path[step.min(path.len() - 1)]
}

pub(super) fn difference(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// A length in units as a feature: 1 is half the screen.
pub(super) fn length(units: f32) -> f32 {
    units / (SCREEN / 2.0)
}
