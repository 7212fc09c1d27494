//! Predictors of rollouts: learned models, rapier's own solver and the true physics.

use rayon::prelude::*;

use super::rewarding::Played;
use mge_base::stop::Stop;
use mge_dynamics::{Model, Rapier, Result, Rollout, rollouts};
use mge_env::{Action, Environment, Snapshot};
use mge_physics::to_normalised;

/// Predicts the outcome of a sequence of actions.
pub trait RolloutModel: std::fmt::Debug + Send + Sync {
    /// The name that a prior records.
    fn name(&self) -> String {
        "unnamed".to_owned()
    }

    /// SHA-256 of its file, which a prior records too; None without a file.
    fn sha256(&self) -> Option<String> {
        None
    }

    /// Number of actions that rollouts took in the real environment; 0 if they are predictions.
    fn environment_actions(&self, _rollouts: &[Rollout]) -> u64 {
        0
    }

    /// Rolls out `sequences[i]` from `starts[i]`, each until the next stage of its start
    /// is reached, the episode is over, or the sequence ends. All starts are of one task, which random shifts may
    /// have changed.
    ///
    /// # Errors
    /// When the model cannot predict the task's scenes; [`DynamicsError::Stopped`](mge_dynamics::DynamicsError::Stopped)
    /// soon after `stop` is requested.
    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Vec<Rollout>>;
}

impl RolloutModel for Model {
    fn name(&self) -> String {
        self.id().name
    }

    fn sha256(&self) -> Option<String> {
        Some(self.id().sha256)
    }

    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Vec<Rollout>> {
        let Some(first) = starts.first() else { return Ok(Vec::new()) };
        rollouts(&*self.for_task(&first.task)?, starts, sequences, stop)
    }
}

/// rapier's own solver as a model: see [`Rapier`].
#[derive(Debug, Clone, Copy, Default)]
pub struct RapierPhysics;

impl RolloutModel for RapierPhysics {
    fn name(&self) -> String {
        "rapier".to_owned()
    }

    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Vec<Rollout>> {
        let Some(first) = starts.first() else { return Ok(Vec::new()) };
        rollouts(&Rapier::new(&first.task), starts, sequences, stop)
    }
}

/// The environment itself as a model: perfect predictions.
#[derive(Debug, Clone, Copy, Default)]
pub struct TruePhysics;

impl RolloutModel for TruePhysics {
    fn name(&self) -> String {
        "true physics".to_owned()
    }

    fn environment_actions(&self, rollouts: &[Rollout]) -> u64 {
        rollouts.iter().map(|rollout| rollout.actions.len() as u64).sum()
    }

    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Vec<Rollout>> {
        let pairs = starts.par_iter().zip(sequences);
        let roll_out = |(start, sequence): (&&Snapshot, &Vec<Action>)| {
            stop.check()?;
            Ok(true_rollout(start, sequence))
        };
        pairs.map(roll_out).collect()
    }
}

fn true_rollout(start: &Snapshot, sequence: &[Action]) -> Rollout {
    let mut env = Environment::new(start.task.clone());
    env.restore(start);
    let mut rollout = Rollout { path: vec![to_normalised(start.ball().position)], ..Rollout::default() };
    let mut played = Played::after(start.placed.len());
    let stage = start.stage();
    for &action in sequence {
        let path = &mut rollout.path;
        let Ok(step) = env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position))) else {
            break;
        };
        played.note(action, &step);
        rollout.balls.push(env.snapshot().ball());
        rollout.hit = step.subgoals.contains(&stage) || (stage == start.task.subgoals.len() && step.goal);
        if rollout.hit || step.end.is_some() {
            break;
        }
    }
    rollout.actions = played.actions;
    rollout
}
