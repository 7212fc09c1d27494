//! DDPG: actor, critic, replay buffer, exploration noise, update. Knows vectors, not puzzles.
//!
//! [`Ddpg`] is the algorithm, [`Learner`] an agent with all that changes while it learns:
//! replay buffer, noise, random streams. With actions of another origin recorded into the same
//! learner (guided exploration) the update stays plain DDPG. With [`Options`] an action is a choice
//! among items, too.
//!
//! Symbols: observation s, action a, reward r, next observation s', terminated d, actor μ,
//! critic Q, targets μ' and Q' with parameters θ', online parameters θ, batch size N, discount γ.
//!
//! # Metrics
//!
//! What an update reports is [`UpdateMetrics`]; a run records it as means over an episode, in
//! this glossary:
//!
#![doc = include_str!("../../docs/metrics.md")]
//!
//! # Choices the paper leaves open
//!
//! Section 5.3 and table 2 fix layers, width, learning rates, batch size, optimiser and the noise's
//! parameters. The rest, each a field of [`DdpgConfig`] unless noted:
//!
//! 1. Discount `gamma` 0.95: an episode is about 12 steps. With 0.99 values of states from which
//!    nothing more happens (a ball at rest until the limit of actions) drift up through their own
//!    bootstrap. On tasks 2, 4 and 6 with 0.95: 0.51, 0.27, 0.00; with 0.99: 0.25, 0.48, 0.09; with
//!    0.9: 0.68, 0.31, 0.03.
//! 2. Target rate `tau` 0.005, the usual value. With 0.001: 0.02, 0.19, 0.11, 0.00; with 0.02:
//!    0.96, 0.39, 0.80, 0.25.
//! 3. Replay buffer of 100 000 transitions, sampled uniformly: a whole training fits, nothing is
//!    forgotten. With 10 000: 0.92, 0.40, 0.25, 0.01.
//! 4. `warmup_steps` 500 before the first update; actions come from the noisy actor meanwhile, as
//!    they do later. With 128: 0.99, 0.68, 0.71, 0.09; with 4000: 0.32, 0.08, 0.42, 0.06.
//! 5. ReLU in hidden layers, tanh at the actor's end (actions are bounded). With tanh in hidden
//!    layers: 0.58, 0.20, 0.02, 0.01.
//! 6. Initialisation: weights and biases uniform in ±1/√(fan in), the output layers in ±0.003, as
//!    in DDPG's own paper. First actions and first values are then near 0. With ±0.1: 0.89, 0.75,
//!    0.54, 0.19.
//! 7. `target_clamp` [-1, 16], around the returns that tasks with goal reward 10 and subgoal
//!    rewards 2 allow. Without it: 0.69, 0.46, 0.32, 0.02; in pilot runs values ran away twice (to
//!    429 and to 30 where about 14 can be earned).
//! 8. The noise starts at its mean in every episode, its time step is 1, and it is annealed by
//!    [`Learner::set_noise_scale`], by default to nothing over the first half of a run: what is
//!    left of it hides a good policy (a box must be placed to about 0.035). With discount 0.99 and
//!    epsilon drawn by episode: 0.90, 0.17, 0.15, 0.01; 0.72, 0.14, 0.10, 0.02 with a tenth of the
//!    noise left. On tasks 2, 4 and 6 0.28, 0.14, 0.02 over nine tenths of the run instead of half,
//!    0.27, 0.08, 0.00 over a quarter. Both methods get the same.
//! 9. `updates_per_step` 1, on a fresh minibatch. With 2, for twice the time (discount 0.99,
//!    epsilon by episode, tasks 2, 4 and 6): 0.27, 0.04, 0.00.
//! 10. `critic_learning_rate` 1e-3 where table 2 has 1e-4. With 1e-4: 0.14, 0.00, 0.01, 0.01. Table
//!     2's value can be set.
//! 11. The action joins the observation at the critic's first layer. (DDPG's own paper brings it in
//!     at the second.) Not tried otherwise.
//! 12. No weight decay, no normalisation of observations or rewards, no gradient clipping. Not
//!     tried otherwise.
//! 13. Truncated transitions are stored with d = false and their true last observation, so their
//!     value is bootstrapped; only termination ends it ([`Transition::terminated`]): probe
//!     environments decide it.
//!
//! Pilot runs: one to four seeds each, on another simulator of the same puzzles.
//!
//! Trials, all other numbers: final rolling success on tasks 1, 2, 4 and 6 if no others are named,
//! mean over seeds 0 to 3 of 2000 episodes of DDPG-MGE with the threshold falling from 0.5 to 0
//! over the first 1000; `mge sweep assets/sweeps/choices.json` makes them again. The defaults give
//! 0.95, 0.51, 0.27, 0.00. With four seeds, differences below about 0.2 say nothing; a larger `tau`
//! or `output_init_bound`, or a shorter warm-up, may be better than the defaults, which are those
//! of the full study.

mod choice;
mod config;
mod ddpg;
mod join;
mod learner;
mod noise;
mod options;
#[cfg(test)]
mod probe;
mod replay;
mod segments;
mod state;
#[cfg(test)]
mod tests;

pub use config::{DdpgConfig, ImitationConfig, OuConfig, SETTINGS};
pub use ddpg::{Ddpg, UpdateError, UpdateMetrics};
pub use learner::{Learner, Streams};
pub use noise::OrnsteinUhlenbeck;
pub use options::Options;
pub use replay::{Batch, ReplayBuffer, ReplayError, Transition};
use segments::Segments;
pub use state::{Checkpoint, StateError};
