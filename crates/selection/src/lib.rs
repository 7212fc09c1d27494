//! Agents that choose a tool of an action set and a place by what the tool does to a ball.
//!
//! An action set of CREATE has 40 tools, drawn anew in every episode and in a test from tools that no training has
//! seen, so a policy cannot know them by number. Here it knows a tool by its effect. Before each action:
//!
//! 1. The world is simulated as it is, without a further tool: the [`Flight`] of every ball.
//! 2. Candidates are drawn: tools of the set, mostly at places that a ball will pass.
//! 3. The [`Effect`] of each is found: where a ball first meets it, and how the ball leaves it in an otherwise *empty*
//!    world.
//! 4. A network scores the candidates by state, flight and effect; the best is played.
//!
//! In training only, every candidate is also tried in the real scene, and the network learns to predict the result
//! (imitation of a lookahead; from the second round on in the states that the policy itself reaches, as in DAgger).
//! A policy is for one task. All needs a simulator: it is not comparable with agents that only see observations.
//!
//! ```no_run
//! use std::sync::Arc;
//!
//! use mge_physics::ToolSplit;
//! use mge_selection::{Settings, evaluate, train};
//!
//! let task = Arc::new(mge_task::load("create/Push")?);
//! let policy = train(&task, Settings { episodes: 200, candidates: 48, seed: 0 }, |_| ())?;
//! let settings = Settings { candidates: 100, ..policy.settings };
//! let result = evaluate(&task, ToolSplit::Test, Some(&policy), settings, |_| ());
//! println!("{} of {} episodes", result.successes, result.episodes);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

mod decision;
mod effect;
mod error;
mod evaluate;
mod features;
mod flight;
mod policy;
#[cfg(test)]
mod tests;
mod train;

pub use effect::Effect;
pub use error::SelectionError;
pub use evaluate::{Evaluation, evaluate};
pub use flight::{Approach, Flight};
pub use policy::{Policy, Settings};
pub use train::train;
