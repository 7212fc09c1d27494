//! Errors of the library as exceptions of Python.

use std::io::ErrorKind;

use pyo3::exceptions::{PyFileNotFoundError, PyIndexError, PyOSError, PyPermissionError, PyValueError};
use pyo3::prelude::*;

use mge::env::VectorError;

/// `OSError` and its kinds where the system has refused something, else `ValueError`; the message
/// is the library's.
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

/// An environment that must be reset first is Gymnasium's `ResetNeeded`.
pub fn vector_exception(py: Python<'_>, error: VectorError) -> PyErr {
    let message = error.to_string();
    match error {
        VectorError::NotBegun { .. } | VectorError::Over { .. } => reset_needed(py, message),
        VectorError::NoSuch { .. } => PyIndexError::new_err(message),
        VectorError::NotFinite { .. }
        | VectorError::NoTool { .. }
        | VectorError::OtherTask { .. }
        | VectorError::OtherTools { .. } => PyValueError::new_err(message),
    }
}

fn reset_needed(py: Python<'_>, message: String) -> PyErr {
    let class = py.import("gymnasium.error").and_then(|module| module.getattr("ResetNeeded"));
    match class.and_then(|class| class.call1((message,))) {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}
