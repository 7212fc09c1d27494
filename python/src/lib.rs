//! `mge._mge`: the library as an extension module of Python.

use pyo3::prelude::*;

#[pymodule]
fn _mge(module: &Bound<'_, PyModule>) -> PyResult<()> {
    mge::python::register(module)
}
