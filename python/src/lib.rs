//! The extension module `mge._mge`: the library's functions with Python arguments and arrays.
//! All logic is in the library; this crate only converts values.

// Functions called from Python take arguments by value and return tuples.
#![allow(clippy::needless_pass_by_value, clippy::type_complexity)]

mod arrays;
mod error;
mod facts;
mod figures;
mod model;
mod pool;
mod prior;
mod runs;
mod state;
mod task;
mod tools;
mod vector;

use pyo3::prelude::*;

#[pymodule]
fn _mge(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<task::Task>()?;
    module.add_class::<vector::VectorCore>()?;
    module.add_class::<state::State>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<prior::ActionPrior>()?;
    module.add_class::<prior::Actor>()?;
    module.add_class::<figures::Figure>()?;
    module.add_function(wrap_pyfunction!(task::task_names, module)?)?;
    module.add_function(wrap_pyfunction!(task::level_names, module)?)?;
    module.add_function(wrap_pyfunction!(tools::tool_numbers, module)?)?;
    module.add_function(wrap_pyfunction!(tools::tool_features, module)?)?;
    module.add_function(wrap_pyfunction!(tools::tool_feature_names, module)?)?;
    module.add_function(wrap_pyfunction!(facts::words, module)?)?;
    module.add_function(wrap_pyfunction!(model::rollout, module)?)?;
    module.add_function(wrap_pyfunction!(model::model_names, module)?)?;
    module.add_function(wrap_pyfunction!(model::tool_types, module)?)?;
    module.add_function(wrap_pyfunction!(prior::build_prior, module)?)?;
    module.add_function(wrap_pyfunction!(runs::read_run, module)?)?;
    module.add_function(wrap_pyfunction!(runs::read_results, module)?)?;
    module.add_function(wrap_pyfunction!(runs::write_report, module)?)?;
    module.add_function(wrap_pyfunction!(figures::figure_tasks, module)?)?;
    module.add_function(wrap_pyfunction!(figures::figure_learning, module)?)?;
    module.add_function(wrap_pyfunction!(figures::figure_methods, module)?)?;
    module.add_function(wrap_pyfunction!(prior::figure_clusters, module)?)
}
