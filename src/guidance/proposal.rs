//! Subgoals proposed by the program (the paper's future work): places that rollouts which
//! come near the goal pass through, and that the ball does not reach by itself.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::config::GuidanceConfig;
use super::rollout::RolloutModel;
use crate::dynamics::{DynamicsError, Rollout};
use crate::env::{Action, Environment, Snapshot, uniform_action};
use crate::physics::{Ball, SCREEN};
use crate::streams::Stream;
use crate::task::{Region, Task};

/// Share of the rollouts, those that come nearest to the goal, whose paths are considered.
const NEAR: f32 = 0.05;
/// A proposed subgoal is reached by at least and at most these shares of random rollouts:
/// seldom enough to be worth rewarding, often enough to be found.
const REACHED: [f32; 2] = [0.01, 0.12];
/// Of the places passed at least this often, relative to the one passed most, the earliest is proposed.
const OFTEN: f32 = 0.6;
/// Distance of the candidates from one another, normalised.
const SPACING: f32 = 0.05;

/// Proposes up to `count` subgoals for the task, in the order in which they are to be
/// reached; its present subgoals are ignored. Fewer, if there is no further place
/// that tools make the ball reach and that it does not reach by itself. `go_on` is asked
/// before each with the number of those found; if it says no, that is all.
///
/// # Errors
/// When the model cannot predict the task, or [is stopped](RolloutModel::is_stopped).
pub fn propose_subgoals(
    task: &Task,
    model: &dyn RolloutModel,
    count: usize,
    config: &GuidanceConfig,
    seed: u64,
    mut go_on: impl FnMut(usize) -> bool,
) -> Result<Vec<Region>, DynamicsError> {
    let mut task = Task { subgoals: Vec::new(), ..task.clone() };
    // The actions from the start of an episode to each state in which the last subgoal was reached.
    let mut histories: Vec<Vec<Action>> = vec![Vec::new()];
    for number in 1..=count {
        if !go_on(task.subgoals.len()) {
            break;
        }
        let mut rng = Stream::Proposal(number).of(seed);
        let now = Arc::new(task.clone());
        let states: Vec<Snapshot> = histories.iter().map(|history| replay(&now, history)).collect();
        let chosen: Vec<usize> = (0..config.model_rollouts).map(|_| rng.gen_range(0..states.len())).collect();
        let sequences = random_sequences(config, &mut rng);
        let starts: Vec<&Snapshot> = chosen.iter().map(|&start| &states[start]).collect();
        let rollouts = model.rollouts(&now, &starts, &sequences)?;
        let Some(region) = best_region(&task, &rollouts) else { break };
        task.subgoals.push(region);
        let passing = (0..rollouts.len()).filter(|&index| passes(&rollouts[index].path, &region));
        histories = real_histories(
            model,
            &Arc::new(task.clone()),
            passing.map(|index| [histories[chosen[index]].as_slice(), &sequences[index]].concat()),
        );
        if model.is_stopped() {
            return Err(DynamicsError::Stopped);
        }
        if histories.is_empty() {
            // Predicted, but never true.
            task.subgoals.pop();
            break;
        }
    }
    Ok(task.subgoals)
}

fn random_sequences(config: &GuidanceConfig, rng: &mut ChaCha8Rng) -> Vec<Vec<Action>> {
    (0..config.model_rollouts).map(|_| (0..config.horizon).map(|_| uniform_action(rng)).collect()).collect()
}

fn replay(task: &Arc<Task>, history: &[Action]) -> Snapshot {
    let mut env = Environment::new(task.clone());
    for &action in history {
        if env.step(action).is_err() {
            break;
        }
    }
    env.snapshot().clone()
}

/// The candidates cut to where they reach the task's last subgoal in the environment;
/// those that never do are left out.
fn real_histories(
    model: &dyn RolloutModel,
    task: &Arc<Task>,
    candidates: impl Iterator<Item = Vec<Action>>,
) -> Vec<Vec<Action>> {
    let last = task.subgoals.len();
    let reach = |mut history: Vec<Action>| {
        let mut env = Environment::new(task.clone());
        let taken = history.iter().take_while(|&&action| env.snapshot().stage() < last && env.step(action).is_ok());
        let taken = taken.count();
        history.truncate(taken);
        (env.snapshot().stage() == last && env.snapshot().end().is_none()).then_some(history)
    };
    candidates.take_while(|_| !model.is_stopped()).filter_map(reach).collect()
}

/// The earliest of the places that many of the rollouts nearest to the goal pass before they get there.
fn best_region(task: &Task, rollouts: &[Rollout]) -> Option<Region> {
    let goal = task.goal.position;
    let touched = |rollout: &&Rollout| rollout.actions.iter().any(|action| action.touched);
    let mut near: Vec<(f32, &[[f32; 2]])> =
        rollouts.iter().filter(touched).map(|r| path_towards(goal, &r.path)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate((rollouts.len() as f32 * NEAR).ceil() as usize);

    let share = |count: usize, of: usize| count as f32 / of.max(1) as f32;
    let free: Vec<&Rollout> = rollouts.iter().filter(|rollout| !touched(rollout)).collect();
    let score = |region: &Region| {
        let reached = share(rollouts.iter().filter(|r| passes(&r.path, region)).count(), rollouts.len());
        let freely = share(free.iter().filter(|r| passes(&r.path, region)).count(), free.len());
        ((REACHED[0]..=REACHED[1]).contains(&reached) && freely < reached / 2.0).then_some(())?;
        let passed: Vec<usize> = near.iter().filter_map(|(_, path)| first_pass(path, region)).collect();
        Some((passed.len(), share(passed.iter().sum(), passed.len())))
    };
    let regions = candidates(task, near.iter().flat_map(|(_, path)| path.iter()));
    let scored: Vec<((usize, f32), Region)> =
        regions.into_iter().filter_map(|region| Some((score(&region)?, region))).collect();
    let most = scored.iter().map(|((passed, _), _)| *passed).max()?;
    let often = scored.into_iter().filter(|((passed, _), _)| *passed > 0 && *passed as f32 >= OFTEN * most as f32);
    // The earlier a place is passed, the more height and time is left for what follows.
    often.min_by(|a, b| a.0.1.total_cmp(&b.0.1)).map(|(_, region)| region)
}

/// Least distance to the goal, and the path until then.
fn path_towards(goal: [f32; 2], path: &[[f32; 2]]) -> (f32, &[[f32; 2]]) {
    let distance = |point: &[f32; 2]| (point[0] - goal[0]).hypot(point[1] - goal[1]);
    let nearest = path.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or((f32::INFINITY, path), |(index, least)| (least, &path[..=index]))
}

/// Places on a grid that the points come by, not so near to the goal that they would be it.
fn candidates<'a>(task: &Task, points: impl Iterator<Item = &'a [f32; 2]>) -> Vec<Region> {
    let mut cells: Vec<[i32; 2]> = points.map(|point| point.map(|value| (value / SPACING).round() as i32)).collect();
    cells.sort_unstable();
    cells.dedup();
    let radius = task.goal.radius;
    let region = |cell: [i32; 2]| Region { position: cell.map(|value| value as f32 * SPACING), radius };
    let apart = |region: &Region| {
        let [x, y] = [0, 1].map(|axis| region.position[axis] - task.goal.position[axis]);
        x.hypot(y) * SCREEN / 2.0 > 2.0 * (radius + Ball::default().radius)
            && region.position.iter().all(|value| value.abs() <= 0.9)
    };
    cells.into_iter().map(region).filter(apart).collect()
}

fn passes(path: &[[f32; 2]], region: &Region) -> bool {
    first_pass(path, region).is_some()
}

/// Index of the first point of the path at which a ball touches the region.
fn first_pass(path: &[[f32; 2]], region: &Region) -> Option<usize> {
    let reach = (region.radius + Ball::default().radius) * 2.0 / SCREEN;
    path.iter().position(|[x, y]| (x - region.position[0]).hypot(y - region.position[1]) <= reach)
}
