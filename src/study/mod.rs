//! The paper's study: exploration counts, audits, ablations, trainings and their report.
//!
//! [`reproduce()`] does the whole study of the paper into one folder. Every piece of it
//! (a model, a count, a training) is a file or run of its own, so that a study that was
//! interrupted continues, and one that is finished is only reported again.

pub mod ablation;
pub mod audit;
mod error;
mod figures;
mod folder;
pub mod hits;
mod plan;
mod report;
mod reproduce;
#[cfg(test)]
mod tests;

pub use error::StudyError;
pub use figures::model_error_figure;
pub use plan::StudyPlan;
pub use reproduce::reproduce;
