//! DDPG: actor, critic, replay buffer, exploration noise, update. Knows vectors, not puzzles.
//!
//! [`Ddpg`] is the algorithm, [`Learner`] an agent with all that changes while it learns:
//! replay buffer, noise, random streams. With actions of another origin recorded into the same
//! learner (guided exploration) the update stays plain DDPG.
//!
//! Symbols: observation s, action a, reward r, next observation s', terminated d, actor μ,
//! critic Q, targets μ' and Q' with parameters θ', online parameters θ, batch size N, discount γ.
//!
//! # Metrics
//!
//! What an update reports ([`UpdateMetrics`]). All but the norms are means over the minibatch
//! before the networks change; the actor's see the critic after its step.
//!
//! | name | formula | to watch for |
//! |---|---|---|
//! | `critic_loss` | 1/N Σ (Q(s, a) - y)², y = clamp(r + γ (1 - d) Q'(s', μ'(s'))) | growth: the critic diverges |
//! | `actor_loss` | -1/N Σ Q(s, μ(s)) | minus the value the actor hopes for |
//! | `mean_q` | 1/N Σ Q(s, a) | above the greatest possible return: overestimation |
//! | `max_q` | max Q(s, a) | the same, sooner |
//! | `action_saturation` | fraction of components of μ(s) with magnitude above 0.99 | near 1: the actor is stuck at its bounds, where tanh passes no gradient |
//! | `critic_gradient_norm` | ‖∇θ critic_loss‖₂ | spikes |
//! | `actor_gradient_norm` | ‖∇θ actor_loss‖₂ | 0: the actor learns nothing |
//!
//! # Choices the paper leaves open
//!
//! Section 5.3 and table 2 fix layers, width, learning rates, batch size, optimiser and the noise's
//! parameters. The rest, each a field of [`DdpgConfig`] unless noted:
//!
//! 1. Discount `gamma` 0.99, the usual value: an episode is about 12 steps, so that a goal at its
//!    end still counts 0.89.
//! 2. Target rate `tau` 0.005, the usual value.
//! 3. Replay buffer of 100 000 transitions, sampled uniformly: a whole training fits, nothing is
//!    forgotten.
//! 4. `warmup_steps` 500 before the first update; actions come from the noisy actor meanwhile, as
//!    they do later.
//! 5. ReLU in hidden layers, tanh at the actor's end (actions are bounded).
//! 6. Initialisation: weights and biases uniform in ±1/√(fan in), the output layers in ±0.003, as
//!    in DDPG's own paper. First actions and first values are then near 0.
//! 7. `target_clamp` [-1, 16], around the returns that tasks with goal reward 10 and subgoal
//!    rewards 2 allow. In pilot runs without it values ran away twice (to 429 and to 30 where
//!    about 14 can be earned); with it, the second of them at equal seed hit 248 goals instead of 82.
//! 8. The noise starts at its mean in every episode, its time step is 1, and it may be annealed by
//!    [`Learner::set_noise_scale`]. In pilot runs constant noise hid a good greedy policy (greedy
//!    5 of 5 while 2 to 8 % of training episodes succeeded).
//! 9. `updates_per_step` 1, on a fresh minibatch.
//! 10. `critic_learning_rate` 1e-3 where table 2 has 1e-4: in a pilot pair at equal seed, 708
//!     instead of 383 goals in 1500 episodes. Table 2's value can be set.
//! 11. The action joins the observation at the critic's first layer. (DDPG's own paper brings it in
//!     at the second.)
//! 12. No weight decay, no normalisation of observations or rewards, no gradient clipping.
//! 13. Truncated transitions are stored with d = false and their true last observation, so their
//!     value is bootstrapped; only termination ends it ([`Transition::terminated`]).
//!
//! Pilot runs: one to four seeds each, on another simulator of the same puzzles.

mod config;
mod ddpg;
mod join;
mod learner;
mod noise;
#[cfg(test)]
mod probe;
mod replay;
mod state;
#[cfg(test)]
mod tests;

pub use config::{ConfigError, DdpgConfig, OuConfig};
pub use ddpg::{Ddpg, UpdateError, UpdateMetrics};
pub use learner::{Learner, Streams};
pub use noise::OrnsteinUhlenbeck;
pub use replay::{Batch, ReplayBuffer, ReplayError, Transition};
pub use state::{Checkpoint, StateError};
