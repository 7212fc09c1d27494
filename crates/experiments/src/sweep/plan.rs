//! Plans of a sweep for many machines: one command per job, for GNU parallel or Slurm.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;
use signal_hook::consts::SIGUSR1;

use super::expand::{Job, Sweep};
use crate::error::ExperimentError;

/// Maximum number of tasks of a Slurm array: with the default `MaxArraySize`, indices reach 1000.
const MAX_TASKS: usize = 1000;
/// Seconds before the time limit at which a task is told to save its work.
const WARNING_SECONDS: u32 = 120;

/// One command per job and line. The commands are self-contained (they need no sweep file), and running one
/// again does only the missing work. `program` and `folder` should be absolute.
///
/// # Errors
/// [`ExperimentError::NoLine`] if one of the two paths cannot be part of a line of text.
pub fn plan(sweep: &Sweep, program: &Path, folder: &Path) -> Result<String, ExperimentError> {
    commands(sweep.jobs.iter().map(|job| job.alone.to_string()), program, folder)
}

/// One command line for each of these sweeps.
fn commands(sweeps: impl Iterator<Item = String>, program: &Path, folder: &Path) -> Result<String, ExperimentError> {
    for path in [program, folder] {
        if path.to_str().is_none_or(|path| path.contains(['\n', '\r'])) {
            return Err(ExperimentError::NoLine(path.to_owned()));
        }
    }
    let mut text = String::new();
    for sweep in sweeps {
        let words = [
            program.display().to_string(),
            "sweep".to_owned(),
            "--one".to_owned(),
            sweep,
            "--out".to_owned(),
            folder.display().to_string(),
            "--quiet".to_owned(),
        ];
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", shell_words::join(words));
    }
    Ok(text)
}

/// A Slurm job-array script with one task per job. If there are more jobs than an array may have tasks, each
/// task runs the same minimum number of consecutive jobs. `name` is the name of the array. Before its time limit, a task
/// is asked to save its work, and requeued.
///
/// # Errors
/// As [`plan`].
pub fn slurm(sweep: &Sweep, program: &Path, folder: &Path, name: &str) -> Result<String, ExperimentError> {
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
    Ok(format!(
        "#!/usr/bin/env bash\n\
         # {count} independent jobs; submit with: sbatch THIS_FILE\n\
         # Before its time limit, a job saves its work and is put into the queue again, where it continues. Others that were\n\
         # interrupted continue when the script is submitted again.\n\
         #SBATCH --job-name=mge-{name}\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --output=mge-{name}-%A_%a.log\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --requeue\n\
         #SBATCH --signal=B:USR1@{warning}\n\
         set -euo pipefail\n\
         command=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" <<'END_OF_PLAN'\n\
         {plan}END_OF_PLAN\n\
         )\n\
         eval \"$command --threads 1 &\"\n\
         program=$!\n\
         # A signal that the shell passes on ends its wait: it waits until none does.\n\
         pass() {{ passed=yes; kill -s \"$1\" \"$program\" || true; }}\n\
         trap 'pass USR1' USR1\n\
         trap 'pass TERM' TERM\n\
         passed=yes\n\
         while [ \"$passed\" ]; do passed='' status=0; wait \"$program\" || status=$?; done\n\
         # Ended by SIGUSR1, with its work saved.\n\
         [ \"$status\" != {warned} ] || scontrol requeue \"$SLURM_JOB_ID\"\n\
         exit \"$status\"\n",
        count = sweep.jobs.len(),
        last = tasks.len().saturating_sub(1),
        warning = WARNING_SECONDS,
        warned = 128 + SIGUSR1,
        plan = commands(tasks.into_iter(), program, folder)?,
    ))
}

/// The command that reproduces a job's model, for the provenance in the model file.
pub(super) fn provenance(job: &Job) -> String {
    shell_words::join(["mge", "sweep", "--one", &job.alone.to_string(), "--out", "sweep"])
}
