//! The models that come with the program, one for each tool set of the shipped tasks.

use std::path::Path;

use super::error::DynamicsError;
use super::model::Model;
use crate::physics::ToolKind;

/// Name and bytes of each shipped model, as in `assets/models/`.
const SHIPPED: [(&str, &[u8]); 3] = [
    ("bucket-box", include_bytes!("../../assets/models/bucket-box.safetensors")),
    ("square-floor", include_bytes!("../../assets/models/square-floor.safetensors")),
    ("box-wall-floor", include_bytes!("../../assets/models/box-wall-floor.safetensors")),
];

/// Names of the shipped models: their tool sets in canonical order.
pub fn shipped_names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The shipped model that knows all of `tools`, and as few others as possible.
///
/// # Errors
/// When a shipped model cannot be read.
pub fn shipped_for(tools: &[ToolKind]) -> Result<Option<Model>, DynamicsError> {
    let mut best: Option<Model> = None;
    for (name, bytes) in SHIPPED {
        let model = Model::from_bytes(bytes, name)?;
        let fits = tools.iter().all(|tool| model.tools().contains(tool));
        if fits && best.as_ref().is_none_or(|best| model.tools().len() < best.tools().len()) {
            best = Some(model);
        }
    }
    Ok(best)
}

/// The shipped model of that name, or the model in the file of that path.
///
/// # Errors
/// When it cannot be read.
pub fn named(name: &str) -> Result<Model, DynamicsError> {
    match shipped(name)? {
        Some(model) => Ok(model),
        None => Model::load(Path::new(name)),
    }
}

/// The shipped model of that name, if there is one.
///
/// # Errors
/// When it cannot be read.
pub fn shipped(name: &str) -> Result<Option<Model>, DynamicsError> {
    SHIPPED.iter().find(|(known, _)| *known == name).map(|(name, bytes)| Model::from_bytes(bytes, name)).transpose()
}
