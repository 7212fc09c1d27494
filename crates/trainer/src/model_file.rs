//! A run's dynamics model: in a file, known by its content, or trained for the run. Both are copied to the run's
//! folder.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use educe::Educe;

use super::config::RunConfig;
use super::error::Result;
use super::method::PriorSource;
use super::watch::Phase;
use mge_base::identity::FileId;
use mge_base::paths::expanded;
use mge_base::spelling::unknown;
use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, DynamicsError, Model, Recipe};
use mge_run::{RunDirectory, RunError};

/// A dynamics model in a file, or a shipped one by its name. Equal if the content is, wherever the file is.
#[derive(Debug, Clone, Eq)]
pub struct ModelFile {
    /// Where it is: a path, or the name of a shipped model. Saved only while `id` is not known.
    pub path: PathBuf,
    /// Its name and hash; none until it is read, and in runs of earlier versions.
    pub id: Option<FileId>,
}

impl PartialEq for ModelFile {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id && (self.id.is_some() || self.path == other.path)
    }
}

impl From<PathBuf> for ModelFile {
    fn from(path: PathBuf) -> Self {
        Self { path, id: None }
    }
}

impl From<String> for ModelFile {
    fn from(text: String) -> Self {
        match text.parse::<FileId>() {
            Ok(id) => Self { path: PathBuf::new(), id: Some(id) },
            Err(()) => Self { path: expanded(text), id: None },
        }
    }
}

impl From<ModelFile> for String {
    fn from(file: ModelFile) -> Self {
        file.id.map_or_else(|| file.path.display().to_string(), |id| id.to_string())
    }
}

/// The model that is trained for a run, as the run's settings determine it: all are equal.
#[derive(Debug, Clone, Default, Educe, Eq)]
#[educe(PartialEq)]
pub struct RunModel {
    /// Its copy in the folder of the run, if there is a run.
    #[educe(PartialEq = false)]
    copy: Option<PathBuf>,
}

impl RunModel {
    /// The copy, if there is one and it is by this recipe.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(super) fn copied(&self, recipe: &Recipe) -> Result<Option<Model>, DynamicsError> {
        self.copy.as_ref().filter(|path| path.exists()).map_or(Ok(None), |path| recipe.read(path))
    }
}

/// What may be chosen by its name.
const NAMES: [&str; 8] =
    ["trained", "learned", "rapier", "true", "uniform", "bucket-box", "square-floor", "box-wall-floor"];

impl ModelFile {
    /// The same model, known by its content from now on. A file that cannot be read stays known by its path.
    fn identified(self) -> Self {
        match dynamics::file_of(&self.path, None) {
            Ok(bytes) if self.id.is_none() => Self { id: Some(FileId::new(&self.path, &bytes)), ..self },
            _ => self,
        }
    }

    /// Reads the model.
    ///
    /// # Errors
    /// When it cannot be read, or the content of the file has changed since its identity was determined.
    pub fn load(&self) -> Result<Arc<Model>, DynamicsError> {
        let path = self.id.as_ref().map_or(Ok(&*self.path), |id| self.known_path(id))?;
        dynamics::named(path, self.id.as_ref()).map_err(|error| match error {
            DynamicsError::Unknown(_) => DynamicsError::Unknown(unknown("model", &NAMES, &path.display().to_string())),
            error => error,
        })
    }

    fn known_path(&self, id: &FileId) -> Result<&Path, DynamicsError> {
        if !self.path.as_os_str().is_empty() {
            return Ok(&self.path);
        }
        let reason = "it is known by its content, but not where it is: name its file".to_owned();
        Err(DynamicsError::Content { origin: id.to_string(), reason })
    }
}

impl PriorSource {
    /// The same source, with a model in a file known by its content from now on.
    #[must_use]
    pub fn identified(self) -> Self {
        match self {
            Self::ModelFile(file) => Self::ModelFile(file.identified()),
            other => other,
        }
    }

    /// What names the source in a command: as [`String`], but a file by its path.
    pub fn place(&self) -> String {
        match self {
            Self::ModelFile(file) if !file.path.as_os_str().is_empty() => file.path.display().to_string(),
            other => other.clone().into(),
        }
    }

    /// Its name for people: a file without folder, extension and hash.
    pub fn name(&self) -> String {
        match self {
            Self::ModelFile(ModelFile { id: Some(id), .. }) => id.name.clone(),
            other => other.clone().into(),
        }
    }
}

impl RunConfig {
    /// The configuration of a run. Its model is the copy in the run's folder.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(directory: &RunDirectory) -> Result<Self, RunError> {
        let mut config: Self = directory.config()?;
        match &mut config.prior {
            PriorSource::ModelFile(file @ ModelFile { id: Some(_), .. }) => file.path = directory.model_path(),
            PriorSource::Trained(model) => model.copy = Some(directory.model_path()),
            _ => {}
        }
        Ok(config)
    }

    /// Whether both train in the same way, with equal models if these can be read.
    pub fn trains_as(&self, other: &Self) -> bool {
        self.identified() == other.identified()
    }

    /// Creates the run, with a copy of the model that it uses.
    ///
    /// # Errors
    /// As [`RunDirectory::create`], and when the model cannot be read.
    pub fn create_run(&self, path: &Path) -> Result<RunDirectory> {
        self.check_supported()?;
        let config = self.identified();
        Ok(RunDirectory::create_with_model(path, &config, config.model_bytes()?.as_deref())?)
    }

    /// The run, which is created if there is none.
    ///
    /// # Errors
    /// As [`create_run`](Self::create_run) and [`RunDirectory::open`].
    pub fn open_or_create_run(&self, path: &Path) -> Result<RunDirectory> {
        RunDirectory::open_or(path, || self.create_run(path))
    }

    /// The configuration as it is saved, without the path of the model, which is known by its content.
    pub(super) fn identified(&self) -> Self {
        Self { prior: self.prior.clone().identified(), ..self.clone() }
    }

    /// The recipe of the model that is trained for these settings.
    pub(super) fn recipe(&self) -> Recipe {
        self.model.recipe(&self.task, self.seed)
    }

    /// Whether both have the same source of rollouts, and the same model.
    pub(super) fn has_model_of(&self, other: &Self) -> bool {
        let [source, others] = [self, other].map(Self::rollout_source);
        source == others && (!matches!(source, PriorSource::Trained(_)) || self.recipe() == other.recipe())
    }

    /// Whether the run consults its source of rollouts at all.
    fn uses_model(&self) -> bool {
        self.is_guided() || self.method.consults_model()
    }

    /// Makes sure that a run that trains its own model has it in its folder.
    ///
    /// # Errors
    /// When the copy cannot be read or written, or soon after a request of `stop`.
    pub(super) fn make_model(
        &self,
        directory: &RunDirectory,
        mut on_phase: impl FnMut(Phase),
        stop: &Stop,
    ) -> Result<()> {
        let (PriorSource::Trained(_), true) = (self.rollout_source(), self.uses_model()) else { return Ok(()) };
        let (recipe, own) = (self.recipe(), RunModel { copy: Some(directory.model_path()) });
        recipe.check_task(&self.task)?;
        if own.copied(&recipe)?.is_none() {
            recipe.model(stop, |now| on_phase(Phase::of_model(now)))?.save(&directory.model_path())?;
        }
        Ok(())
    }

    /// The bytes of the model that the run uses, for its copy; none if it uses none, or trains it when it begins.
    pub(super) fn model_bytes(&self) -> Result<Option<Cow<'static, [u8]>>> {
        match self.rollout_source() {
            _ if !self.uses_model() => Ok(None),
            PriorSource::ModelFile(file) => {
                let Some(id) = &file.id else { return Ok(None) };
                Ok(Some(dynamics::file_of(file.known_path(id)?, Some(id))?))
            }
            PriorSource::Trained(own) => {
                let copied = own.copied(&self.recipe())?;
                Ok(copied.map(|model| model.to_file().to_bytes().into()))
            }
            _ => Ok(None),
        }
    }

    /// The dynamics model that a run with these settings uses, as [`FileId`], if it uses one.
    pub(super) fn model_id(&self) -> Option<String> {
        match self.rollout_source() {
            _ if !self.uses_model() => None,
            PriorSource::Learned => Some(dynamics::shipped_for(&self.task.tool_set())?.id().to_string()),
            PriorSource::Trained(own) => Some(own.copied(&self.recipe()).ok()??.id().to_string()),
            PriorSource::ModelFile(file) => Some(file.into()),
            PriorSource::Rapier | PriorSource::TruePhysics | PriorSource::Uniform => None,
        }
    }

    /// Launches from which the model was trained that the run uses; 0 if it uses none, or the model cannot be read.
    pub fn launches(&self) -> u64 {
        let of = |model: &Model| (model.tools().len() * model.provenance.training.observations) as u64;
        match self.rollout_source() {
            _ if !self.uses_model() => 0,
            PriorSource::Uniform | PriorSource::Rapier | PriorSource::TruePhysics => 0,
            PriorSource::Trained(_) => self.recipe().launches() as u64,
            PriorSource::Learned => dynamics::shipped_for(&self.task.tool_set()).map_or(0, |model| of(&model)),
            PriorSource::ModelFile(file) => file.load().map_or(0, |model| of(&model)),
        }
    }
}
