//! `mge sweep`: many runs from one file.

use std::path::{Path, PathBuf};

use super::arguments::{Jobs, Sweep as Arguments};
use super::interrupt::{brief, in_batch};
use super::output::{self, Outcome};
use mge_base::atomic::Target;
use mge_base::text::counted;
use mge_experiments::ExperimentError;
use mge_experiments::sweep::{self, Sweep};
use mge_run::RunError;

pub fn run(arguments: &Arguments) -> Outcome {
    let sweep = match (&arguments.file, &arguments.one) {
        (Some(file), _) => Sweep::load(file)?,
        (None, Some(text)) => Sweep::parse(text.as_bytes(), "--one")?,
        (None, None) => return Err("name a sweep file".into()),
    };
    // A line of a plan is one of its runs, about which the plan has told.
    if arguments.file.is_some() {
        warn(&sweep);
    }
    let folder = folder(arguments);
    if arguments.plan || arguments.slurm {
        let (program, folder) = (std::env::current_exe()?, std::path::absolute(&folder)?);
        sweep::check(&sweep, &folder)?;
        let name = stem(arguments);
        let text = match arguments.plan {
            true => sweep::plan(&sweep, &program, &folder)?,
            false => sweep::slurm(&sweep, &program, &folder, &name)?,
        };
        let (jobs, (finished, begun)) = (sweep.jobs.len(), sweep::progress(&sweep, &folder)?);
        let new = jobs - finished - begun;
        if !arguments.jobs.quiet {
            output::message(format_args!("{}: {finished} finished, {begun} begun, {new} new", counted(jobs, "job")));
        }
        return Ok(output::lines(text)?);
    }
    let to = arguments.force.target(&folder);
    if arguments.file.is_some() {
        sweep::check_results(&to)?;
    }
    let failures = work(&sweep, &folder, &arguments.jobs)?;
    if arguments.file.is_some() {
        brief(|| write_results(&to, &failures))?;
    } else {
        for job in &sweep.jobs {
            output::line(job.folder(&folder).display())?;
        }
    }
    failure(&sweep, &failures)
}

/// Jobs that failed: their names and the reasons.
type Failures = [(String, String)];

/// Writes the table of a sweep's results, and prints its path.
pub fn write_results(to: &Target, failures: &Failures) -> Outcome {
    match sweep::write_results(to) {
        Ok(path) => Ok(output::line(path.display())?),
        // The failures are reported in the end, those of damaged runs among them.
        Err(ExperimentError::Run(RunError::NoRuns(_) | RunError::Malformed { .. })) if !failures.is_empty() => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// The failures of a sweep as one error, if there are any.
pub fn failure(sweep: &Sweep, failures: &Failures) -> Outcome {
    let Some((name, reason)) = failures.first() else { return Ok(()) };
    let (failed, all) = (failures.len(), sweep.jobs.len());
    Err(format!("{failed} of {all} not finished, such as {name}: {reason}").into())
}

/// Shows the warnings about the trainings of a sweep.
pub fn warn(sweep: &Sweep) {
    output::warnings(sweep.warnings());
}

/// Runs a sweep with a progress display. Returns the failures: names and reasons.
pub fn work(sweep: &Sweep, folder: &Path, jobs: &Jobs) -> Outcome<Vec<(String, String)>> {
    in_batch(jobs, |batch, on_progress| sweep::run(sweep, folder, batch, on_progress))
}

fn folder(arguments: &Arguments) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| Path::new("sweeps").join(stem(arguments)))
}

/// The name of the sweep file without its extension.
fn stem(arguments: &Arguments) -> String {
    let stem = arguments.file.as_deref().and_then(Path::file_stem);
    stem.map_or_else(|| "sweep".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
