//! The extension module `mge._mge` of the Python package in `python/`: the library's functions
//! with arguments and arrays of Python. What the package can do is decided and computed
//! elsewhere in this library; here values change their shape.

use pyo3::prelude::*;

/// Contents of the module.
pub mod module {
    use super::*;

    /// Version of the library.
    #[pyfunction]
    pub fn version() -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}
