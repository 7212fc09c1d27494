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
