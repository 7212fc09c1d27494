//! Which actions of successful play are rewarding.

use serde::{Deserialize, Serialize};

use crate::dynamics::{Rollout, RolloutAction};
use crate::env::{Action, Placement, Step};

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
    pub(super) actions: Vec<RolloutAction>,
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
