//! What can go wrong with a sweep, as one line for the person who reads it.

use std::path::PathBuf;

use crate::batch::BatchError;
use crate::json::SyntaxError;
use crate::run::RunError;
use crate::validation::ValidationError;

/// Why a sweep cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The sweep file is not JSON, or not an object of lists.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// The sweep file has a setting or value that cannot be used.
    #[error("{origin}: at {problem}")]
    Invalid {
        /// The sweep file, and the line.
        origin: String,
        /// Where and what.
        problem: ValidationError,
    },
    /// The sweep's files, and those of its runs.
    #[error(transparent)]
    Run(#[from] RunError),
    /// No thread can be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The sweep was asked to stop.
    #[error("interrupted after {done} of {jobs}: the same command continues where it stopped")]
    Interrupted {
        /// Jobs that are finished.
        done: usize,
        /// Jobs in all.
        jobs: usize,
    },
    /// A run of the sweep's folder has the name of one of the sweep, but is another.
    #[error(
        "{} holds a run with other settings than the sweep asks for: choose another folder with --out, or remove it",
        .0.display()
    )]
    OtherRun(PathBuf),
    /// A plan has one command a line.
    #[error("{:?} has a line break, and a plan has one command a line: choose another folder with --out", .0.display().to_string())]
    LineBreak(PathBuf),
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
        /// What is wrong with the two, as a verb.
        problem: &'static str,
    },
    /// A run that is to be collected is still being worked on.
    #[error("{} is being trained: wait for it, or stop it: nothing was copied", .0.display())]
    Busy(PathBuf),
    /// Agents and dynamics models in one folder.
    #[error("{} holds an agent and {} a dynamics model: collect them into two folders", agent.display(), model.display())]
    Mixed {
        /// Folder of an agent's run.
        agent: PathBuf,
        /// Folder of a model's.
        model: PathBuf,
    },
}
