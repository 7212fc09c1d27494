//! Plans of a sweep for many machines: one command per job, for GNU parallel or Slurm.

use std::path::Path;

use serde_json::Value;

use super::expand::{Job, Sweep};
use crate::error::{ExperimentError, Result};

/// Maximum number of tasks of a Slurm array: with the default `MaxArraySize`, indices reach 1000.
const MAX_TASKS: usize = 1000;
/// The script of a job array.
const SCRIPT: &str = include_str!("slurm.sh");

/// One command per job and line. The commands are self-contained (they need no sweep file), and running one
/// again does only the missing work. `program` and `folder` should be absolute.
///
/// # Errors
/// When one of the two paths cannot be part of a line of text.
pub fn plan(sweep: &Sweep, program: &Path, folder: &Path) -> Result<String> {
    commands(sweep.jobs.iter().map(|job| job.alone.to_string()), program, folder)
}

/// One command line for each of these sweeps.
fn commands(sweeps: impl Iterator<Item = String>, program: &Path, folder: &Path) -> Result<String> {
    for path in [program, folder] {
        if path.to_str().is_none_or(|path| path.contains(['\n', '\r'])) {
            return Err(ExperimentError::Refused(format!(
                "{path:?} has a line break or is not UTF-8, and a plan is text with one command per line: choose another \
                 folder with --out"
            )));
        }
    }
    let mut text = String::new();
    for sweep in sweeps {
        let (program, folder) = (program.display().to_string(), folder.display().to_string());
        text += &(shell_words::join([&*program, "sweep", "--one", &sweep, "--out", &folder, "--quiet"]) + "\n");
    }
    Ok(text)
}

/// A Slurm job-array script with one task per job. If there are more jobs than an array may have tasks, each
/// task runs the same minimum number of consecutive jobs. `name` is the name of the array. Before its time limit, a task
/// is asked to save its work, and requeued.
///
/// # Errors
/// As [`plan`].
pub fn slurm(sweep: &Sweep, program: &Path, folder: &Path, name: &str) -> Result<String> {
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let together = sweep.jobs.len().div_ceil(MAX_TASKS).max(1);
    let tasks: Vec<String> = sweep
        .jobs
        .chunks(together)
        .map(|jobs| match jobs {
            [job] => job.alone.to_string(),
            jobs => Value::Array(jobs.iter().map(|job| job.alone.clone()).collect()).to_string(),
        })
        .collect();
    let last = tasks.len().saturating_sub(1).to_string();
    let plan = commands(tasks.into_iter(), program, folder)?;
    // The plan comes last: it may have any text.
    let values = [("@COUNT@", sweep.jobs.len().to_string()), ("@NAME@", name), ("@LAST@", last), ("@PLAN@", plan)];
    Ok(values.iter().fold(SCRIPT.to_owned(), |script, (place, value)| script.replace(place, value)))
}

/// The command that reproduces a job's model, for the provenance in the model file.
pub(super) fn provenance(job: &Job) -> String {
    shell_words::join(["mge", "sweep", "--one", &job.alone.to_string(), "--out", "sweep"])
}
