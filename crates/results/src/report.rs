//! The report of a set of runs: Markdown, JSON and figures in a folder.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::comparison::{Comparison, ExcludedRun, left_out, result_label, without_duplicates};
use super::error::ResultsError;
use super::figures::{ALL_TASKS, learning_curves, method_scores};
use super::found::{FoundRun, ReadRuns, RunReader, find_runs};
use super::groups::Groups;
use super::report_folder::ReportFolder;
use super::row::TrainedRun;
use mge_base::atomic::Target;
use mge_base::markdown;
use mge_figures::{Against, Figure, LearningCurves, Provenance, Statistics, Success, check_all, text_of};
use mge_run::{RunError, RunState, config_hash};
use mge_stats::{Bootstrap, StatsError};

/// Maximum number of methods of which `report.md` compares all pairs; more are compared with the baseline only.
const MAX_PAIRED: usize = 6;

/// Number of tasks above which a figure shows all of them together instead of each.
const MAX_PANELS: usize = 12;

/// The figures, with their captions.
const FIGURES: [(&str, &str); 4] = [
    ("methods", "Area under the curve by method and task"),
    ("learning", "Rolling success during training"),
    ("learning-charged", "Rolling success against charged actions"),
    ("learning-greedy", "Success of the greedy policy"),
];

/// Writes `report.md`, `report.json` and figures (at `dpi` dots per inch) of all runs in `folders` to
/// `out`, in place of an earlier report. Methods are compared with that labelled `reference`, or else with the usual
/// baseline. `command` reproduces them. `on_progress` is called with the numbers of runs read and of all runs.
///
/// # Errors
/// When no run is finished or has the label, or a file cannot be written or is of another origin.
pub fn report(
    folders: &[PathBuf],
    out: impl Into<Target>,
    bootstrap: &Bootstrap,
    reference: Option<&str>,
    command: &str,
    dpi: u32,
    on_progress: &mut dyn FnMut(usize, usize),
) -> Result<Comparison, ResultsError> {
    let out = out.into();
    // Files of another origin are found before the runs are read.
    let folder = ReportFolder::new(out.clone())?;
    check_all(&out.join("figures"), &FIGURES.map(|(name, _)| name))?;
    let paths = find_runs(folders)?;
    let found = RunReader::default().read(&paths, &mut |read| on_progress(read, paths.len()));
    let ReadRuns { runs: found, unreadable } = found;
    let (finished, others): (Vec<FoundRun>, Vec<FoundRun>) =
        found.into_iter().partition(|run| run.state == RunState::Finished);
    if finished.is_empty() {
        return Err(match unreadable.into_iter().next() {
            Some((_, error)) => error.into(),
            None => ResultsError::NothingFinished { runs: others.len() },
        });
    }
    let (finished, copies) = without_duplicates(finished);
    let configs: Vec<_> = finished.iter().map(|run| &run.config).collect();
    let hash = config_hash(&configs);
    let mut runs: Vec<TrainedRun> = finished.into_iter().map(|run| run.trained).collect();
    let damaged = |(run, error): (PathBuf, RunError)| ExcludedRun { run, reason: error.to_string() };
    let left_out = others.iter().map(left_out).chain(copies).chain(unreadable.into_iter().map(damaged)).collect();
    let rows = runs.iter().map(|run| run.row.clone()).collect();
    let report = Comparison::new(rows, left_out, bootstrap, command, reference)?;
    // Reports that are written at the same time into one folder do not mix.
    let (_alone, figures) = (folder.hold()?, folder.figures()?);
    let provenance = Provenance::new(command, &report.seeds(), hash);
    let draw = |name: &str, figure: &dyn Figure| figure.write_all(&figures, name, &provenance, dpi);
    let groups = Groups::new(&report.learning);
    let is_pooled = groups.tasks.len() > MAX_PANELS;
    if is_pooled {
        runs.iter_mut().for_each(|run| run.row.task = ALL_TASKS.to_owned());
    }
    let mut methods = method_scores(&report.learning, bootstrap, Some(&report.reference))?;
    if is_pooled && report.common_tasks.len() > 1 {
        methods.panels.drain(..groups.tasks.len());
    }
    let curves = |success, against| {
        let curves = learning_curves(&runs, bootstrap, success, against, None)?;
        Ok::<_, ResultsError>(match is_pooled {
            true => LearningCurves { statistics: over_tasks(&groups), ..curves },
            false => LearningCurves { legend: groups.legend(), ..curves },
        })
    };
    draw("methods", &methods)?;
    draw("learning", &curves(Success::Training, Against::Episodes)?)?;
    draw("learning-charged", &curves(Success::Training, Against::Charged)?)?;
    if runs.iter().any(|run| !run.greedy.is_empty()) {
        draw("learning-greedy", &curves(Success::Greedy, Against::Episodes)?)?;
    }
    folder.write(&report, &report.to_markdown()?)?;
    Ok(report)
}

/// The statistics of curves of the runs on all tasks together.
fn over_tasks(groups: &Groups<'_>) -> Statistics {
    Statistics {
        centre: format!("Interquartile mean of runs on {} tasks, each", groups.tasks.len()),
        interval: "95 % bootstrap interval over runs".to_owned(),
        seeds: groups.sizes().max().unwrap_or(0),
        fewest_seeds: groups.sizes().min(),
    }
}

impl Comparison {
    /// The report as Markdown.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn to_markdown(&self) -> Result<String, StatsError> {
        let Bootstrap { resamples, confidence, seed } = self.bootstrap;
        let seeds = self.seeds().iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
        let mut text = String::from("# Runs compared\n\n");
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}, from {} finished runs with the seeds {seeds}. Intervals in brackets are {:.0} % percentile bootstrap intervals over seeds, resampled within each task ({resamples} resamples, seed {seed}). Where each task has one run, a task has no interval, and that over all tasks is over tasks.\n",
            markdown::made_by(&self.command, &self.mge_version),
            self.learning.len(),
            100.0 * confidence,
        );
        self.write_left_out(&mut text);
        self.write_names(&mut text);
        text.push_str("## Sample efficiency\n\n");
        self.write_tables(&mut text)?;
        self.write_figures(&mut text);
        Ok(text)
    }

    /// Writes the tables of the methods on every task, over the common tasks, and against each other.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn write_tables(&self, text: &mut String) -> Result<(), StatsError> {
        Groups::new(&self.learning).write_table(text, &self.reference, &self.bootstrap)?;
        self.write_aggregates(text);
        self.write_improvements(text);
        Ok(())
    }

    fn write_left_out(&self, text: &mut String) {
        if self.left_out.is_empty() {
            return;
        }
        let _ = writeln!(text, "Left out (unfinished runs, duplicates, damaged runs):\n");
        for ExcludedRun { run, reason } in &self.left_out {
            let _ = writeln!(text, "- {}: {}", markdown::code(&run.display().to_string()), markdown::text(reason));
        }
        text.push('\n');
    }

    /// Writes the names that users gave to runs.
    fn write_names(&self, text: &mut String) {
        let mut named = self.learning.iter().filter(|row| !row.name.is_empty()).peekable();
        if named.peek().is_some() {
            text.push_str("Runs with names:\n\n");
            for row in named {
                let what = format!("{}, seed {}, on {}", row.label(), row.seed, row.task);
                let _ = writeln!(text, "- {}: {}", markdown::text(&row.name), markdown::text(&what));
            }
            text.push('\n');
        }
    }

    fn write_aggregates(&self, text: &mut String) {
        if self.common_tasks.is_empty() {
            text.push_str("### Over all tasks\n\nNo task has runs of every method: nothing can be aggregated.\n\n");
            return;
        }
        let _ = writeln!(
            text,
            "### Over all tasks\n\nOver {}. The optimality gap is how far the mean falls short of 1.\n",
            markdown::text(&self.common_tasks.join(", "))
        );
        let legend = Groups::new(&self.learning).legend();
        *text += &markdown::header(["measure", "method", "runs", "IQM", "mean", "median", "optimality gap"]);
        for row in &self.aggregates {
            let label = result_label(&row.measure).to_owned();
            let shares = [row.iqm, row.mean, row.median, row.optimality_gap].map(|share| share.text(2));
            *text += &markdown::row(
                [label, text_of(&legend, &row.method).to_owned(), row.runs.to_string()].into_iter().chain(shares),
            );
        }
        text.push('\n');
    }

    fn write_improvements(&self, text: &mut String) {
        if self.improvements.is_empty() {
            return;
        }
        text.push_str("### Probability of improvement\n\nHow likely a run of the method has a larger area under the curve over charged actions than a run of the other on the same task, mean over the tasks; 0.5 is no difference.");
        let legend = Groups::new(&self.learning).legend();
        let baseline = Some(&self.reference).filter(|_| legend.len() > MAX_PAIRED);
        if let Some(baseline) = baseline {
            let _ =
                write!(text, " Over {}; all pairs are in `report.json`.", markdown::text(text_of(&legend, baseline)));
        }
        *text += "\n\n";
        *text += &markdown::header(["method", "over", "probability"]);
        for row in self.improvements.iter().filter(|row| baseline.is_none_or(|baseline| row.over == *baseline)) {
            let [method, over] = [&row.method, &row.over].map(|label| text_of(&legend, label));
            *text += &markdown::row([method, over, &row.probability.text(2)]);
        }
        text.push('\n');
    }

    fn write_figures(&self, text: &mut String) {
        let greedy = self.learning.iter().any(|row| row.greedy_success.is_some());
        text.push_str("## Figures\n\n");
        for (file, caption) in FIGURES.iter().filter(|(name, _)| greedy || *name != "learning-greedy") {
            let _ = writeln!(text, "![{caption}](figures/{file}.png)\n\n*{caption}*\n");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_run::{EpisodeRecord, Event, RunDirectory, RunWriter};
    use mge_task::Task;
    use mge_trainer::{Method, RunConfig};

    #[test]
    fn figures_of_many_tasks_show_them_together() {
        let folder = tempfile::tempdir().unwrap();
        let task = mge_task::load("task1").unwrap();
        for number in 0..=MAX_PANELS as u64 {
            let task = Task { name: format!("puzzle{number}"), ..task.clone() };
            // The second method was not trained on the first task.
            for method in [Method::Ddpg, Method::DdpgAdaptive].into_iter().take(if number == 0 { 1 } else { 2 }) {
                let config = RunConfig { episodes: 1, ..RunConfig::default_for(Arc::new(task.clone()), method) };
                let name = format!("{number}-{method}");
                let directory = RunDirectory::create(folder.path().join(name), &config).unwrap();
                let mut writer = RunWriter::open(&directory, 0).unwrap();
                let goal = number > 0;
                let rolling_success = f64::from(u8::from(goal));
                let record = EpisodeRecord { episode: 1, goal, rolling_success, ..EpisodeRecord::default() };
                writer.record(&Event::EpisodeFinished(record)).unwrap();
                writer.record(&Event::Finished { episode: 1 }).unwrap();
            }
        }
        let (runs, out) = ([folder.path().to_owned()], folder.path().join("report"));
        let bootstrap = Bootstrap { resamples: 10, ..Bootstrap::default() };
        let report = report(&runs, &*out, &bootstrap, None, "test", 72, &mut |_, _| {}).unwrap();
        assert_eq!(report.common_tasks.len(), MAX_PANELS);
        for (figure, row) in [("learning", "All tasks,DDPG,1,1,"), ("methods", "Common tasks,DDPG,summary,1,")] {
            let csv = std::fs::read_to_string(out.join(format!("figures/{figure}.csv"))).unwrap();
            assert!(csv.contains(row) && !csv.contains("puzzle"), "the interquartile mean of all runs: {csv}");
        }
        let statistics = over_tasks(&Groups::new(&report.learning));
        assert_eq!((statistics.seeds, statistics.fewest_seeds), (1, Some(1)), "of each task");
    }
}
