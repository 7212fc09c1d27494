//! Errors of statistics.

use thiserror::Error;

/// What is wrong with a statistic's input.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StatsError {
    /// There is nothing to compute from.
    #[error("no {0} to compute a statistic from")]
    Empty(&'static str),
    /// A task without runs, counted from 0.
    #[error("task {0} has no runs")]
    EmptyTask(usize),
    /// A score that is infinite or not a number.
    #[error("the score of run {run} of task {task} is {value}, not a finite number")]
    NotFinite {
        /// Task, counted from 0.
        task: usize,
        /// Run, counted from 0.
        run: usize,
        /// The score.
        value: f64,
    },
    /// Two methods that were not run on the same tasks.
    #[error("the methods to compare have scores of {0} and {1} tasks")]
    Tasks(usize, usize),
    /// An invalid confidence level.
    #[error("the confidence level {0} is not between 0 and 1 (95 % is 0.95)")]
    Confidence(f64),
    /// Zero resamples.
    #[error("an interval takes at least one resample")]
    Resamples,
}
