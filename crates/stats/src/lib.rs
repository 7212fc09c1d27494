//! Statistics of runs: pure functions of scores.
//!
//! - [`rolling`]: rolling success rate and mean over the last episodes;
//! - [`efficiency`]: episodes to a threshold, area under the learning curve;
//! - [`scores`], [`aggregate`]: scores of runs by task; mean, median, interquartile mean;
//! - [`bootstrap`]: confidence intervals from resampling the runs within each task;
//! - [`comparison`]: probability of improvement.
//!
//! The definitions are those of Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical
//! Precipice", and agree with their library rliable on the same data. An interval depends only on the data and the
//! [`Bootstrap`] settings, not on threads or earlier computations. Empty or non-finite input is a [`StatsError`],
//! never a NaN in a table.
//!
//! ```
//! use mge_stats::{Bootstrap, TaskScores, aggregate};
//!
//! let of_each_task = vec![vec![0.9, 0.8, 0.95, 0.7], vec![0.4, 0.6, 0.5, 0.55]];
//! let iqm = Bootstrap::default().stratified(&TaskScores::new(of_each_task)?, aggregate::iqm)?;
//! assert!(iqm.lower < iqm.value && iqm.value < iqm.upper);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

pub mod aggregate;
pub mod bootstrap;
pub mod comparison;
pub mod efficiency;
mod error;
pub mod rolling;
pub mod scores;

pub use bootstrap::{Bootstrap, Estimate};
pub use error::StatsError;
pub use scores::TaskScores;

/// Result of a statistic whose input may be invalid.
pub type Result<T, E = StatsError> = std::result::Result<T, E>;
