//! Results of runs: finds runs on disk, groups them by their settings, compares and reports them.
//!
//! - [`find_runs`], [`read_runs`]: runs in folders, with their training results;
//! - [`LearningRow`]: the results of one run; [`distinguish`] gives each row the settings in which its
//!   run differs from the others, so that runs with the same label differ only in the seed;
//! - [`Groups`]: rows by task and label, with the scores, intervals and probability of improvement of
//!   each group, also for runs that are still being trained;
//! - [`Comparison`]: every group on every task, and over the tasks they have in common;
//! - [`report()`]: the comparison as Markdown, HTML, JSON and figures in a folder.
//!
//! ```
//! use mge_results::{Groups, LearningRow};
//!
//! let row = |seed| LearningRow { task: "task1".into(), method: "ddpg".into(), seed, ..LearningRow::default() };
//! let rows = [row(0), row(1)];
//! let groups = Groups::new(&rows);
//! assert_eq!(groups.of("task1", &groups.labels[0]).len(), 2);
//! ```

#![deny(unsafe_code)]

mod comparison;
mod composition;
mod curve;
mod error;
pub mod figures;
mod found;
mod groups;
mod interventions;
mod page;
mod report;
mod report_folder;
mod row;
mod settings;
mod table;

pub use comparison::{Comparison, result_label};
pub use composition::{Composed, Composition, OPTIONS};
pub use error::ResultsError;
pub use found::{FoundRun, RunReader, find_runs, is_listed_run, read_runs};
pub use groups::{AREA, CHARGED_AREA, FINAL, Groups, Score, common_name};
pub use interventions::interventions;
pub use report::report;
pub use report_folder::ReportFolder;
pub use row::{LearningRow, TrainedRun};
pub use settings::{Settings, complete, differences, distinguish, leaf_settings, short_label};
