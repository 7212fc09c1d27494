//! Rollouts of a model from given states, and which of their actions are rewarding.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::env::{Action, Environment, Placement, Snapshot, Step};
use crate::physics::{BallState, to_normalised};
use crate::task::Task;

/// Something that predicts what becomes of a sequence of actions.
pub trait RolloutModel: std::fmt::Debug + Send + Sync {
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
    /// Motion of the ball after each of `actions`, in units.
    pub balls: Vec<BallState>,
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
        match self.hit {
            true => which.of(&self.actions),
            false => Vec::new(),
        }
    }
}

impl Rewarding {
    /// The chosen ones of the actions that led to a stage.
    fn of(self, actions: &[RolloutAction]) -> Vec<Action> {
        let chosen = |wanted: fn(&&RolloutAction) -> bool| actions.iter().filter(wanted).map(|a| a.action).collect();
        match self {
            Self::Touched => chosen(|a| a.placed && a.touched),
            Self::Placed => chosen(|a| a.placed),
            Self::Last => actions.iter().rev().find(|a| a.placed).map(|a| a.action).into_iter().collect(),
            Self::All => chosen(|_| true),
        }
    }
}

/// The actions of a piece of real play, and what became of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Played {
    actions: Vec<RolloutAction>,
    /// The action that placed each of the agent's tools; tools of the start belong to none.
    placed_by: Vec<Option<usize>>,
}

impl Played {
    /// Play that begins with `tools` placed by the agent earlier.
    pub fn after(tools: usize) -> Self {
        Self { actions: Vec::new(), placed_by: vec![None; tools] }
    }

    /// Notes an action and its outcome.
    pub fn note(&mut self, action: Action, step: &Step) {
        let placed = step.placement == Placement::Placed;
        if placed {
            self.placed_by.push(Some(self.actions.len()));
        }
        self.actions.push(RolloutAction { action, placed, touched: false });
        for index in step.touched.iter().filter_map(|&tool| self.placed_by[tool]) {
            self.actions[index].touched = true;
        }
    }

    /// The actions to store for the stage that the latest one reached. Play towards the
    /// next stage begins.
    pub fn take_rewarding(&mut self, which: Rewarding) -> Vec<Action> {
        let rewarding = which.of(&self.actions);
        self.actions.clear();
        self.placed_by.fill(None);
        rewarding
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
    let mut played = Played::after(start.placed().len());
    let stage = start.stage();
    for &action in sequence {
        let path = &mut rollout.path;
        let Ok(step) = env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position))) else {
            break;
        };
        played.note(action, &step);
        rollout.balls.push(env.snapshot().ball());
        rollout.hit = step.subgoals.contains(&stage) || (stage == task.subgoals.len() && step.goal);
        if rollout.hit || step.end.is_some() {
            break;
        }
    }
    rollout.actions = played.actions;
    rollout
}
