//! CREATE's catalogue of tools.

use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arguments::whole;
use super::arrays::rows;
use mge_env::{self as env, TOOL_PROPERTIES};
use mge_physics::{NO_OP, ToolKind, ToolSplit, catalogue_tool};

/// Numbers of the tools in a split of the catalogue, without the no-op; int64.
#[pyfunction]
#[pyo3(signature = (split = "all"))]
pub fn tool_numbers<'py>(py: Python<'py>, split: &str) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let split: ToolSplit = split.parse().map_err(PyValueError::new_err)?;
    Ok(PyArray1::from_iter(py, split.tools().into_iter().map(|number| number as i64)))
}

/// Features of tools, one row per number: one-hot of the type, then properties; float32.
#[pyfunction]
pub fn tool_features<'py>(py: Python<'py>, numbers: Vec<Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let number = |number: &Bound<'py, PyAny>| whole(number, "number of a tool", 0..=NO_OP as i128);
    let numbers: Vec<usize> = numbers.iter().map(number).collect::<PyResult<_>>()?;
    rows(py, numbers.iter().map(|number| env::tool_features(catalogue_tool(*number))))
}

/// Names of the columns of `tool_features`: tool types, then properties.
#[pyfunction]
pub fn tool_feature_names() -> Vec<&'static str> {
    ToolKind::ALL.map(ToolKind::name).into_iter().chain(TOOL_PROPERTIES).collect()
}
