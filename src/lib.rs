//! MGE Workbench: intuitive-physics puzzles, learned dynamics models and DDPG with
//! model-guided exploration (MGE), in the terminal and headless.
//!
//! The library is for programs that need more than the `mge` program offers: playing the puzzles with another agent
//! ([`task`], [`mod@env`]), predicting and clustering actions with a dynamics model ([`dynamics`], [`guidance`]),
//! training ([`trainer`], [`agent`]), and reading, comparing and plotting the results of trainings ([`run`],
//! [`results`], [`figures`], [`stats`]). [`workbench`] executes the commands of scripts.
//!
//! ```
//! use std::sync::Arc;
//!
//! use mge::env::{Environment, uniform_action};
//! use rand::SeedableRng;
//!
//! let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
//! let mut env = Environment::new(Arc::new(mge::task::load("task1")?));
//! let observation = env.reset(&mut rng);
//! let step = env.step(uniform_action(&mut rng))?;
//! assert_eq!(step.observation.len(), observation.len());
//! println!("the tool was {:?}, the reward {}", step.placement, step.reward);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Most modules are crates of their own, which other programs can use without this one: `mge_task`, `mge_env` and so
//! on. [`ARCHITECTURE.md`] describes the purpose of each and which others it may use.
//!
//! [`ARCHITECTURE.md`]: https://docs.rs/crate/mge/latest/source/ARCHITECTURE.md

// `nn::kernel` and `memory` allow it, with a justification.
#![deny(unsafe_code)]

pub use mge_agent as agent;
mod cli;
mod memory;
pub use mge_dynamics as dynamics;
pub use mge_env as env;
pub use mge_figures as figures;
pub use mge_results as results;
#[cfg(any(test, fuzzing))]
#[doc(hidden)]
#[path = "../fuzz/targets.rs"]
pub mod fuzz;
pub use mge_base::{identity, stop, streams};
pub use mge_env::protocol;
pub use mge_guidance as guidance;
pub use mge_nn as nn;
pub use mge_physics as physics;
pub use mge_run as run;
pub use mge_selection as selection;
pub use mge_stats as stats;
pub use mge_task as task;
pub use mge_trainer as trainer;
mod tui;
pub use mge_base::validation;
pub use mge_workbench as workbench;

/// Runs the `mge` program with the arguments of this process.
pub use cli::run as run_program;

/// For the benchmarks, which measure what the program does.
#[doc(hidden)]
pub use memory::keep_freed_blocks;

/// The workbench on screen, for the benchmarks.
#[doc(hidden)]
pub use tui::App;
