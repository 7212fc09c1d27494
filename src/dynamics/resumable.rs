//! A training that survives being interrupted: a checkpoint beside it, every so many epochs.

use std::io::ErrorKind;
use std::path::Path;

use super::config::{ModelConfig, TrainConfig};
use super::error::DynamicsError;
use super::tool_set::canonical_tool_set;
use super::train::{Ended, Progress, Training};
use crate::nn::TensorFile;
use crate::physics::ToolKind;

/// Epochs between two checkpoints.
const CHECKPOINT_EVERY: u32 = 100;

/// Trains a model to the end, or as far as it goes; goes on from the checkpoint at `path` if
/// there is one, and leaves one there. `watch` sees every epoch. Once the model is saved, the
/// checkpoint is only in the way. The arguments are those of [`Training::new`].
///
/// # Errors
/// As [`Training::new`] and [`Training::resume`]; when the checkpoint is that of a training with
/// other settings, or cannot be read or written.
pub fn train_resumably(
    path: &Path,
    config: ModelConfig,
    settings: TrainConfig,
    tools: &[ToolKind],
    command: &str,
    mut watch: impl FnMut(&Progress),
) -> Result<(Training, Ended), DynamicsError> {
    let io = |source| DynamicsError::Io { origin: path.display().to_string(), source };
    let mut training = match std::fs::read(path) {
        Ok(bytes) => resume(&bytes, &path.display().to_string(), &config, &settings, tools)?,
        Err(error) if error.kind() == ErrorKind::NotFound => Training::new(config, settings, tools, command)?,
        Err(error) => return Err(io(error)),
    };
    let mut failure = None;
    let ended = training.run(|training, now| {
        watch(now);
        if now.epoch.is_multiple_of(CHECKPOINT_EVERY) && now.epoch < now.epochs {
            failure = crate::atomic::write(path, &training.checkpoint().to_bytes()).err();
        }
        failure.is_none()
    });
    match failure {
        Some(error) => Err(io(error)),
        None => Ok((training, ended)),
    }
}

fn resume(
    bytes: &[u8],
    origin: &str,
    config: &ModelConfig,
    settings: &TrainConfig,
    tools: &[ToolKind],
) -> Result<Training, DynamicsError> {
    let origin_of = |source| DynamicsError::File { origin: origin.to_owned(), source };
    let training = Training::resume(&TensorFile::from_bytes(bytes).map_err(origin_of)?, origin)?;
    let model = training.model();
    let same = model.config() == config
        && model.provenance().training == *settings
        && model.tools() == canonical_tool_set(tools)?;
    if same {
        return Ok(training);
    }
    let reason = "it is of a training with other settings: use them, or remove the file".to_owned();
    Err(DynamicsError::Content { origin: origin.to_owned(), reason })
}
