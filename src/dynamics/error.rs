//! What can go wrong with dynamics models and their files.

use thiserror::Error;

use super::graph::EdgeType;
use crate::nn::{NnError, TensorFileError};
use crate::physics::ToolKind;
use crate::validation::ValidationError;

/// A model cannot be made, trained or used for what was asked.
#[derive(Debug, Error)]
pub enum DynamicsError {
    /// A setting is out of range.
    #[error("dynamics.{0}")]
    Config(#[from] ValidationError),
    /// No tool type was given, or one twice.
    #[error("the tool set `{given}` is not usable: name each of its tool types once, at least one")]
    ToolSet { given: String },
    /// The scene has an edge of a type the model was never trained on.
    #[error("the model was never trained on {edge} edges: it knows the tools {known}; train one for this tool set")]
    UnseenEdge { edge: EdgeType, known: String },
    /// An object's state or size is not a finite number.
    #[error("an object of the scene has a position, velocity or size that is not finite")]
    NotFinite,
    /// The task's rules are not those of the launches.
    #[error("task `{task}`: {what} differs from that of the launches the model learned from")]
    OtherPhysics { task: String, what: &'static str },
    /// The networks.
    #[error(transparent)]
    Network(#[from] NnError),
    /// The model file.
    #[error("{origin}: {source}")]
    File { origin: String, source: TensorFileError },
    /// The model file cannot be read or written.
    #[error("{origin}: {source}")]
    Io { origin: String, source: std::io::Error },
    /// The file is of another version of the format.
    #[error("{origin}: the model file has format version {found}, this program reads version {wanted}: train it again")]
    Version { origin: String, found: String, wanted: u32 },
    /// The file is a checkpoint or model of another kind than expected.
    #[error("{origin}: {reason}")]
    Content { origin: String, reason: String },
}

/// Names of a tool set in canonical order, joined by hyphens.
pub fn tool_set_name(tools: &[ToolKind]) -> String {
    tools.iter().map(|tool| tool.name()).collect::<Vec<_>>().join("-")
}

/// The tool set in canonical order.
///
/// # Errors
/// When it is empty or names a type twice.
pub fn canonical_tool_set(tools: &[ToolKind]) -> Result<Vec<ToolKind>, DynamicsError> {
    let mut sorted = tools.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.is_empty() || sorted.len() != tools.len() {
        return Err(DynamicsError::ToolSet { given: tool_set_name(tools) });
    }
    Ok(sorted)
}
