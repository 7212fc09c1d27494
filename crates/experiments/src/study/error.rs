//! Errors of studies, each shown as one line.

use std::path::PathBuf;

use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_figures::FigureError;
use mge_results::EvidenceError;
use mge_run::RunError;
use mge_stats::StatsError;
use mge_trainer::batch::{BatchError, JobError, JobFailure};
use mge_trainer::{PriorError, SettingError, TrainerError};

/// Why a study could not be finished. Completed parts are kept.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The folder holds another study.
    #[error("{}: this folder holds a study with other parameters: choose another with --out", path.display())]
    OtherStudy { path: PathBuf },
    /// The plan of the folder cannot be read.
    #[error("{}: the study's plan is damaged: restore it, or choose another folder with --out", path.display())]
    Plan { path: PathBuf },
    /// A file has invalid content.
    #[error("{}: {message}: remove it, and the study will make a new one", path.display())]
    Content { path: PathBuf, message: String },
    /// A dynamics model cannot be trained, loaded or evaluated.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// A model's training diverged.
    #[error("the training of the {tools} model diverged in epoch {epoch}: {reason}")]
    Diverged { tools: String, epoch: u32, reason: String },
    /// An action prior cannot be built.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// The untrained agent cannot be configured.
    #[error(transparent)]
    Agent(#[from] ValidationError),
    /// A file of a run or of the study cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A setting of a method is invalid.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A run of the study has other settings.
    #[error("{}: this run has other settings than the study: remove it, or choose another folder with --out", path.display())]
    OtherRun { path: PathBuf },
    /// A training failed.
    #[error("{run}: {source}")]
    Training { run: String, source: Box<TrainerError> },
    /// A statistic cannot be computed.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// The trainings cannot be compared.
    #[error(transparent)]
    Evidence(#[from] EvidenceError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The threads of the batch cannot be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A job panicked.
    #[error("a part of the study panicked: {0}")]
    Panic(String),
    /// The study was interrupted.
    #[error("interrupted: the same command continues where it stopped")]
    Interrupted,
}

impl StudyError {
    /// Whether an interruption was requested.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted)
    }
}

impl JobError for StudyError {
    fn is_in_use(&self) -> bool {
        let Self::Training { source, .. } = self else { return false };
        matches!(&**source, TrainerError::Run(RunError::InUse { .. }))
    }

    fn is_stopped(&self) -> bool {
        match self {
            Self::Dynamics(DynamicsError::Stopped) | Self::Interrupted => true,
            Self::Prior(error) => error.is_stopped(),
            _ => false,
        }
    }
}

impl From<Stopped> for StudyError {
    fn from(_: Stopped) -> Self {
        Self::Interrupted
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
