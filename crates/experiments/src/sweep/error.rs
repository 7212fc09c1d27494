//! Errors of sweeps, each shown as one line.

use std::path::PathBuf;

use mge_base::json::SyntaxError;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_run::RunError;
use mge_trainer::TrainerError;
use mge_trainer::batch::{BatchError, JobError};

/// Why a sweep cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The sweep file is not JSON, or not an object of lists.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// The sweep file has an invalid setting or value.
    #[error("{origin}: at {problem}")]
    Invalid {
        /// The sweep file and the line.
        origin: String,
        /// The JSON path and the problem.
        problem: ValidationError,
    },
    /// A file of the sweep or of a run cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The threads of the batch cannot be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The sweep was interrupted.
    #[error("interrupted after {done} of {jobs}: the same command continues where it stopped")]
    Interrupted {
        /// Number of finished jobs.
        done: usize,
        /// Number of all jobs.
        jobs: usize,
    },
    /// A run in the sweep's folder has the name of one of the sweep's runs, but other settings.
    #[error(
        "{} holds a run with other settings than the sweep asks for: choose another folder with --out, or remove it",
        .0.display()
    )]
    OtherRun(PathBuf),
    /// A run in the sweep's folder was trained with another model than that in the sweep's file.
    #[error(
        "{} was trained with the model {found}, and the sweep's file is now {wanted}: restore the file, choose another \
         folder with --out, or write the model as a list, so that the new one is trained under another name",
        folder.display()
    )]
    OtherModel {
        /// The run's folder.
        folder: PathBuf,
        /// Its model.
        found: String,
        /// The model of the sweep.
        wanted: String,
    },
    /// A path that has a line break or is not UTF-8 cannot be part of a plan, which has one command per line of text.
    #[error("{:?} has a line break or is not UTF-8, and a plan is text with one command per line: choose another folder with --out", .0)]
    NoLine(PathBuf),
    /// A folder to collect from holds no sweep.
    #[error("{} is not the folder of a sweep: it has no runs/", .0.display())]
    NotASweep(PathBuf),
    /// Two folders to collect hold different runs of the same name.
    #[error("{} and {} {problem}: nothing was copied", first.display(), second.display())]
    Conflict {
        /// One of them.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// The conflict, as a predicate of the two.
        problem: String,
    },
    /// A run to be collected is still being trained.
    #[error("{} is being trained: wait for it, or stop it: nothing was copied", .0.display())]
    Busy(PathBuf),
    /// There are both agents and dynamics models.
    #[error("{} holds an agent and {} a dynamics model: collect them into two folders", agent.display(), model.display())]
    Mixed {
        /// Folder of an agent's run.
        agent: PathBuf,
        /// Folder of a model's run.
        model: PathBuf,
    },
}

/// Why a job failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum WorkError {
    /// The training of an agent failed.
    #[error(transparent)]
    Training(#[from] TrainerError),
    /// The training or evaluation of a dynamics model failed.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A file of the run cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The folder holds another run.
    #[error(transparent)]
    Folder(#[from] Box<SweepError>),
    /// The results of a model are damaged.
    #[error("{0}: remove this file, and the model is made again")]
    Result(#[from] SyntaxError),
}

impl JobError for WorkError {
    fn is_in_use(&self) -> bool {
        let error = match self {
            Self::Run(error) | Self::Training(TrainerError::Run(error)) => error,
            Self::Folder(error) => match &**error {
                SweepError::Run(error) => error,
                _ => return false,
            },
            _ => return false,
        };
        matches!(error, RunError::InUse { .. })
    }

    fn is_stopped(&self) -> bool {
        matches!(self, Self::Dynamics(DynamicsError::Stopped))
    }
}
