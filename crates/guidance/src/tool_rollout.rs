//! Predictors of rollouts for an agent that chooses among tools: the true physics, and learned models of CREATE's
//! tools.

use rayon::prelude::*;

use super::rollout::{RolloutModel, TruePhysics};
use mge_dynamics::{Model, Result, RolloutAction, rollouts_with_tools};
use mge_env::{Choice, Environment, Placement, Snapshot};
use mge_physics::{ObjectId, Tool, World};

/// Predicts the outcome of a sequence of choices among tools.
pub trait ToolModel: RolloutModel {
    /// Rolls out `sequences[i]` from `starts[i]` with the task and the action set of `env`, each until a stage is
    /// reached, the episode is over or the sequence ends.
    ///
    /// # Errors
    /// When the model cannot predict the scenes of the task or a tool of the set.
    fn tool_rollouts(
        &self,
        env: &Environment,
        starts: &[&Snapshot],
        sequences: &[Vec<Choice>],
    ) -> Result<Vec<ToolRollout>>;
}

/// The outcome of one sequence of choices, predicted or simulated.
#[derive(Debug, Clone)]
pub struct ToolRollout {
    /// The actions taken, up to the end of the rollout.
    pub actions: Vec<RolloutAction>,
    /// A stage was reached, during the last of `actions`.
    pub hit: bool,
    /// The state at the end, if the rollout was simulated.
    pub end: Option<Snapshot>,
}

impl ToolModel for TruePhysics {
    fn tool_rollouts(
        &self,
        env: &Environment,
        starts: &[&Snapshot],
        sequences: &[Vec<Choice>],
    ) -> Result<Vec<ToolRollout>> {
        let pairs = starts.par_iter().zip(sequences);
        Ok(pairs.map(|(start, choices)| play(env.clone(), start, choices)).collect())
    }
}

impl ToolModel for Model {
    fn tool_rollouts(
        &self,
        env: &Environment,
        starts: &[&Snapshot],
        sequences: &[Vec<Choice>],
    ) -> Result<Vec<ToolRollout>> {
        let model = self.for_task(env.task())?;
        let set = env.action_set().cloned().unwrap_or_default();
        let tools: Vec<Tool> = set.tools().flatten().copied().collect();
        model.check_tools(env.task(), &tools)?;
        let rolled = rollouts_with_tools(&*model, &set, starts, sequences)?;
        let predicted = rolled.into_iter();
        Ok(predicted.map(|rollout| ToolRollout { actions: rollout.actions, hit: rollout.hit, end: None }).collect())
    }
}

/// Plays choices until a stage is reached or the episode is over. Touches of a tool by any ball count, also after the
/// stage was reached in the last action.
fn play(mut env: Environment, start: &Snapshot, choices: &[Choice]) -> ToolRollout {
    env.restore(start);
    let first = env.task().tools.len() + start.placed().len();
    let (mut actions, mut placed_by) = (Vec::<RolloutAction>::new(), Vec::new());
    let mut hit = false;
    for choice in choices {
        let mut touched = Vec::new();
        let note = |world: &World| {
            touched.extend(world.touches().iter().filter_map(|touch| match touch.object {
                ObjectId::Tool(tool) => tool.checked_sub(first),
                _ => None,
            }));
        };
        let Ok(step) = env.step_watched(*choice, note) else { break };
        let placed = step.placement == Placement::Placed;
        if placed {
            placed_by.push(actions.len());
        }
        actions.push(RolloutAction { action: choice.place, placed, touched: false });
        for action in touched.into_iter().filter_map(|tool| placed_by.get(tool)) {
            actions[*action].touched = true;
        }
        hit = step.reached_stage();
        if hit || step.end.is_some() {
            break;
        }
    }
    ToolRollout { actions, hit, end: Some(env.snapshot().clone()) }
}
