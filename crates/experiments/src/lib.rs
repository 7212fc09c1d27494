//! Many trainings: sweeps, the study of the paper, and generated puzzles.
//!
//! - [`sweep`]: a file of settings with lists of values, trained in every combination;
//! - [`study`]: the sweeps of the paper's study, with their report;
//! - [`puzzles`]: layouts to which no method was tuned, and the results of methods on them.
//!
//! All are batches of jobs (see [`mge_trainer::batch`]) in a folder. The folder is the only state: what is
//! finished stays, the same command continues the rest after an interruption, and several processes or machines can
//! share the work. Results do not depend on the number of threads.
//!
//! ```
//! use mge_experiments::sweep::Sweep;
//!
//! let file = br#"{"task": "task1", "method": ["ddpg", "ddpg-mge-adaptive"], "seed": [0, 1, 2], "episodes": 1000}"#;
//! let sweep = Sweep::parse(file, "sweep.json")?;
//! assert_eq!(sweep.jobs.len(), 6);
//! assert!(Sweep::parse(br#"{"task": "task1", "sed": [0, 1]}"#, "sweep.json").is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

mod error;
mod play;
pub mod puzzles;
pub mod study;
pub mod sweep;

pub use error::{ExperimentError, Result};
