//! What is shown over the scene of a subject: the view of the agent that acts, the path that the model predicts, and
//! the tool held in hand play.

use std::sync::Arc;

use super::Subject;
use crate::tui::scene::{Ghost, Heat};
use mge_base::stop::Stop;
use mge_env::{Action, Environment, Snapshot};
use mge_guidance::RolloutModel;
use mge_physics::{Tool, to_units};
use mge_task::Task;
use mge_trainer::{RunConfig, required_model};

/// Rows and columns of the grid on which the critic is evaluated.
const HEAT_SIDE: u32 = 36;
/// Number of actions that a prediction covers.
const LOOK_AHEAD: usize = 3;

/// A model together with the one task it was checked against.
#[derive(Debug, Clone)]
pub struct TaskModel {
    pub(in super::super) task: Arc<Task>,
    pub(in super::super) model: Arc<dyn RolloutModel>,
}

impl TaskModel {
    /// Loads the model of a configuration, or trains it, for its task.
    ///
    /// # Errors
    /// When the source has no model, or the model cannot be loaded or does not fit the task.
    pub fn new(config: &RunConfig) -> Result<Self, String> {
        let model = required_model(config, &Stop::default()).map_err(|error| error.to_string())?;
        Ok(Self { task: config.task.clone(), model })
    }

    /// Predicted normalised positions of the ball when `actions` are taken from a state.
    fn path(&self, start: &Snapshot, actions: Vec<Action>) -> Vec<[f32; 2]> {
        // A model that cannot predict the state shows no path.
        let rollouts = self.model.rollouts(&[start], &[actions], &Stop::default()).unwrap_or_default();
        rollouts.into_iter().next().map_or_else(Vec::new, |rollout| rollout.path)
    }
}

/// An agent's view of a state: its critic's values and its actor's choice.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentView {
    /// The critic's value of every action.
    pub heat: Heat,
    /// The tool that the agent would place, at its position.
    pub choice: Tool,
}

impl Subject {
    /// The agent's view of the state before action number `action` of the episode, counted from 0.
    ///
    /// # Errors
    /// Why there is none.
    pub fn agent_view(&self, action: usize) -> Result<AgentView, String> {
        let networks = self.networks.as_ref().ok_or_else(|| match &self.agent {
            _ if !self.is_of_run() => "no agent acts in this episode",
            Some(Err(reason)) => reason,
            Some(Ok(_)) => "this method has no networks",
            None => "the checkpoint is being read",
        })?;
        let env = self.replay(action).ok_or("the episode cannot be replayed")?;
        let observation = env.observation();
        if observation.len() != networks.observation_len() {
            return Err("the networks belong to another task".to_owned());
        }
        let action = networks.act(&observation);
        let place = *action.first_chunk().ok_or("the actor gives no position")?;
        let middle = |index: u32| (index as f32 + 0.5) / HEAT_SIDE as f32 * 2.0 - 1.0;
        let rows = (0..HEAT_SIDE).map(|row| -middle(row));
        let actions: Vec<f32> = rows.flat_map(|y| (0..HEAT_SIDE).flat_map(move |x| [middle(x), y])).collect();
        let values = networks.q_values(&observation, &actions);
        let heat = Heat::from_vec(HEAT_SIDE, HEAT_SIDE, values).ok_or("the critic values too few actions")?;
        Ok(AgentView { heat, choice: env.task().placeable.tool(place) })
    }

    /// The model's prediction for the next actions of the episode, from action number `action` on, counted
    /// from 0: normalised positions of the ball.
    ///
    /// # Errors
    /// Why there is no prediction.
    pub fn predict(&self, action: usize) -> Result<Vec<[f32; 2]>, String> {
        let model = self.model.as_ref().ok_or("the model is being loaded")?.as_ref().map_err(String::clone)?;
        if !self.episode.trace.start.tools.is_empty() {
            return Err("the model supports only the task's own tool".to_owned());
        }
        let env = self.replay(action).ok_or("the episode cannot be replayed")?;
        let steps = self.episode.trace.steps.iter().skip(action).take(LOOK_AHEAD);
        Ok(model.path(env.snapshot(), steps.map(|step| step.action).collect()))
    }

    /// The ball's real path during the actions that [`predict`](Self::predict) covers.
    pub fn truth(&self, action: usize) -> Vec<[f32; 2]> {
        let steps = self.episode.trace.steps.iter().skip(action).take(LOOK_AHEAD);
        steps.flat_map(|step| step.path.iter().copied()).collect()
    }

    /// The task's tool, held at a position: whether it can be placed there, and the model's prediction. None unless the
    /// episode is played by hand.
    pub fn ghost(&self, action: Action) -> Option<Ghost> {
        let snapshot = self.hand.as_ref()?;
        let tool = self.task.placeable.tool([0.0; 2]);
        let refusal = snapshot.refusal(&tool, action);
        let tool = tool.at(to_units(action.map(f64::from)));
        let mut ghost = Ghost { action, tool, refusal, predicted: Vec::new() };
        if snapshot.end().is_none()
            && ghost.refusal.is_none()
            && let Some(Ok(model)) = &self.model
        {
            // Placing the tool again would overlap itself, so the further actions place nothing.
            ghost.predicted = model.path(snapshot, vec![action; LOOK_AHEAD]);
        }
        Some(ghost)
    }

    /// The environment as it was before action number `action`, counted from 0. None if the episode cannot
    /// be replayed.
    fn replay(&self, action: usize) -> Option<Environment> {
        let mut env = self.episode.trace.environment(&self.task);
        for step in self.episode.trace.steps.iter().take(action) {
            env.step(step.action).ok()?;
        }
        Some(env)
    }
}
