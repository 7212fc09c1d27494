//! One training of a batch: created, resumed or left alone, whichever it needs.

use std::path::Path;

use super::runner::JobHandle;
use crate::run::{RunDirectory, RunError, RunState};
use crate::trainer::{Ending, RunConfig, TrainerError, train};

/// Trains the run in `path` to its end: creates it if it does not exist, continues it if it was
/// interrupted, and does nothing if it is finished. None if it was asked to stop before its end.
///
/// # Errors
/// As [`train`], and when the folder cannot be used.
pub fn train_to_end(path: &Path, config: &RunConfig, handle: &JobHandle) -> Result<Option<RunDirectory>, TrainerError> {
    let directory = match RunDirectory::open(path) {
        Err(RunError::NotARun(_)) => RunDirectory::create(path, config)?,
        opened => opened?,
    };
    if directory.status()?.state != RunState::Finished
        && train(&directory, handle.controls(), handle.watch())? == Ending::Stopped
    {
        return Ok(None);
    }
    Ok(Some(directory))
}
