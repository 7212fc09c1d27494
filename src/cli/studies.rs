//! `mge reproduce` and `mge report`.

use super::arguments::{Report, Reproduce};
use super::interrupt::in_batch;
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_base::text::counted;
use mge_experiments::study::{self, StudyError, StudyPlan};
use mge_results as evidence;
use mge_stats::Bootstrap;

pub fn reproduce(arguments: &Reproduce) -> Outcome {
    let mut plan = if arguments.quick { StudyPlan::quick(arguments.seed) } else { StudyPlan::full(arguments.seed) };
    let mut command = "mge reproduce".to_owned();
    if arguments.quick {
        command += " --quick";
    }
    if arguments.questions {
        plan = plan.with_questions();
        command += " --questions";
    }
    command += &format!(" --seed {}{}", arguments.seed, arguments.print.option());
    let out = arguments.force.target(&arguments.out);
    in_batch(
        arguments.threads,
        arguments.quiet,
        |batch, on_progress| study::reproduce(&plan, &out, &command, arguments.print.dpi, batch, on_progress),
        StudyError::is_interruption,
    )?;
    Ok(output::line(arguments.out.join("report.md").display())?)
}

pub fn report(arguments: &Report) -> Outcome {
    let words = ["mge", "report"].map(str::to_owned).into_iter();
    let folders = arguments.runs.iter().map(|folder| folder.display().to_string());
    let mut command = shell_words::join(words.chain(folders));
    let bootstrap = Bootstrap { resamples: arguments.resamples, seed: arguments.seed, ..Bootstrap::default() };
    if bootstrap != Bootstrap::default() {
        command += &format!(" --resamples {} --seed {}", bootstrap.resamples, bootstrap.seed);
    }
    if let Some(label) = &arguments.reference {
        command += &format!(" --reference {}", shell_words::quote(label));
    }
    command += &arguments.print.option();
    let mut progress = Progress::new(1, arguments.quiet);
    let on_progress = &mut |read: usize, all: usize| {
        let message = if read < all { "runs read" } else { "runs read; statistics and figures" };
        progress.set(read as u64, all as u64, message);
    };
    let Report { runs, reference, print, .. } = arguments;
    let out = arguments.force.target(&arguments.out);
    let report = evidence::report(runs, out, &bootstrap, reference.as_deref(), &command, print.dpi, on_progress)?;
    drop(progress);
    if !report.left_out.is_empty() {
        output::message(format_args!("{} left out: the report has the reasons", counted(report.left_out.len(), "run")));
    }
    Ok(output::line(arguments.out.join("report.md").display())?)
}
