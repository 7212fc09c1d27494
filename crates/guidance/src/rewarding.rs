//! Which actions of successful play are rewarding.

use serde::{Deserialize, Serialize};

use mge_dynamics::{Rollout, RolloutAction};
use mge_env::{Action, Placement, Step};

/// Which actions of a rollout that reached its stage are stored as rewarding. The paper
/// leaves this open; all choices but `Touched` reduce final hits by a factor of ten or more.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rewarding {
    /// Actions whose tool was placed and touched by the ball before the hit.
    #[default]
    Touched,
    /// Actions whose tool was placed.
    Placed,
    /// Only the last action whose tool was placed.
    Last,
    /// All actions: the paper's literal reading.
    All,
}

impl Rewarding {
    /// The actions of a rollout to store; none if the stage was not reached.
    pub fn actions_of(self, rollout: &Rollout) -> Vec<Action> {
        let chosen = if rollout.hit { self.of(&rollout.actions) } else { Vec::new() };
        chosen.into_iter().map(|index| rollout.actions[index].action).collect()
    }

    /// Indices of the rewarding ones among the actions that led to a stage.
    fn of(self, actions: &[RolloutAction]) -> Vec<usize> {
        let chosen = |wanted: fn(&RolloutAction) -> bool| (0..actions.len()).filter(move |&i| wanted(&actions[i]));
        match self {
            Self::Touched => chosen(|a| a.placed && a.touched).collect(),
            Self::Placed => chosen(|a| a.placed).collect(),
            Self::Last => chosen(|a| a.placed).next_back().into_iter().collect(),
            Self::All => chosen(|_| true).collect(),
        }
    }
}

/// The actions of a stretch of real play, and their outcomes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Played {
    pub(super) actions: Vec<RolloutAction>,
    /// The index of the action that placed each of the agent's tools; none for earlier tools.
    placed_by: Vec<Option<usize>>,
}

impl Played {
    /// Play that begins with `tools` tools placed earlier by the agent.
    pub fn after(tools: usize) -> Self {
        Self { placed_by: vec![None; tools], ..Self::default() }
    }

    /// Records an action and its outcome.
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

    /// The actions to store for the stage that was just reached. Resets the record for play towards
    /// the next stage.
    pub fn take_rewarding(&mut self, which: Rewarding) -> Vec<Action> {
        let rewarding = which.of(&self.actions).into_iter().map(|index| self.actions[index].action).collect();
        self.actions.clear();
        self.placed_by.fill(None);
        rewarding
    }
}
