//! `mge._mge`: the library as an extension module of Python.

#[pyo3::pymodule]
mod _mge {
    #[pymodule_export]
    use mge::python::module::version;
}
