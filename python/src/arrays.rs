//! Arrays passed in from Python.

use numpy::PyReadonlyArray;
use numpy::ndarray::Dimension;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Converts numbers of any type to contiguous float32. `wanted` is the expected shape, for the error message.
pub fn numbers<'py, D: Dimension>(
    values: &Bound<'py, PyAny>,
    name: &str,
    wanted: &str,
) -> PyResult<PyReadonlyArray<'py, f32, D>> {
    let numpy = values.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (values,))?;
    let kind = array.getattr("dtype")?;
    if !["f", "i", "u"].contains(&kind.getattr("kind")?.extract::<String>()?.as_str()) {
        return Err(PyTypeError::new_err(format!(
            "`{name}` is of type {kind}, and should be numbers, such as float32"
        )));
    }
    if D::NDIM != Some(array.getattr("ndim")?.extract()?) {
        let shape = array.getattr("shape")?;
        return Err(PyValueError::new_err(format!("`{name}` has the shape {shape}, and should have {wanted}")));
    }
    numpy.call_method1("ascontiguousarray", (array, "float32"))?.extract()
}
