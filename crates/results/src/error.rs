//! Errors of comparisons and reports, each shown as one line.

use mge_figures::FigureError;
use mge_run::RunError;
use mge_stats::StatsError;

/// Why runs cannot be compared or reported.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// No run is finished yet.
    #[error("none of the {runs} runs is finished: continue them")]
    NothingFinished {
        /// Number of runs found.
        runs: usize,
    },
    /// No run has a point of a curve yet.
    #[error("none of the runs has finished enough episodes for a curve")]
    NothingStarted,
    /// A chosen label or name does not exist.
    #[error("no runs are called `{label}`{hint}")]
    NoLabel {
        /// The text given.
        label: String,
        /// A suggestion of the nearest one, or else the first of those that exist.
        hint: String,
    },
    /// Several runs of a figure have the chosen name.
    #[error("several runs are called `{name}`: give one by its label, {labels}")]
    SharedName {
        /// The text given.
        name: String,
        /// The labels of the runs.
        labels: String,
    },
    /// A file of a run or of the report cannot be read or written.
    #[error("{0}")]
    Run(#[from] RunError),
    /// A statistic cannot be computed.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
}
