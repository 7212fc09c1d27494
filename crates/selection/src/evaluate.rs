//! Episodes of a policy, or of random play.

use std::sync::Arc;

use super::decision::Decision;
use super::policy::{Policy, Settings};
use mge_base::streams::{Stream, index};
use mge_env::{Choice, Environment, uniform_action};
use mge_physics::ToolSplit;
use mge_task::Task;

/// The result of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evaluation {
    /// Episodes played.
    pub episodes: usize,
    /// Episodes that reached the goal.
    pub successes: usize,
    /// Actions in all of them.
    pub actions: u64,
}

/// Plays episodes with action sets of a split: the best candidate of the task's policy is every action; without a
/// policy, actions are uniformly random. Starts and action sets depend on the seed only.
///
/// # Panics
/// If the policy is for a task with other objects.
pub fn evaluate(
    task: &Arc<Task>,
    split: ToolSplit,
    policy: Option<&Policy>,
    settings: Settings,
    mut on_progress: impl FnMut(usize),
) -> Evaluation {
    let (mut starts, mut rng) = (Stream::Evaluation.of(settings.seed), Stream::Candidates.of(settings.seed));
    let mut env = Environment::new(task.clone()).with_tools(split);
    let mut result = Evaluation::default();
    while result.episodes < settings.episodes {
        env.reset(&mut starts);
        while !is_over(&env) {
            let choice = match (policy, env.action_set()) {
                (Some(policy), _) => {
                    let decision = Decision::new(&env, settings.candidates, &mut rng);
                    decision.choices[policy.best(&decision.rows)]
                }
                (None, set) => {
                    Choice { tool: index(&mut rng, set.map_or(1, |set| set.len())), place: uniform_action(&mut rng) }
                }
            };
            // The episode is not over.
            let _ = env.step_without_observation(choice);
        }
        result.episodes += 1;
        result.successes += usize::from(env.snapshot().goal_reached);
        result.actions += u64::from(env.snapshot().actions);
        on_progress(result.episodes);
    }
    result
}

/// Whether nothing is left to do.
pub(super) fn is_over(env: &Environment) -> bool {
    env.snapshot().end().is_some() || env.snapshot().goal_reached
}
