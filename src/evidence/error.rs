//! What can go wrong with evidence about runs, as one line for the person who reads it.

use crate::figures::FigureError;
use crate::run::RunError;
use crate::stats::StatsError;

/// Why runs cannot be compared or reported.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceError {
    /// There is nothing to report yet.
    #[error("none of the {runs} runs is finished: continue them, such as with `mge resume`")]
    NothingFinished {
        /// Runs that were found.
        runs: usize,
    },
    /// No run has learned anything yet.
    #[error("none of the runs has finished enough episodes for a curve")]
    NothingBegun,
    /// A curve that was asked for does not exist.
    #[error("there is no curve `{label}`{hint}: there are {known}")]
    NoCurve {
        /// What was asked for.
        label: String,
        /// The labels there are.
        known: String,
        /// The nearest of them.
        hint: String,
    },
    /// A run's files, and those of the report.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A statistic.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
}
