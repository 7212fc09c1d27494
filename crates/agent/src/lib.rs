//! DDPG: actor, critic, replay buffer, exploration noise, update. Works on vectors and is independent
//! of puzzles.
//!
//! [`Ddpg`] is the algorithm; [`Learner`] is an agent with everything that changes while it learns:
//! replay buffer, noise, random streams. Actions from other sources (guided exploration) can be
//! recorded into the same learner; the update stays plain DDPG.
//!
//! Symbols: observation s, action a, reward r, next observation s', terminated d, actor μ,
//! critic Q, targets μ' and Q' with parameters θ', online parameters θ, batch size N, discount γ.
//!
//! ```
//! use mge_agent::{DdpgConfig, Learner, LearnerStreams, Transition};
//! use rand::SeedableRng;
//! use rand_chacha::ChaCha8Rng;
//!
//! let [mut weights, noise, replay] = [0, 1, 2].map(ChaCha8Rng::seed_from_u64);
//! let config = DdpgConfig { warmup_steps: 16, ..DdpgConfig::default() };
//! let mut learner = Learner::new(1, 1, &config, &mut weights, LearnerStreams { noise, replay })?;
//! let s = [0.5];
//! for _ in 0..20 {
//!     learner.start_episode();
//!     let a = learner.explore(&s);
//!     let reward = -(a[0] - 0.3).abs();
//!     learner.record(Transition { observation: &s, action: &a, reward, next_observation: &s, terminated: true })?;
//!     learner.update(config.updates_per_step)?;
//! }
//! assert_eq!(learner.ddpg.updates(), 5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Metrics
//!
//! An update reports [`UpdateMetrics`]; a run records their means over each episode, as in this
//! glossary:
//!
#![doc = include_str!("../metrics.md")]
//!
//! # Choices the paper leaves open
//!
//! Section 5.3 and table 2 fix layers, width, learning rates, batch size, optimiser and the noise's
//! parameters. The other choices, each a field of [`DdpgConfig`] unless noted:
//!
//! 1. Discount `gamma` 0.95: an episode has about 12 steps. With 0.99, values of states in which
//!    nothing more happens (a ball at rest until the action limit) drift up through bootstrapping.
//! 2. Target rate `tau` 0.005, the usual value.
//! 3. Replay buffer of 100 000 transitions, sampled uniformly: holds a complete training, so nothing
//!    is overwritten.
//! 4. `warmup_steps` 500 before the first update; meanwhile actions come from the noisy actor, as
//!    later.
//! 5. ReLU in hidden layers, tanh at the actor's output (actions are bounded).
//! 6. Initialisation: weights and biases uniform in ±1/√(fan in), the output layers in ±0.003, as
//!    in the original DDPG paper, so that initial actions and values are near 0.
//! 7. `target_clamp` [-1, 16], around the possible returns of tasks with goal reward 10 and subgoal
//!    rewards 2. Without it, values can diverge.
//! 8. The noise starts at its mean in every episode, its time step is 1, and it is annealed by
//!    [`OrnsteinUhlenbeck::scale`], by default to 0 over the first half of a run, because remaining
//!    noise hides a good policy (a box must be placed to about 0.035). Both methods use the same noise.
//! 9. `updates_per_step` 1, on a fresh minibatch.
//! 10. `critic_learning_rate` 1e-3, where table 2 has 1e-4, with which DDPG hardly learned.
//! 11. The action enters the critic at the first layer, together with the observation. (In the
//!     original DDPG paper it enters at the second.)
//! 12. No weight decay, no normalisation of observations or rewards, no gradient clipping.
//! 13. Truncated transitions are stored with d = false and their true last observation, so that
//!     their value is bootstrapped; only termination ends bootstrapping ([`Transition::terminated`]).
//!     Probe environments test this.

#![deny(unsafe_code)]

mod config;
mod ddpg;
mod learner;
mod noise;
mod replay;
mod segments;
mod state;
#[cfg(test)]
mod tests;

pub use config::{DdpgConfig, ImitationConfig, OuConfig, SETTINGS};
pub use ddpg::{Ddpg, UpdateError, UpdateMetrics};
pub use learner::{Learner, LearnerStreams};
pub use noise::OrnsteinUhlenbeck;
pub use replay::{Batch, ReplayBuffer, ReplayError, Transition};
use segments::Segments;
pub use state::{SavedLearner, StateError};
