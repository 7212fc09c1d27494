//! Errors of figures.

use std::path::{Path, PathBuf};

/// Largest side of an image in pixels.
pub const MAX_SIDE: u32 = 20_000;

/// Why a figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// An image could not be encoded.
    #[error("the image cannot be encoded: {0}")]
    Encoding(String),
    /// The image size is 0 or too large.
    #[error(
        "an image of {width} x {height} pixels cannot be drawn: ask for a size from 1 to {MAX_SIDE} or a lower resolution"
    )]
    Size { width: u32, height: u32 },
    /// The file's extension is not a format that the figure can be written in.
    #[error("{}: figures are written as `.png` or `.svg`: use one of these extensions", .0.display())]
    Format(PathBuf),
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
}

impl FigureError {
    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }
}
