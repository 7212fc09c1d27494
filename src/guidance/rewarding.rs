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
        let chosen = if self.hit { which.of(&self.actions) } else { Vec::new() };
        chosen.into_iter().map(|index| self.actions[index].action).collect()
    }
}

impl Rewarding {
    /// Indices of the chosen ones of the actions that led to a stage.
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

/// The actions of a piece of real play, and what became of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Played {
    pub(super) actions: Vec<RolloutAction>,
    /// The agent's vector of each of them.
    vectors: Vec<Vec<f32>>,
    /// The action that placed each of the agent's tools; tools of the start belong to none.
    placed_by: Vec<Option<usize>>,
}

impl Played {
    /// Play that begins with `tools` placed by the agent earlier.
    pub fn after(tools: usize) -> Self {
        Self { placed_by: vec![None; tools], ..Self::default() }
    }

    /// Notes an action and its outcome: a place and, where the agent chooses among tools, the
    /// [embedding](crate::env::tool_embedding) of a tool.
    pub fn note(&mut self, vector: &[f32], step: &Step) {
        let placed = step.placement == Placement::Placed;
        if placed {
            self.placed_by.push(Some(self.actions.len()));
        }
        self.actions.push(RolloutAction { action: [vector[0], vector[1]], placed, touched: false });
        self.vectors.push(vector.to_vec());
        for index in step.touched.iter().filter_map(|&tool| self.placed_by[tool]) {
            self.actions[index].touched = true;
        }
    }

    /// The actions to store for the stage that the latest one reached. Play towards the
    /// next stage begins.
    pub fn take_rewarding(&mut self, which: Rewarding) -> Vec<Vec<f32>> {
        let rewarding = which.of(&self.actions).into_iter().map(|index| self.vectors[index].clone()).collect();
        self.actions.clear();
        self.vectors.clear();
        self.placed_by.fill(None);
        rewarding
    }
}
