//! Arrays of NumPy.

use numpy::ndarray::Dimension;
use numpy::{Element, IntoPyArray, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// A zeroed array.
pub fn zeros<T: Element>(py: Python<'_>, count: usize) -> Py<PyArray1<T>> {
    PyArray1::zeros(py, count, false).unbind()
}

/// Writes the values of an array, row by row.
pub fn fill<T: Element, D: Dimension>(
    py: Python<'_>,
    array: &Py<PyArray<T, D>>,
    values: impl Iterator<Item = T>,
) -> PyResult<()> {
    let mut array = array.bind(py).try_readwrite()?;
    array.as_slice_mut()?.iter_mut().zip(values).for_each(|(slot, value)| *slot = value);
    Ok(())
}

/// Rows of numbers as an array.
pub fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: impl Iterator<Item = [T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let rows: Vec<[T; N]> = rows.collect();
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, N])
}
