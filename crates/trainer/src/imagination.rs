//! Model-generated transitions, which guided exploration avoids; a method for comparison.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::parts::ModelReplay;
use mge_agent::{Ddpg, OrnsteinUhlenbeck};
use mge_dynamics::DynamicsError;
use mge_env::{Action, Environment, Snapshot};
use mge_guidance::RolloutModel;

/// A transition predicted by the model.
pub(super) struct Imagined {
    pub observation: Vec<f32>,
    pub action: Action,
    pub reward: f32,
    pub next_observation: Vec<f32>,
    pub terminated: bool,
}

/// Rollouts of the noisy actor in the model, from states of real play in an environment like `env`.
///
/// # Errors
/// When the model cannot predict the task.
pub(super) fn imagine(
    model: &dyn RolloutModel,
    env: &Environment,
    states: &[Snapshot],
    ddpg: &Ddpg,
    config: &ModelReplay,
    noise_scale: f32,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<Imagined>, DynamicsError> {
    let mut transitions = Vec::new();
    if states.is_empty() {
        return Ok(transitions);
    }
    for _ in 0..config.rollouts {
        let mut env = env.clone();
        env.restore(&states[rng.gen_range(0..states.len())]);
        let mut noise = OrnsteinUhlenbeck::new(2, ddpg.config().ou);
        noise.set_scale(noise_scale);
        let mut observation = env.observation();
        for _ in 0..config.horizon {
            let mut action = ddpg.act(&observation);
            noise.perturb(&mut action, rng);
            let action = [action[0], action[1]];
            let rollout = model.rollouts(&[env.snapshot()], &[vec![action]])?;
            let Some((rollout, ball)) = rollout.first().and_then(|r| Some((r, *r.balls.first()?))) else { break };
            let Ok(step) = env.step_predicted(action, ball, rollout.hit) else { break };
            let over = step.end.is_some();
            transitions.push(Imagined {
                observation: std::mem::replace(&mut observation, step.observation.clone()),
                action,
                reward: step.reward,
                next_observation: step.observation,
                terminated: step.terminated,
            });
            if over {
                break;
            }
        }
    }
    Ok(transitions)
}
