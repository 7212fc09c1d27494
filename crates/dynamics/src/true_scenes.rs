//! True outcomes in complete task scenes, with which predictions are compared.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;

use super::error::Result;
use super::predictor::{Errors, Predictor};
use mge_base::stop::Stop;
use mge_env::{Action, Environment, Snapshot, uniform_action};
use mge_physics::{BallState, STEPS_PER_ACTION, Tool};
use mge_task::Task;

/// The states before every action of random episodes, unless `stop` is requested.
pub(super) fn random_states(
    task: &Arc<Task>,
    episodes: usize,
    rng: &mut ChaCha8Rng,
    stop: &Stop,
) -> Result<Vec<Snapshot>> {
    let mut states = Vec::new();
    let mut env = Environment::new(task.clone());
    for _ in 0..episodes.max(1) {
        stop.check()?;
        env.reset(rng);
        while env.snapshot().end().is_none() {
            states.push(env.snapshot().clone());
            if env.step(uniform_action(rng)).is_err() {
                break;
            }
        }
    }
    Ok(states)
}

/// Whether `actions` really reach the next stage of `start`.
pub(super) fn reaches_next_stage(task: &Arc<Task>, start: &Snapshot, actions: &[Action]) -> bool {
    let mut env = Environment::new(task.clone());
    env.restore(start);
    let reached = |env: &Environment| env.snapshot().stage() > start.stage() || env.snapshot().goal_reached;
    actions.iter().any(|&action| env.step(action).is_ok() && reached(&env))
}

/// Real rollouts: for each start, the ball before every action and at the end, and the tools
/// present during every action.
pub(super) struct TrueScenes(Vec<(Vec<BallState>, Vec<Vec<Tool>>)>);

impl TrueScenes {
    /// Plays `sequences[i]` from `starts[i]`, unless `stop` is requested.
    pub fn play(task: &Arc<Task>, starts: &[Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Self> {
        let mut env = Environment::new(task.clone());
        let play = |(start, actions): (&Snapshot, &Vec<Action>)| {
            stop.check()?;
            env.restore(start);
            let (mut balls, mut tools) = (vec![start.ball()], Vec::new());
            for &action in actions {
                if env.step(action).is_err() {
                    break;
                }
                balls.push(env.snapshot().ball());
                tools.push(env.snapshot().world.tools().copied().collect());
            }
            Ok((balls, tools))
        };
        starts.iter().zip(sequences).map(play).collect::<Result<_>>().map(Self)
    }

    /// Errors after 1, 2, ... actions, over the rollouts that lasted that long.
    ///
    /// # Errors
    /// When the predictor cannot predict a scene, or `stop` is requested.
    pub fn errors(&self, predictor: &dyn Predictor, horizon: usize, stop: &Stop) -> Result<Vec<Errors>> {
        let mut balls: Vec<BallState> = self.0.iter().map(|(balls, _)| balls[0]).collect();
        let mut errors = Vec::new();
        for action in 0..horizon {
            let lasting: Vec<usize> = (0..self.0.len()).filter(|&scene| self.0[scene].1.len() > action).collect();
            let tools: Vec<&[Tool]> = lasting.iter().map(|&scene| self.0[scene].1[action].as_slice()).collect();
            let mut now: Vec<BallState> = lasting.iter().map(|&scene| balls[scene]).collect();
            for _ in 0..STEPS_PER_ACTION / predictor.interval() {
                now = predictor.advance_until(stop, &now, &tools)?;
            }
            let real = lasting.iter().map(|&scene| &self.0[scene].0[action + 1]);
            errors.push(Errors::between(now.iter().zip(real)));
            lasting.iter().zip(&now).for_each(|(&scene, ball)| balls[scene] = *ball);
        }
        Ok(errors)
    }
}
