//! Deep deterministic policy gradient (paper, section 2.2).

use dfdx::{losses::mse_loss, prelude::*};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::{Batch, DdpgConfig};
use mge_base::validation::ValidationError;
use mge_nn::{
    Activation, Init, InitScheme, Matrix, Mlp, MlpShape, NnError, Optimiser, concat_columns, join_rows, matrix,
};

/// Actor μ, critic Q, their targets μ' and Q', and the optimisers of the first two.
#[derive(Clone, Debug)]
pub struct Ddpg {
    pub(super) config: DdpgConfig,
    pub(super) actor: Mlp,
    pub(super) critic: Mlp,
    pub(super) target_actor: Mlp,
    pub(super) target_critic: Mlp,
    /// The held policy, which acts in place of the actor, if any.
    pub(super) held: Option<Mlp>,
    /// An earlier held policy, stored so that the agent can return to it.
    pub(super) proven: Option<Mlp>,
    pub(super) actor_optimiser: Optimiser,
    pub(super) critic_optimiser: Optimiser,
    pub(super) device: Cpu,
}

/// Lower bound of the mean magnitude of values that the actor's loss is divided by during imitation.
const MIN_SCALE: f32 = 1e-3;

/// Metrics of an update. Except for norms and maxima they are means over the minibatch, computed before
/// the step of the network they describe; the actor's use the critic after its step. The
/// [metrics](super#metrics) give the formulas.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UpdateMetrics {
    /// Mean squared difference of the critic from its target.
    pub critic_loss: f32,
    /// Negative mean value of the actor's actions; with imitation, in units of its mean magnitude
    /// and with the weighted distance added.
    pub actor_loss: f32,
    /// Mean value of the batch's actions.
    pub mean_q: f32,
    /// Greatest value of the batch's actions.
    pub max_q: f32,
    /// Fraction of the actor's action components beyond ±0.99.
    pub action_saturation: f32,
}

/// Why an update failed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum UpdateError {
    /// A loss is NaN or infinite. The agent cannot continue learning.
    #[error(
        "the {quantity} is {value} at update {update}: learning has diverged; lower the learning \
         rates or set `target_clamp`"
    )]
    Diverged {
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f32,
        /// The update, counted from 1.
        update: u64,
    },
    /// The optimiser rejected the gradients.
    #[error(transparent)]
    Network(#[from] NnError),
}

impl Ddpg {
    /// An agent with networks drawn from `rng`: actor first, then critic; targets are copies.
    ///
    /// # Errors
    /// If the config is invalid.
    ///
    /// # Panics
    /// If a length is 0.
    pub fn new(
        observation_len: usize,
        action_len: usize,
        config: &DdpgConfig,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, ValidationError> {
        assert!(observation_len > 0 && action_len > 0, "an agent needs vectors");
        let init = Init { scheme: InitScheme::FanIn, last_bound: Some(config.output_init_bound) };
        let [actor, critic] = Self::shapes(observation_len, action_len, config)?
            .map(|shape| Mlp::new(shape, init, rng).expect("all sizes are at least 1"));
        Ok(Self {
            target_actor: actor.clone(),
            target_critic: critic.clone(),
            actor_optimiser: Optimiser::new(config.optimiser, &[&actor]),
            critic_optimiser: Optimiser::new(config.optimiser, &[&critic]),
            held: None,
            proven: None,
            config: config.clone(),
            device: Cpu::default(),
            actor,
            critic,
        })
    }

    /// Shapes of actor, `s` to `u`, and critic, `[s, u]` to `Q`, where `u` is the action `a` relative
    /// to its origin: `a` itself, or `a - s[origin..]` with [`DdpgConfig::action_origin`].
    ///
    /// # Errors
    /// If the config is invalid, by itself or for these lengths.
    pub(super) fn shapes(
        observation_len: usize,
        action_len: usize,
        config: &DdpgConfig,
    ) -> Result<[MlpShape; 2], ValidationError> {
        config.validate()?;
        if config.action_origin.is_some_and(|origin| origin + action_len > observation_len) {
            let message = format!("no {action_len} numbers from there in an observation of {observation_len}");
            return Err(ValidationError::new("action_origin", message));
        }
        let shape =
            |inputs, outputs| MlpShape::uniform(inputs, config.hidden, outputs, config.layers, config.activation);
        let actor = shape(observation_len, action_len).with_output(Activation::Tanh);
        Ok([actor, shape(observation_len + action_len, 1)])
    }

    /// The settings.
    pub fn config(&self) -> &DdpgConfig {
        &self.config
    }

    /// Length of an observation.
    pub fn observation_len(&self) -> usize {
        self.actor.shape().inputs()
    }

    /// Length of an action.
    pub fn action_len(&self) -> usize {
        self.actor.shape().outputs()
    }

    /// Number of updates made.
    pub fn updates(&self) -> u64 {
        self.critic_optimiser.steps
    }

    /// Acts with a copy of the target actor, which averages the actor's recent changes, until another call
    /// replaces the copy or it is [released](Self::release_policy). Learning does not affect the copy.
    pub fn hold_policy(&mut self) {
        self.held = Some(self.target_actor.clone());
    }

    /// Stores the held policy for [`return_to_proven_policy`](Self::return_to_proven_policy).
    pub fn mark_policy_proven(&mut self) {
        self.proven.clone_from(&self.held);
    }

    /// Acts with the policy that was proven last, and lets the actor learn on from there; a no-op if there is none.
    pub fn return_to_proven_policy(&mut self) {
        let Some(proven) = &self.proven else { return };
        self.actor.soft_update(proven, 1.0);
        self.target_actor.soft_update(proven, 1.0);
        self.held = Some(proven.clone());
    }

    /// Acts with the actor itself, and discards the held and proven policies.
    pub fn release_policy(&mut self) {
        (self.held, self.proven) = (None, None);
    }

    /// Whether a held policy acts.
    pub fn holds_policy(&self) -> bool {
        self.held.is_some()
    }

    /// The network that acts.
    pub(super) fn policy(&self) -> &Mlp {
        self.held.as_ref().unwrap_or(&self.actor)
    }

    /// The policy's actions (`μ(s)` if no policy is held) for one or more observations, row-major; each
    /// component is in [-1, 1].
    ///
    /// # Panics
    /// If there is not a whole number of observations.
    pub fn act(&self, observations: &[f32]) -> Vec<f32> {
        let mut actions = predict(self.policy(), observations);
        self.add_origins(observations, 1.0, &mut actions);
        actions.iter_mut().for_each(|a| *a = a.clamp(-1.0, 1.0));
        actions
    }

    /// Actions relative to their origins.
    fn offsets(&self, observations: &[f32], actions: &[f32]) -> Vec<f32> {
        let mut offsets = actions.to_vec();
        self.add_origins(observations, -1.0, &mut offsets);
        offsets
    }

    /// Adds `sign` times its origin, a part of its observation, to every action.
    fn add_origins(&self, observations: &[f32], sign: f32, actions: &mut [f32]) {
        let Some(origin) = self.config.action_origin else { return };
        let rows = observations.chunks_exact(self.observation_len());
        for (observation, action) in rows.zip(actions.chunks_exact_mut(self.action_len())) {
            action.iter_mut().zip(&observation[origin..]).for_each(|(a, o)| *a += sign * o);
        }
    }

    /// `Q(s, a)` for several actions, each with its own observation or all with a single one; row-major.
    ///
    /// # Panics
    /// If the numbers of observations and actions do not match.
    pub fn q_values(&self, observations: &[f32], actions: &[f32]) -> Vec<f32> {
        let n = actions.len() / self.action_len();
        if n > 1 && observations.len() == self.observation_len() {
            return self.q_values(&observations.repeat(n), actions);
        }
        predict(&self.critic, &join_rows(n, observations, &self.offsets(observations, actions)))
    }

    /// The least and greatest actions that can be taken, relative to their origins.
    fn bounds(&self, observations: &[f32]) -> [Vec<f32>; 2] {
        let numbers = observations.len() / self.observation_len() * self.action_len();
        [-1.0, 1.0].map(|bound| self.offsets(observations, &vec![bound; numbers]))
    }

    /// The target actor's actions, clipped as in acting.
    fn target_actions(&self, observations: &[f32]) -> Vec<f32> {
        let mut actions = predict(&self.target_actor, observations);
        let [least, greatest] = self.bounds(observations);
        let bounds = least.into_iter().zip(greatest);
        actions.iter_mut().zip(bounds).for_each(|(a, (least, greatest))| *a = a.clamp(least, greatest));
        actions
    }

    /// One step of DDPG on a minibatch of N transitions (s, a, r, s', d), the last M of which may be
    /// imitated. Here all actions, including those of the networks, are relative to their origins, and `clip` limits
    /// them to those that can be taken.
    ///
    /// # Errors
    /// If the batch does not match the agent, or a loss or gradient is not finite; in the latter case
    /// the agent should not continue learning.
    pub fn update(&mut self, batch: &Batch) -> Result<UpdateMetrics, UpdateError> {
        let n = batch.len();
        assert!(n > 0, "an update needs transitions");
        let s = &batch.observations;
        let a = self.offsets(&batch.observations, &batch.actions);
        let mut metrics = UpdateMetrics::default();

        // y = r + γ (1 - d) Q'(s', clip(μ'(s')))
        let next_a = self.target_actions(&batch.next_observations);
        let next_q = predict(&self.target_critic, &join_rows(n, &batch.next_observations, &next_a));
        let y = self.bellman_target(&batch.rewards, &batch.terminated, &next_q);

        // Critic: one step down L = 1/N Σ (Q(s, a) - y)²
        let q = self.critic.forward_data(self.rows(n, join_rows(n, s, &a)).leaky_trace());
        (metrics.mean_q, metrics.max_q) = mean_and_max(&q.as_vec());
        let loss = mse_loss(q, self.rows(n, y));
        metrics.critic_loss = self.finite("critic loss", loss.array())?;
        let rate = self.config.critic_learning_rate;
        self.critic_optimiser.update(&mut [&mut self.critic], &mut loss.backward(), rate)?;

        // Actor: one step down -J = -1/N Σ Q(s, clip(μ(s))), with Q held constant
        let observations = self.rows(n, s.clone());
        let (mu, tape) = self.actor.forward_data(observations.leaky_trace()).split_tape();
        metrics.action_saturation = saturation(&mu.as_vec());
        let [least, greatest] = self.bounds(s).map(|bound| self.rows(n, bound));
        let taken = mu.clone().put_tape(tape).maximum(least).minimum(greatest);
        let q = self.critic.forward_frozen(concat_columns(observations, taken));
        let loss = match self.imitation_weights(batch, &q.as_vec()) {
            None => -q.mean(),
            Some(weights) => {
                // or down -J / (1/N Σ |Q(s, clip(μ(s)))|) + w B,
                // B = 1/M Σ (μ(s) - a)² where Q(s, a) > Q(s, clip(μ(s)))
                let scale = q.as_vec().iter().map(|q| q.abs()).sum::<f32>() / n as f32;
                let distance = (mu.leaky_trace() - self.rows(n, a)).square();
                -q.mean() / scale.max(MIN_SCALE) + (distance * self.rows(n, weights)).sum()
            }
        };
        metrics.actor_loss = self.finite("actor loss", loss.array())?;
        let rate = self.config.actor_learning_rate;
        self.actor_optimiser.update(&mut [&mut self.actor], &mut loss.backward(), rate)?;

        // θ' ← τ θ + (1 - τ) θ'
        self.target_critic.soft_update(&self.critic, self.config.tau);
        self.target_actor.soft_update(&self.actor, self.config.tau);
        Ok(metrics)
    }

    /// Weights of the squared distances between the actor's actions, which have values `q`, and the
    /// batch's: w/M in imitated rows whose own action has a greater value, 0 elsewhere; none if nothing
    /// is imitated.
    fn imitation_weights(&self, batch: &Batch, q: &[f32]) -> Option<Vec<f32>> {
        let (m, weight, len) = (batch.imitated, self.config.imitation.weight, self.action_len());
        if m == 0 || weight == 0.0 {
            return None;
        }
        let first = batch.len() - m;
        let taken = self.q_values(&batch.observations[first * self.observation_len()..], &batch.actions[first * len..]);
        let mut weights = vec![0.0; batch.len() * len];
        for (row, taken) in taken.into_iter().enumerate() {
            if taken > q[first + row] {
                weights[(first + row) * len..][..len].fill(weight / m as f32);
            }
        }
        Some(weights)
    }

    /// `r + γ (1 - d) next_q`, clamped to the configured range.
    fn bellman_target(&self, rewards: &[f32], terminated: &[bool], next_q: &[f32]) -> Vec<f32> {
        let [low, high] = self.config.target_clamp.unwrap_or([f32::NEG_INFINITY, f32::INFINITY]);
        let rows = rewards.iter().zip(terminated).zip(next_q);
        rows.map(|((r, &d), next_q)| {
            let future = if d { 0.0 } else { self.config.gamma * next_q };
            (r + future).clamp(low, high)
        })
        .collect()
    }

    /// `values` as a matrix of `n` rows.
    fn rows(&self, n: usize, values: Vec<f32>) -> Matrix {
        let columns = values.len() / n;
        matrix(&self.device, values, n, columns)
    }

    fn finite(&self, quantity: &'static str, value: f32) -> Result<f32, UpdateError> {
        if value.is_finite() {
            return Ok(value);
        }
        Err(UpdateError::Diverged { quantity, value, update: self.updates() + 1 })
    }
}

/// Outputs of the network for all rows of `inputs`.
fn predict(network: &Mlp, inputs: &[f32]) -> Vec<f32> {
    let rows = inputs.len() / network.shape().inputs();
    let mut outputs = Vec::with_capacity(rows * network.shape().outputs());
    network.predict_into(inputs, rows, &mut outputs);
    outputs
}

fn mean_and_max(values: &[f32]) -> (f32, f32) {
    let sum: f32 = values.iter().sum();
    (sum / values.len() as f32, values.iter().copied().fold(f32::NEG_INFINITY, f32::max))
}

/// Fraction of action components beyond ±0.99, where the gradient of tanh almost vanishes.
fn saturation(actions: &[f32]) -> f32 {
    let saturated = actions.iter().filter(|a| a.abs() > 0.99).count();
    saturated as f32 / actions.len() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saturation_is_the_share_of_components_beyond_the_bound() {
        assert_eq!(saturation(&[1.0, 0.99, -0.995, 0.5]), 0.5);
        assert_eq!(saturation(&[0.0, -0.99, 0.98]), 0.0);
    }
}
