//! Training of a model into a file, with a checkpoint beside it from which an interrupted training
//! continues.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::config::{ModelConfig, TrainConfig};
use super::error::{DynamicsError, Result};
use super::model::Model;
use super::tool_set::canonical_tool_set;
use super::train::{Progress, Training, TrainingOutcome};
use mge_base::atomic::{self, Target};
use mge_base::bounded;
use mge_base::stop::Stop;
use mge_nn::TensorFile;
use mge_physics::ToolKind;

/// Epochs between two checkpoints.
const CHECKPOINT_EVERY: u32 = 100;
/// Largest checkpoint, in bytes: an optimiser keeps up to two numbers for each weight of the model.
const MAX_CHECKPOINT_BYTES: u64 = 3 * bounded::MODEL;

/// An ended training into a file.
#[derive(Debug)]
pub struct TrainedModel {
    /// The training in its final state.
    pub training: Training,
    /// How it ended.
    pub ended: TrainingOutcome,
    /// Mean loss of the last epoch, of normalised outputs; `None` if this call trained no epoch.
    pub train_loss: Option<f32>,
    checkpoint: PathBuf,
}

impl TrainedModel {
    /// The model after the last epoch, or after the last one before the training diverged.
    pub fn model(&self) -> &Model {
        self.training.model()
    }

    /// The epoch in which the training diverged and the reason, as text; `None` if it did not diverge.
    pub fn divergence(&self) -> Option<String> {
        match &self.ended {
            TrainingOutcome::Diverged { epoch, reason } => Some(format!("epoch {epoch}: {reason}")),
            TrainingOutcome::Done | TrainingOutcome::Stopped => None,
        }
    }

    /// Ends a training that was not stopped: removes the checkpoint, and returns why it diverged.
    pub fn finish(&self) -> Option<String> {
        self.remove_checkpoint();
        self.divergence().map(|reason| format!("{reason}; the model is that of the epoch before"))
    }

    /// Removes the checkpoint. Call this once everything needed from the training has been saved. A
    /// failure is harmless: the same training would just continue from the checkpoint.
    pub fn remove_checkpoint(&self) {
        let _ = std::fs::remove_file(&self.checkpoint);
    }
}

/// The checkpoint of a training into the model file `path`: the full file name with `.checkpoint`
/// appended, so that each model file has its own checkpoint and none is its own checkpoint.
pub fn checkpoint_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}

/// Trains a model into a file, starting from the checkpoint beside it if there is one. A
/// completed training saves its model, a diverged one that of the epoch before, a stopped one its checkpoint.
/// `on_progress` is called after every epoch. The other arguments are those of [`Training::new`].
///
/// # Errors
/// As [`Training::new`] and [`Training::resume`], for example when `stop` is requested before the first epoch; when
/// the checkpoint belongs to a training with other settings, the file is of another kind, or a file cannot be read or
/// written.
pub fn train_to_file(
    to: impl Into<Target>,
    config: ModelConfig,
    settings: TrainConfig,
    tools: &[ToolKind],
    command: &str,
    stop: &Stop,
    mut on_progress: impl FnMut(&Progress),
) -> Result<TrainedModel> {
    config.validate()?;
    settings.validate()?;
    // Refused before the training.
    let to = to.into();
    let checked = to.check(&Model::FORMAT).and_then(|()| atomic::create_parent(&to.path));
    checked.map_err(|source| DynamicsError::Io { origin: to.path.display().to_string(), source })?;
    let checkpoint = checkpoint_of(&to.path);
    let io = |source| DynamicsError::Io { origin: checkpoint.display().to_string(), source };
    let read = bounded::regular(&checkpoint).and_then(|()| bounded::read(&checkpoint, MAX_CHECKPOINT_BYTES));
    let mut training = match read {
        Ok(bytes) => resume(&bytes, &checkpoint.display().to_string(), &config, &settings, tools, stop)?,
        Err(error) if error.kind() == ErrorKind::NotFound => Training::new(config, settings, tools, command, stop)?,
        Err(error) => return Err(io(error)),
    };
    let (mut train_loss, mut failure) = (None, None);
    let save = |training: &Training| atomic::write(&checkpoint, &training.checkpoint().to_bytes());
    let ended = training.run(stop, |training, now| {
        train_loss = Some(now.loss);
        on_progress(now);
        if now.epoch < now.epochs && now.epoch.is_multiple_of(CHECKPOINT_EVERY) {
            failure = save(training).err();
        }
        failure.is_none()
    });
    if ended == TrainingOutcome::Stopped && failure.is_none() && training.epoch() > 0 {
        failure = save(&training).err();
    }
    if let Some(error) = failure {
        return Err(io(error));
    }
    if ended != TrainingOutcome::Stopped {
        training.model().save(&to.path)?;
    }
    Ok(TrainedModel { training, ended, train_loss, checkpoint })
}

fn resume(
    bytes: &[u8],
    origin: &str,
    config: &ModelConfig,
    settings: &TrainConfig,
    tools: &[ToolKind],
    stop: &Stop,
) -> Result<Training> {
    let origin_of = |source| DynamicsError::File { origin: origin.to_owned(), source };
    let training = Training::resume(&TensorFile::from_bytes(bytes).map_err(origin_of)?, origin, stop)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_file_has_its_own_checkpoint_file() {
        let of = |path: &str| checkpoint_of(Path::new(path)).display().to_string();
        assert_eq!(of("m/a.safetensors"), "m/a.safetensors.checkpoint");
        assert_eq!(of("a.checkpoint"), "a.checkpoint.checkpoint");
        assert_ne!(of("a.safetensors"), of("a.model"));
    }

    #[test]
    fn a_file_of_another_kind_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.safetensors");
        std::fs::write(&path, "{}").unwrap();
        let settings = TrainConfig { epochs: 1, observations: 1, ..TrainConfig::default() };
        let outcome =
            train_to_file(&path, ModelConfig::default(), settings, &[ToolKind::Box], "", &Stop::default(), |_| ());
        assert!(outcome.unwrap_err().to_string().contains("is not a dynamics model"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "{}");
    }

    #[test]
    fn a_path_for_no_file_is_refused_before_the_training() {
        let folder = tempfile::tempdir().unwrap();
        let train = |path: &Path| {
            let (config, settings) = (ModelConfig::default(), TrainConfig::default());
            train_to_file(path, config, settings, &[ToolKind::Box], "test", &Stop::default(), |_| panic!("it trains"))
        };
        assert!(matches!(train(folder.path()), Err(DynamicsError::Io { .. })));
        std::fs::write(folder.path().join("file"), "").unwrap();
        assert!(matches!(train(&folder.path().join("file/model")), Err(DynamicsError::Io { .. })));
    }

    #[test]
    fn a_device_in_place_of_the_checkpoint_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model");
        std::os::unix::fs::symlink("/dev/null", checkpoint_of(&path)).unwrap();
        let (config, settings) = (ModelConfig::default(), TrainConfig::default());
        let trained = train_to_file(&path, config, settings, &[ToolKind::Box], "test", &Stop::default(), |_| ());
        assert!(matches!(trained, Err(DynamicsError::Io { .. })), "{trained:?}");
    }

    #[test]
    fn a_stopped_training_continues_where_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let [whole, stopped] = ["whole", "stopped"].map(|name| folder.path().join(name));
        let train = |path: &Path, last: u32| {
            let config = ModelConfig { layers: 1, width: 8, embedding: 4, ..ModelConfig::default() };
            let settings =
                TrainConfig { observations: 4, validation: 2, epochs: 4, batch: 4, ..TrainConfig::default() };
            let (mut epochs, stop) = (Vec::new(), Stop::default());
            let trained = train_to_file(path, config, settings, &[ToolKind::Box], "test", &stop, |now| {
                epochs.push(now.epoch);
                if now.epoch == last {
                    stop.request();
                }
            });
            (trained.unwrap(), epochs)
        };
        let (trained, epochs) = train(&whole, 9);
        assert_eq!((trained.ended, epochs), (TrainingOutcome::Done, vec![1, 2, 3, 4]));
        let (trained, _) = train(&stopped, 2);
        assert_eq!(trained.ended, TrainingOutcome::Stopped);
        assert!(!stopped.exists() && checkpoint_of(&stopped).exists());
        let (trained, epochs) = train(&stopped, 9);
        assert_eq!((&trained.ended, epochs), (&TrainingOutcome::Done, vec![3, 4]));
        trained.remove_checkpoint();
        assert!(!checkpoint_of(&stopped).exists());
        assert_eq!(std::fs::read(&whole).unwrap(), std::fs::read(&stopped).unwrap());
    }
}
