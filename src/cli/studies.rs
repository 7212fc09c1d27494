//! `mge reproduce` and `mge report`.

use std::path::PathBuf;

use super::arguments::{Report, Reproduce};
use super::interrupt::in_batch;
use super::output::{self, Outcome};
use super::progress::Progress;
use super::provenance;
use mge_base::atomic::Target;
use mge_base::text::counted;
use mge_experiments::study::{self, Study};
use mge_experiments::sweep::report_measured;

use mge_stats::Bootstrap;

pub fn reproduce(arguments: &Reproduce) -> Outcome {
    let Reproduce { quick, seed, print, .. } = arguments;
    let study = if *quick { Study::quick() } else { Study::full() };
    let command = provenance::command();
    let out = arguments.force.target(&arguments.out);
    in_batch(&arguments.jobs, |batch| study::reproduce(&study, *seed, &out, &command, print.dpi, batch))?;
    Ok(output::line(arguments.out.join("report.md").display())?)
}

pub fn report(arguments: &Report) -> Outcome {
    let command = provenance::command();
    let bootstrap = Bootstrap { resamples: arguments.resamples, seed: arguments.seed, ..Bootstrap::default() };
    let out = arguments.force.target(&arguments.out);
    if let Some(left_out) = report_measured(&arguments.runs, &out, &bootstrap, &command)? {
        if left_out > 0 {
            output::message(format_args!(
                "{left_out} left out: not finished, damaged, or not of the kind of the first"
            ));
        }
        return Ok(output::line(arguments.out.join("report.md").display())?);
    }
    let Report { runs, reference, print, quiet, .. } = arguments;
    report_runs(runs, &out, &bootstrap, reference.as_deref(), print.dpi, *quiet)
}

/// Writes the report of runs, and prints its path.
pub fn report_runs(
    runs: &[PathBuf],
    out: &Target,
    bootstrap: &Bootstrap,
    reference: Option<&str>,
    dpi: u32,
    quiet: bool,
) -> Outcome {
    let mut progress = Progress::new(1, quiet);
    let on_progress = &mut |read: usize, all: usize| {
        let message = if read < all { "runs read" } else { "runs read; statistics and figures" };
        progress.set(read as u64, all as u64, message);
    };
    let report = mge_results::report(runs, out, bootstrap, reference, &provenance::command(), dpi, on_progress)?;
    drop(progress);
    if !report.left_out.is_empty() {
        output::message(format_args!("{} left out: the report has the reasons", counted(report.left_out.len(), "run")));
    }
    Ok(output::line(out.path.join("report.md").display())?)
}
