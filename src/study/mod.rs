//! Many runs: exploration counts, audits, the reproduction of the paper, reports.
//!
//! [`reproduce()`] does the whole study of the paper into one folder. Every piece of it
//! (a model, a count, a training) is a file or run of its own, so that a study that was
//! interrupted goes on where it was, and one that is finished is only reported again.

pub mod ablation;
pub mod audit;
mod batch;
mod comparison;
mod figures;
mod folder;
mod found;
pub mod hits;
mod learning;
mod plan;
mod report;
mod reproduce;

pub use batch::train_to_end;
pub use comparison::compare;
pub use figures::model_error_figure;
pub use found::{FoundRun, find_runs, read_runs};
pub use plan::StudyPlan;
pub use report::mean_errors;
pub use reproduce::{StudyProgress, reproduce};
