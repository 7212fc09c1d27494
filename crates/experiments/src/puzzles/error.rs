//! Errors of generated puzzles, each shown as one line.

use std::path::{Path, PathBuf};

use mge_base::json::SyntaxError;
use mge_base::stop::Stopped;
use mge_dynamics::DynamicsError;
use mge_figures::FigureError;
use mge_stats::StatsError;
use mge_task::TaskError;
use mge_trainer::PriorError;
use mge_trainer::batch::{BatchError, JobError, JobFailure};

/// Why puzzles cannot be generated or used.
#[derive(Debug, thiserror::Error)]
pub enum PuzzleError {
    /// The folder holds puzzles of another sequence.
    #[error("{}: these puzzles have another seed, split or start noise: choose another folder with --out", path.display())]
    OtherPuzzles { path: PathBuf },
    /// Another file is in the place of a puzzle's task.
    #[error("{}: is not the puzzle of this name: remove it, and the puzzle is generated again, or choose another folder with --out", path.display())]
    NotThePuzzle { path: PathBuf },
    /// The index has another format version.
    #[error("{}: the index has format version {found}, this program reads version {wanted}: generate the puzzles again", path.display())]
    Version { path: PathBuf, found: u32, wanted: u32 },
    /// The index is damaged, or a file of another kind.
    #[error("{0}: it is no index of puzzles: choose a folder that `mge puzzles generate` has written")]
    NoIndex(SyntaxError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// A puzzle's task file or the index is invalid.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// A prediction failed.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// The model cannot be used.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A file of the folder was made from another puzzle of the same name.
    #[error("{}: it was made from another puzzle of this name: remove it, or choose another folder with --out", path.display())]
    OtherPuzzle { path: PathBuf },
    /// The proposals in the folder come from another search.
    #[error("{}: its puzzles have subgoals of another model or number: choose another folder with --out", path.display())]
    OtherSearch { path: PathBuf },
    /// A setting of the trainings is also an option.
    #[error("--set {0}=...: tasks, methods, seeds, episodes and model of a bench have options of their own")]
    SettingOfOption(String),
    /// A statistic of the report cannot be computed.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure of the report cannot be written.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The threads of the batch cannot be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A job panicked.
    #[error("a puzzle's job panicked: {0}")]
    Panic(String),
    /// The batch was interrupted.
    #[error("interrupted after {done} of {jobs} puzzles: the same command continues")]
    Interrupted { done: usize, jobs: usize },
}

impl PuzzleError {
    /// Whether an interruption was requested.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted { .. })
    }

    /// An error of the file at `path`.
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }
}

impl From<Stopped> for PuzzleError {
    fn from(stopped: Stopped) -> Self {
        Self::Dynamics(stopped.into())
    }
}

impl JobError for PuzzleError {
    fn is_stopped(&self) -> bool {
        match self {
            Self::Dynamics(DynamicsError::Stopped) => true,
            Self::Prior(error) => error.is_stopped(),
            _ => false,
        }
    }
}

/// The outputs of the finished jobs, and the number of interrupted ones.
///
/// # Errors
/// The first failure.
pub(super) fn finished<T>(outcomes: Vec<Result<T, JobFailure<PuzzleError>>>) -> Result<(Vec<T>, usize), PuzzleError> {
    let (mut outputs, mut interrupted) = (Vec::new(), 0);
    for outcome in outcomes {
        match outcome {
            Ok(output) => outputs.push(output),
            Err(JobFailure::Interrupted) => interrupted += 1,
            Err(JobFailure::Error(error)) => return Err(error),
            Err(JobFailure::Panic(message)) => return Err(PuzzleError::Panic(message)),
        }
    }
    Ok((outputs, interrupted))
}
