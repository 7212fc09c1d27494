//! Rollouts of a model from given states, and which of their actions are rewarding.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::env::{Action, Environment, Placement, Snapshot};
use crate::physics::to_normalised;
use crate::task::Task;

/// Something that predicts what becomes of a sequence of actions.
pub trait RolloutModel: Sync {
    /// Rolls out `sequences[i]` from `starts[i]`, each until the next stage of its start
    /// is reached, the episode is over, or the sequence ends.
    fn rollouts(&self, task: &Arc<Task>, starts: &[&Snapshot], sequences: &[Vec<Action>]) -> Vec<Rollout>;
}

/// What a model predicts for one sequence of actions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rollout {
    /// The actions taken, up to the end of the rollout.
    pub actions: Vec<RolloutAction>,
    /// The next stage was reached, in the last of `actions`.
    pub hit: bool,
    /// Normalised positions of the ball, from the start on, one per prediction.
    pub path: Vec<[f32; 2]>,
}

/// One action of a rollout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RolloutAction {
    /// Where the tool was to be placed.
    pub action: Action,
    /// The tool was placed, not blocked.
    pub placed: bool,
    /// The ball touched that tool before the stage was reached.
    pub touched: bool,
}

/// Which actions of a rollout that reached its stage are stored as rewarding. The paper
/// leaves it open; all but `Touched` lose a factor of ten or more in final hits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rewarding {
    /// Those whose tool was placed and touched by the ball before the hit.
    #[default]
    Touched,
    /// Those whose tool was placed.
    Placed,
    /// Only the last one that was placed.
    Last,
    /// All of them: the paper's literal reading.
    All,
}

impl Rollout {
    /// The actions to store, none if the stage was not reached.
    pub fn rewarding(&self, which: Rewarding) -> Vec<Action> {
        if !self.hit {
            return Vec::new();
        }
        let chosen =
            |wanted: fn(&&RolloutAction) -> bool| self.actions.iter().filter(wanted).map(|a| a.action).collect();
        match which {
            Rewarding::Touched => chosen(|a| a.placed && a.touched),
            Rewarding::Placed => chosen(|a| a.placed),
            Rewarding::Last => self.actions.iter().rev().find(|a| a.placed).map(|a| a.action).into_iter().collect(),
            Rewarding::All => chosen(|_| true),
        }
    }
}

/// The environment itself as a model: perfect predictions.
#[derive(Debug, Clone, Copy, Default)]
pub struct TruePhysics;

impl RolloutModel for TruePhysics {
    fn rollouts(&self, task: &Arc<Task>, starts: &[&Snapshot], sequences: &[Vec<Action>]) -> Vec<Rollout> {
        starts.par_iter().zip(sequences).map(|(start, sequence)| true_rollout(task, start, sequence)).collect()
    }
}

fn true_rollout(task: &Arc<Task>, start: &Snapshot, sequence: &[Action]) -> Rollout {
    let mut env = Environment::new(task.clone());
    env.restore(start);
    let mut rollout = Rollout { path: vec![to_normalised(start.ball().position)], ..Rollout::default() };
    // The rollout's action that placed each tool; tools of the start belong to none.
    let mut placed_by: Vec<Option<usize>> = vec![None; start.placed().len()];
    let stage = start.stage();
    for &action in sequence {
        let path = &mut rollout.path;
        let Ok(step) = env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position))) else {
            break;
        };
        let placed = step.placement == Placement::Placed;
        if placed {
            placed_by.push(Some(rollout.actions.len()));
        }
        rollout.actions.push(RolloutAction { action, placed, touched: false });
        for index in step.touched.iter().filter_map(|&tool| placed_by[tool]) {
            rollout.actions[index].touched = true;
        }
        rollout.hit = step.subgoals.contains(&stage) || (stage == task.subgoals.len() && step.goal);
        if rollout.hit || step.end.is_some() {
            break;
        }
    }
    rollout
}
