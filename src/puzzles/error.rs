//! What can go wrong with generated puzzles, as one line for the person who reads it.

use std::path::{Path, PathBuf};

use crate::batch::{BatchError, JobError, JobFailure};
use crate::dynamics::DynamicsError;
use crate::json::SyntaxError;
use crate::run::RunError;
use crate::task::TaskError;
use crate::trainer::PriorError;

/// Why puzzles cannot be generated or used.
#[derive(Debug, thiserror::Error)]
pub enum PuzzleError {
    /// The folder holds puzzles of another kind.
    #[error("{}: these puzzles have another seed, split or start noise: choose another folder with --out", path.display())]
    OtherPuzzles { path: PathBuf },
    /// The index is of another version of the format.
    #[error("{}: the index has format version {found}, this program reads version {wanted}: generate the puzzles again", path.display())]
    Version { path: PathBuf, found: u32, wanted: u32 },
    /// A file is not the JSON that it should be.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// A puzzle's task file.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// The dynamics model.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// The source of predictions.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A trained run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Threads.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A mistake of the program.
    #[error("a puzzle's job panicked: {0}")]
    Panic(String),
    /// It was asked to stop.
    #[error("interrupted after {done} of {jobs} puzzles: the same command continues")]
    Interrupted { done: usize, jobs: usize },
}

impl PuzzleError {
    /// An error of the file at `path`.
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }
}

impl JobError for PuzzleError {
    fn is_in_use(&self) -> bool {
        false
    }
}

/// The outputs of the jobs that have one, and how many have none because of an interruption.
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
