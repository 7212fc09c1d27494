//! What can go wrong with dynamics models and their files.

use thiserror::Error;

use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_nn::{NnError, TensorFileError};
use mge_physics::ToolKind;

/// Result of work with dynamics models.
pub type Result<T, E = DynamicsError> = std::result::Result<T, E>;

/// A model cannot be created, trained, read, written or used as asked.
#[derive(Debug, Error)]
pub enum DynamicsError {
    /// A setting is out of range.
    #[error("dynamics.{0}")]
    Config(#[from] ValidationError),
    /// The caller asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// No tool type was given, or a type was given twice.
    #[error("the tool set `{given}` is not usable: name each of its tool types once, at least one")]
    ToolSet { given: String },
    /// The scene has an edge of a type the model was never trained on.
    #[error(
        "the model was never trained on {sender}-to-ball edges: it knows the tools {}; train one for this tool set",
        known.replace('-', ", ")
    )]
    UnseenEdge { sender: ToolKind, known: String },
    /// Something other than the one ball that a model predicts moves in the task.
    #[error(
        "task `{task}`: the model was never trained on ball-to-ball edges, and {what} moves here besides the target: use the model `true`, the true physics"
    )]
    OtherMovers { task: String, what: &'static str },
    /// An object's state or size is not a finite number.
    #[error("an object of the scene has a position, velocity or size that is not finite")]
    NotFinite,
    /// A rewarding action to be clustered is not a finite number.
    #[error("a rewarding action has a coordinate that is not finite: it belongs to no cluster")]
    ActionNotFinite,
    /// The task's physics differ from those of the launches.
    #[error("task `{task}`: {what} differs from that of the launches the model learned from")]
    OtherPhysics { task: String, what: &'static str },
    /// An error of the networks.
    #[error(transparent)]
    Network(#[from] NnError),
    /// Neither a model nor a file has the name.
    #[error("{0}; or name the file of a model")]
    Unknown(String),
    /// The content of the model file is invalid.
    #[error("{origin}: {source}")]
    File { origin: String, source: TensorFileError },
    /// The model file cannot be read or written.
    #[error("{origin}: {source}")]
    Io { origin: String, source: std::io::Error },
    /// The file is not the expected model, or of another format version.
    #[error("{origin}: {reason}")]
    Content { origin: String, reason: String },
}
