//! The models that come with the program, one for each tool set of the shipped tasks.

use std::sync::{Arc, LazyLock};

use super::error::Result;
use super::model::Model;
use crate::paths::expanded;
use crate::physics::ToolKind;

static MODELS: LazyLock<[(&str, Arc<Model>); 3]> = LazyLock::new(|| {
    [
        ("bucket-box", &include_bytes!("../../assets/models/bucket-box.safetensors")[..]),
        ("square-floor", include_bytes!("../../assets/models/square-floor.safetensors")),
        ("box-wall-floor", include_bytes!("../../assets/models/box-wall-floor.safetensors")),
    ]
    // The files are part of the binary, and a test reads them all.
    .map(|(name, bytes)| (name, Arc::new(Model::from_bytes(bytes, name).expect("a shipped model"))))
});

/// The shipped models by name, which is their tool set in canonical order. They are loaded once.
pub fn shipped_models() -> &'static [(&'static str, Arc<Model>)] {
    &*MODELS
}

/// The shipped model with the smallest tool set that includes all of `tools`.
pub fn shipped_for(tools: &[ToolKind]) -> Option<Arc<Model>> {
    let fitting = MODELS.iter().filter(|(_, model)| tools.iter().all(|tool| model.tools().contains(tool)));
    fitting.min_by_key(|(_, model)| model.tools().len()).map(|(_, model)| model.clone())
}

/// The shipped model with this name, or else the model in the file at this path.
///
/// # Errors
/// When the file cannot be read.
pub fn named(name: &str) -> Result<Arc<Model>> {
    shipped(name).map_or_else(|| Model::load(&expanded(name)).map(Arc::new), Ok)
}

/// The shipped model with this name, if there is one.
pub fn shipped(name: &str) -> Option<Arc<Model>> {
    MODELS.iter().find(|(known, _)| *known == name).map(|(_, model)| model.clone())
}
