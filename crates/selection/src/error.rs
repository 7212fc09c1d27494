//! What can go wrong with policies and their files.

use thiserror::Error;

use mge_nn::{NnError, TensorFileError};

/// A policy cannot be trained, read or written.
#[derive(Debug, Error)]
pub enum SelectionError {
    /// The training has diverged, or memory is short.
    #[error(transparent)]
    Network(#[from] NnError),
    /// The content of the file is invalid.
    #[error("{origin}: {source}")]
    File { origin: String, source: TensorFileError },
    /// The file cannot be read or written.
    #[error("{origin}: {source}")]
    Io { origin: String, source: std::io::Error },
    /// The file is no policy, or one of another version or for another task.
    #[error(
        "{origin}: not a policy for this task: its {key} is `{found}`, not `{wanted}`; train one with `mge selection train`"
    )]
    Other { origin: String, key: &'static str, found: String, wanted: String },
}
