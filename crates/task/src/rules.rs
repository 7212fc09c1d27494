//! Limits, rewards and termination of an episode.

use educe::Educe;
use serde::{Deserialize, Serialize};

use mge_physics::{GRAVITY, STEPS_PER_ACTION};

/// The rules of a task. CREATE's own levels are loaded with [`Rules::of_create`].
#[derive(Debug, Clone, Copy, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Rules {
    /// Actions after which the episode is truncated.
    #[educe(Default = 20)]
    pub max_actions: u32,
    /// Physics steps after each action.
    #[educe(Default = STEPS_PER_ACTION)]
    pub steps_per_action: u32,
    /// Gravity in units per second squared.
    #[educe(Default = GRAVITY)]
    pub gravity: [f32; 2],
    /// Reward terms.
    pub rewards: Rewards,
    /// A placement at most this far (normalised) from a tool placed earlier is blocked.
    #[educe(Default = 0.3)]
    pub overlap_threshold: f32,
    /// When a subgoal counts as reached.
    pub subgoal_check: SubgoalCheck,
    /// Subgoals count only in order, and the goal only after all of them.
    #[educe(Default = true)]
    pub in_order: bool,
    /// Reaching the goal terminates the episode.
    #[educe(Default = true)]
    pub goal_ends_episode: bool,
    /// A captured ball counts as standing still.
    #[educe(Default = true)]
    pub capture_is_standstill: bool,
    /// A ball slower than this (units/s) stands still.
    #[educe(Default = 0.05)]
    pub min_speed: f32,
    /// Number of actions ending in standstill after which the episode terminates.
    #[educe(Default = 2)]
    pub still_actions: u32,
    /// Half width of the uniform noise on the ball's start, normalised.
    pub start_noise: f32,
}

/// Reward terms of one action; all that apply are added.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rewards {
    /// The goal is reached.
    pub goal: f32,
    /// Each subgoal reached.
    pub subgoal: f32,
    /// Every action.
    pub step: f32,
    /// The placement was blocked or invalid.
    pub blocked: f32,
    /// The target ball was set in motion (marker levels).
    pub target_moved: f32,
    /// Subtracted from the goal's and a subgoal's reward for every tool placed so far.
    pub cost_per_tool: f32,
}

/// When a subgoal counts as reached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SubgoalCheck {
    /// The ball touches it in any physics step.
    #[default]
    AnyStep,
    /// The ball touches it at the end of an action, as in CREATE.
    ActionEnd,
}

impl Default for Rewards {
    fn default() -> Self {
        Self { goal: 10.0, subgoal: 2.0, step: 0.01, blocked: -0.01, target_moved: 0.0, cost_per_tool: 0.0 }
    }
}

impl Rules {
    /// The rules of CREATE's own levels. In CREATE the action after the last allowed one ends the episode, hence 31
    /// actions.
    pub fn of_create() -> Self {
        Self {
            max_actions: 31,
            rewards: Rewards { target_moved: 1.0, cost_per_tool: 0.1, ..Rewards::default() },
            subgoal_check: SubgoalCheck::ActionEnd,
            in_order: false,
            goal_ends_episode: false,
            capture_is_standstill: false,
            ..Self::default()
        }
    }
}
