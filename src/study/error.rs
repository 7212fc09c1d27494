//! What can go wrong with a study, as one line for the person who reads it.

use std::path::PathBuf;

use crate::batch::{BatchError, JobError, JobFailure};
use crate::dynamics::DynamicsError;
use crate::figures::FigureError;
use crate::guidance::GuidanceError;
use crate::run::RunError;
use crate::stats::StatsError;
use crate::trainer::{PriorError, SettingError, TrainerError};
use crate::validation::ValidationError;

/// Why a study could not be finished. What it has done so far stays.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The folder holds another study.
    #[error("{}: this folder holds a study with other numbers: choose another with --out", path.display())]
    OtherStudy { path: PathBuf },
    /// A file is not what it should be.
    #[error("{}: {message}: remove it, and the study will make a new one", path.display())]
    Content { path: PathBuf, message: String },
    /// A dynamics model.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A model's training diverged.
    #[error("the training of the {tools} model diverged in epoch {epoch}: {reason}")]
    Diverged { tools: String, epoch: u32, reason: String },
    /// An action prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A saved action prior.
    #[error(transparent)]
    Guidance(#[from] GuidanceError),
    /// The untrained agent.
    #[error(transparent)]
    Agent(#[from] ValidationError),
    /// A run's files, and those of the study.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A setting of a method.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A run of the study has other settings.
    #[error("{}: this run has other settings than the study: remove it, or choose another folder with --out", path.display())]
    OtherRun { path: PathBuf },
    /// A training.
    #[error("{run}: {source}")]
    Training { run: String, source: Box<TrainerError> },
    /// A statistic.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// Threads.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A mistake of the program.
    #[error("a part of the study panicked: {0}")]
    Panic(String),
    /// It was asked to stop.
    #[error("interrupted: the same command continues where it stopped")]
    Interrupted,
}

impl StudyError {
    /// The result of a piece of work; none if it was interrupted.
    pub(super) fn unless_interrupted<T>(result: Result<T, Self>) -> Result<Option<T>, Self> {
        match result {
            Err(Self::Interrupted) => Ok(None),
            result => result.map(Some),
        }
    }
}

impl JobError for StudyError {
    fn is_in_use(&self) -> bool {
        let Self::Training { source, .. } = self else { return false };
        matches!(&**source, TrainerError::Run(RunError::InUse { .. }))
    }
}

impl From<JobFailure<StudyError>> for StudyError {
    fn from(failure: JobFailure<StudyError>) -> Self {
        match failure {
            JobFailure::Error(error) => error,
            JobFailure::Panic(message) => Self::Panic(message),
            JobFailure::Interrupted => Self::Interrupted,
        }
    }
}
