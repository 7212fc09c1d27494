//! The extension module `mge._mge`: the library's functions with Python arguments and arrays.
//! All logic is in the library; this crate only converts values.

// Functions called from Python take arguments by value and return tuples.
#![allow(clippy::needless_pass_by_value, clippy::type_complexity)]

mod arguments;
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
mod training;
mod vector;

/// The extension module.
#[pyo3::pymodule]
mod _mge {
    #[pymodule_export]
    use super::{
        arguments::checked,
        facts::words,
        figures::{Figure, figure_learning, figure_methods, figure_tasks},
        model::{Model, model_names, rollout, tool_types},
        prior::{ActionPrior, Actor, build_prior, figure_clusters},
        runs::{read_results, read_run, write_report},
        state::State,
        task::{Task, level_names, task_names},
        tools::{tool_feature_names, tool_features, tool_numbers},
        training::{resume, train},
        vector::VectorCore,
    };
    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "the name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
