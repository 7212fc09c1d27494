//! Errors of sweeps, studies and puzzles, each shown as one line.

use mge_base::json::SyntaxError;
use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_figures::FigureError;
use mge_results::ResultsError;
use mge_run::RunError;
use mge_stats::StatsError;
use mge_task::TaskError;
use mge_trainer::TrainerError;
use mge_trainer::batch::{BatchError, JobError, JobFailure};

/// Result of an experiment.
pub type Result<T, E = ExperimentError> = std::result::Result<T, E>;

/// Why an experiment cannot be run or reported. What is finished is kept.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A file is not JSON, or does not have the content of its kind.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// A sweep file has an invalid setting or value; `origin` is the file and the line.
    #[error("{origin}: at {problem}")]
    Invalid { origin: String, problem: ValidationError },
    /// A file cannot be read or written, or a folder does not hold the run that it should.
    #[error("{0}")]
    Run(#[from] RunError),
    /// The training of an agent failed, or an action prior cannot be built.
    #[error(transparent)]
    Trainer(#[from] TrainerError),
    /// A dynamics model cannot be trained, loaded or evaluated.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A task file is invalid.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// Runs cannot be compared.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A statistic cannot be computed.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The threads of the batch cannot be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The batch was interrupted.
    #[error("interrupted after {done} of {jobs}: the same command continues where it stopped")]
    Interrupted { done: usize, jobs: usize },
    /// A folder or an option cannot be used as asked; the text says what to do.
    #[error("{0}")]
    Refused(String),
}

impl From<Stopped> for ExperimentError {
    fn from(stopped: Stopped) -> Self {
        Self::Dynamics(stopped.into())
    }
}

impl JobError for ExperimentError {
    fn is_in_use(&self) -> bool {
        matches!(self, Self::Run(RunError::InUse { .. }) | Self::Trainer(TrainerError::Run(RunError::InUse { .. })))
    }

    fn is_stopped(&self) -> bool {
        matches!(self, Self::Dynamics(DynamicsError::Stopped(_)) | Self::Trainer(TrainerError::Stopped(_)))
    }
}

/// The outputs of the finished jobs, and [`ExperimentError::Interrupted`] if there are others.
///
/// # Errors
/// The first failure.
pub(crate) fn finished<T>(outcomes: Vec<Result<T, JobFailure<ExperimentError>>>) -> Result<(Vec<T>, Result<()>)> {
    let (jobs, mut outputs) = (outcomes.len(), Vec::new());
    for outcome in outcomes {
        match outcome {
            Ok(output) => outputs.push(output),
            Err(JobFailure::Interrupted) => {}
            Err(JobFailure::Error(error)) => return Err(error),
            Err(failure @ JobFailure::Panic(_)) => return Err(ExperimentError::Refused(failure.to_string())),
        }
    }
    let done = outputs.len();
    Ok((outputs, if done == jobs { Ok(()) } else { Err(ExperimentError::Interrupted { done, jobs }) }))
}
