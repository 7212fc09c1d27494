//! One training of a batch: created, resumed or, if finished, left alone.

use std::path::Path;

use super::runner::JobHandle;
use crate::{Ending, Result, RunConfig, TrainerError, train};
use mge_run::RunState;

/// Trains the run in `path` to its end: creates it if it does not exist, resumes it if it was interrupted, and does
/// nothing if it is finished. Returns None if the job was stopped before its end.
///
/// # Errors
/// As [`train`], when the folder cannot be used, and when it was stopped by itself, and the others of the batch go on.
pub fn train_to_end(path: &Path, config: &RunConfig, handle: &JobHandle) -> Result<Option<()>> {
    let directory = config.open_or_create_run(path)?;
    if directory.status()?.state == RunState::Finished
        || train(&directory, &handle.controls.1, &handle.watch)? == Ending::Finished
    {
        return Ok(Some(()));
    }
    let reason = "it was stopped on request: the same command continues it";
    if handle.is_stopped() { Ok(None) } else { Err(TrainerError::Refused(reason.to_owned())) }
}
