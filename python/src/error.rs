//! Errors of the library as Python exceptions.

use std::io::ErrorKind;

use pyo3::exceptions::{PyFileNotFoundError, PyIndexError, PyOSError, PyPermissionError, PyValueError};
use pyo3::prelude::*;

use mge_env::VectorError;

/// `OSError` or a subclass for I/O errors, else `ValueError`, with the library's message.
pub fn exception(error: impl std::error::Error + 'static) -> PyErr {
    let message = error.to_string();
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(&error);
    while let Some(error) = cause {
        if let Some(error) = error.downcast_ref::<std::io::Error>() {
            return match error.kind() {
                ErrorKind::NotFound => PyFileNotFoundError::new_err(message),
                ErrorKind::PermissionDenied => PyPermissionError::new_err(message),
                _ => PyOSError::new_err(message),
            };
        }
        cause = error.source();
    }
    PyValueError::new_err(message)
}

/// Gymnasium's `ResetNeeded` for an environment that must be reset first; otherwise `IndexError` or `ValueError`.
pub fn vector_exception(py: Python<'_>, error: VectorError) -> PyErr {
    let message = error.to_string();
    match error {
        VectorError::ResetNeeded { .. } => reset_needed(py, message),
        VectorError::NoSuchEnvironment { .. } => PyIndexError::new_err(message),
        VectorError::Refused(_) => PyValueError::new_err(message),
    }
}

fn reset_needed(py: Python<'_>, message: String) -> PyErr {
    let class = py.import("gymnasium.error").and_then(|module| module.getattr("ResetNeeded"));
    match class.and_then(|class| class.call1((message,))) {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}
