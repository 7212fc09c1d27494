//! The models that come with the program, one for each tool set of the shipped tasks.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use super::error::{DynamicsError, Result};
use super::model::{Model, read_model};
use mge_base::identity::FileId;
use mge_base::paths::expanded;
use mge_base::spelling::unknown;
use mge_physics::ToolKind;

const FILES: [(&str, &[u8]); 3] = [
    ("bucket-box", include_bytes!("../models/bucket-box.safetensors")),
    ("square-floor", include_bytes!("../models/square-floor.safetensors")),
    ("box-wall-floor", include_bytes!("../models/box-wall-floor.safetensors")),
];

/// What `mge dynamics evaluate` prints of them.
const EVALUATIONS: [&str; 3] = [
    include_str!("../models/bucket-box.evaluation.json"),
    include_str!("../models/square-floor.evaluation.json"),
    include_str!("../models/box-wall-floor.evaluation.json"),
];

static MODELS: LazyLock<[(&str, Arc<Model>); 3]> = LazyLock::new(|| {
    // The files are part of the binary, and a test reads them all.
    FILES.map(|(name, bytes)| (name, Arc::new(Model::from_bytes(bytes, name).expect("a shipped model"))))
});

/// The shipped models by name, which is their tool set in canonical order. They are loaded once.
pub fn shipped_models() -> &'static [(&'static str, Arc<Model>)] {
    &*MODELS
}

/// The evaluation of the shipped model with this name, as JSON.
pub fn shipped_evaluation(name: &str) -> Option<&'static str> {
    FILES.iter().zip(EVALUATIONS).find(|((known, _), _)| *known == name).map(|(_, text)| text)
}

/// The shipped model with the smallest tool set that includes all of `tools`.
pub fn shipped_for(tools: &[ToolKind]) -> Option<Arc<Model>> {
    let fitting = MODELS.iter().filter(|(_, model)| tools.iter().all(|tool| model.tools().contains(tool)));
    fitting.min_by_key(|(_, model)| model.tools().len()).map(|(_, model)| model.clone())
}

/// The shipped model with this name, or else the model in the file at this path; with `id`, only if it is this one.
///
/// # Errors
/// When the file cannot be read, is no model, or is another one.
pub fn named(name: impl AsRef<Path>, id: Option<&FileId>) -> Result<Arc<Model>> {
    let path = expanded(name.as_ref());
    let is_wanted = |model: &Arc<Model>| id.is_none_or(|id| model.id() == *id);
    if let Some(model) = path.to_str().and_then(shipped).filter(is_wanted) {
        return Ok(model);
    }
    let mut model = Model::from_bytes(&file_of(&path, id)?, &path.display().to_string())?;
    if let Some(id) = id {
        model.file = Some(id.clone());
    }
    Ok(Arc::new(model))
}

/// The bytes of the file of [`named`].
///
/// # Errors
/// When the file cannot be read or is another one.
pub fn file_of(name: &Path, id: Option<&FileId>) -> Result<Cow<'static, [u8]>> {
    let bytes = match FILES.iter().find(|(known, _)| Path::new(known) == name) {
        Some((_, bytes)) => Cow::Borrowed(*bytes),
        None => Cow::Owned(read_model(&expanded(name)).map_err(|error| match &error {
            // A path has a folder or an extension.
            DynamicsError::Io { source, .. }
                if source.kind() == ErrorKind::NotFound && name.file_stem() == Some(name.as_os_str()) =>
            {
                DynamicsError::Unknown(unknown("model", &FILES.map(|(known, _)| known), &name.display().to_string()))
            }
            _ => error,
        })?),
    };
    let Some(id) = id else { return Ok(bytes) };
    let found = FileId::new(name, &bytes);
    if found == *id {
        return Ok(bytes);
    }
    let reason = format!(
        "it is not the model `{}` with SHA-256 {}.. any more, but another one with {}..: choose it again, or restore it",
        id.name,
        id.digits(),
        found.digits()
    );
    Err(DynamicsError::Content { origin: name.display().to_string(), reason })
}

/// The shipped model with this name, if there is one.
pub fn shipped(name: &str) -> Option<Arc<Model>> {
    MODELS.iter().find(|(known, _)| *known == name).map(|(_, model)| model.clone())
}
