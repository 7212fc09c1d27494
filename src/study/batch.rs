//! One run among many: made, resumed or left alone, whichever it needs.

use std::path::Path;

use crate::run::{RunDirectory, RunError, RunState};
use crate::trainer::{RunConfig, TrainerError, Watch, train};

/// Trains the run in `path` to its end: makes it if it is not there, goes on with it if it
/// was interrupted, and does nothing if it is finished.
///
/// # Errors
/// As [`train`], and when the folder cannot be used.
pub fn train_to_end(path: &Path, config: &RunConfig, watch: &Watch) -> Result<RunDirectory, TrainerError> {
    let directory = match RunDirectory::open(path) {
        Err(RunError::NotARun(_)) => RunDirectory::create(path, config)?,
        opened => opened?,
    };
    if directory.status()?.state != RunState::Finished {
        let (_nobody, controls) = crossbeam_channel::unbounded();
        train(&directory, &controls, watch)?;
    }
    Ok(directory)
}
