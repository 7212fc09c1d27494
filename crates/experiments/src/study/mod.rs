//! The paper's study: hit counts, audits, ablations, trainings and their report.
//!
//! [`reproduce()`] runs the whole study, the paper's and that from noisy starts, in one folder. Every piece of it
//! (a model, a count, a training) is a separate file or run, so that an interrupted study continues, and for a
//! finished one only the report is written again.

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
