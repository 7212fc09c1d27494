//! `mge sweep`: many runs from one file.

use std::path::{Path, PathBuf};

use super::arguments::{Jobs, Sweep as Arguments};
use super::interrupt::in_batch;
use super::output::{self, Outcome};
use mge_base::text::counted;
use mge_experiments::sweep::{self, Sweep};

pub fn run(arguments: &Arguments) -> Outcome {
    let sweep = match (&arguments.file, &arguments.one) {
        (Some(file), _) => Sweep::load(file)?,
        (None, Some(text)) => Sweep::parse(text.as_bytes(), "--one")?,
        (None, None) => return Err("name a sweep file".into()),
    };
    // A line of a plan is one of its runs, about which the plan has told.
    if arguments.file.is_some() {
        output::warnings(sweep.warnings());
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
        if !arguments.jobs.quiet {
            output::message(counted(sweep.jobs.len(), "job"));
        }
        return Ok(output::lines(text)?);
    }
    let to = arguments.force.target(&folder);
    if arguments.file.is_some() {
        sweep::check_results(&to)?;
    }
    let failures = work(&sweep, &folder, &arguments.jobs)?;
    let written = arguments.file.is_some().then(|| sweep::write_results(&to));
    sweep::no_failure(&sweep, &failures)?;
    match written {
        Some(written) => output::line(written?.display())?,
        None => sweep.jobs.iter().try_for_each(|job| output::line(job.folder(&folder).display()))?,
    }
    Ok(())
}

/// Runs a sweep with a progress display. Returns the failures: names and reasons.
pub fn work(sweep: &Sweep, folder: &Path, jobs: &Jobs) -> Outcome<Vec<(String, String)>> {
    in_batch(jobs, |batch| sweep::run(sweep, folder, batch))
}

fn folder(arguments: &Arguments) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| Path::new("sweeps").join(stem(arguments)))
}

/// The name of the sweep file without its extension.
fn stem(arguments: &Arguments) -> String {
    let stem = arguments.file.as_deref().and_then(Path::file_stem);
    stem.map_or_else(|| "sweep".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
