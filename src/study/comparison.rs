//! A report of any runs: which method is better, by how much, how surely.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::figures::{learning_curves, method_scores, performance_profile};
use super::found::{FoundRun, find_runs, read_runs};
use super::learning::{AREA, FINAL, Learning, LearningRow, Score, TrainedRun, format_share};
use super::reproduce::StudyError;
use crate::figures::{Figure, Provenance};
use crate::run::{RunState, config_hash};
use crate::stats::aggregate::{iqm, mean, median, optimality_gap};
use crate::stats::{Bootstrap, Estimate, StatsError, TaskScores, comparison};

/// What runs came to, and how their methods compare.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Format version.
    pub version: u32,
    /// The command that makes the report again.
    pub command: String,
    /// Version of the program that made it.
    pub mge_version: String,
    /// How intervals were computed.
    pub bootstrap: Bootstrap,
    /// Every finished run.
    pub learning: Vec<LearningRow>,
    /// Runs that are not finished, and so left out.
    pub left_out: Vec<LeftOut>,
    /// Tasks on which every method was trained: over these the methods are aggregated.
    pub common_tasks: Vec<String>,
    /// Each method's scores over the common tasks.
    pub aggregates: Vec<AggregateRow>,
    /// Each pair of methods over the common tasks.
    pub improvements: Vec<ImprovementRow>,
}

/// A run that is left out of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Its folder.
    pub run: PathBuf,
    /// Why.
    pub reason: String,
}

/// One method over several tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AggregateRow {
    /// Its label.
    pub method: String,
    /// What is aggregated: `auc` or `final_success`.
    pub measure: String,
    /// Runs behind the numbers.
    pub runs: usize,
    /// Their scores, for each of the common tasks.
    #[serde(default)]
    pub scores: Vec<Vec<f64>>,
    /// Interquartile mean.
    pub iqm: Estimate,
    /// Mean.
    pub mean: Estimate,
    /// Median.
    pub median: Estimate,
    /// How far the mean falls short of always succeeding.
    pub optimality_gap: Estimate,
}

/// How likely a run of one method beats a run of another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImprovementRow {
    /// Label of the one.
    pub method: String,
    /// Label of the other.
    pub over: String,
    /// What is compared: `auc`.
    pub measure: String,
    /// The probability; a tie counts one half.
    pub probability: Estimate,
}

/// More methods than these are compared with the baseline alone in `report.md`.
const MOST_PAIRED: usize = 5;

/// Writes `report.md`, `report.json` and figures (at `dpi` dots per inch) of all runs in
/// `folders` to `out`. `command` is what makes them again.
///
/// # Errors
/// When there is no finished run, one cannot be read, or a file cannot be written.
pub fn compare(
    folders: &[PathBuf],
    out: &Path,
    bootstrap: &Bootstrap,
    command: &str,
    dpi: u32,
) -> Result<Comparison, StudyError> {
    let found = read_runs(&find_runs(folders)?)?;
    let (finished, others): (Vec<FoundRun>, Vec<FoundRun>) =
        found.into_iter().partition(|run| run.state == RunState::Finished);
    if finished.is_empty() {
        return Err(StudyError::NothingFinished { runs: others.len() });
    }
    let (finished, copies) = without_copies(finished);
    let configs: Vec<_> = finished.iter().map(|run| &run.config).collect();
    let hash = config_hash(&configs)?;
    let runs: Vec<TrainedRun> = finished.into_iter().map(|run| run.trained).collect();
    let left_out = others.iter().map(left_out).chain(copies).collect();
    let report = Comparison::new(&runs, left_out, bootstrap, command)?;
    let figures = out.join("figures");
    std::fs::create_dir_all(&figures).map_err(|source| StudyError::Io { path: figures.clone(), source })?;
    let provenance = Provenance::new(command, &report.seeds(), hash);
    let draw = |name: &str, figure: &dyn Figure| figure.write_all(&figures, name, &provenance, dpi);
    draw("methods", &method_scores(&report.learning, bootstrap)?)?;
    draw("learning", &learning_curves(&runs, bootstrap, false)?)?;
    if runs.iter().any(|run| !run.greedy.is_empty()) {
        draw("learning-greedy", &learning_curves(&runs, bootstrap, true)?)?;
    }
    if !report.common_tasks.is_empty() {
        draw(
            "performance-profile",
            &performance_profile(&Learning(&report.learning).common_scores(FINAL)?, bootstrap)?,
        )?;
    }
    // Plain data always serialises.
    let json = serde_json::to_string_pretty(&report).expect("a report is plain data") + "\n";
    for (name, text) in [("report.json", json), ("report.md", report.to_markdown()?)] {
        let path = out.join(name);
        crate::atomic::write(&path, text.as_bytes()).map_err(|source| StudyError::Io { path, source })?;
    }
    Ok(report)
}

/// The runs without those that repeat another with the same settings and seed: counted twice,
/// they would make an interval too narrow.
fn without_copies(runs: Vec<FoundRun>) -> (Vec<FoundRun>, Vec<LeftOut>) {
    let mut kept: Vec<FoundRun> = Vec::new();
    let mut copies = Vec::new();
    for run in runs {
        match kept.iter().find(|known| known.config == run.config) {
            None => kept.push(run),
            Some(known) => {
                let reason = format!("has the settings and the seed of {}", known.path.display());
                copies.push(LeftOut { run: run.path, reason });
            }
        }
    }
    (kept, copies)
}

fn left_out(run: &FoundRun) -> LeftOut {
    let episodes = format!("{} of {} episodes", run.trained.row.episodes, run.config.episodes);
    let state = match &run.state {
        RunState::Failed(reason) => format!("failed: {reason}"),
        RunState::Stopped(reason) => format!("stopped: {reason}"),
        RunState::NotStarted => "not started".to_owned(),
        RunState::Running | RunState::Paused => "still being trained".to_owned(),
        RunState::Interrupted | RunState::Finished => "interrupted".to_owned(),
    };
    LeftOut { run: run.path.clone(), reason: format!("{state} ({episodes})") }
}

impl Comparison {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    fn new(
        runs: &[TrainedRun],
        left_out: Vec<LeftOut>,
        bootstrap: &Bootstrap,
        command: &str,
    ) -> Result<Self, StatsError> {
        let mut report = Self {
            version: Self::VERSION,
            command: command.to_owned(),
            mge_version: env!("CARGO_PKG_VERSION").to_owned(),
            bootstrap: *bootstrap,
            learning: runs.iter().map(|run| run.row.clone()).collect(),
            left_out,
            common_tasks: Vec::new(),
            aggregates: Vec::new(),
            improvements: Vec::new(),
        };
        report.common_tasks = Learning(&report.learning).common_tasks();
        let labels = Learning(&report.learning).labels();
        if report.common_tasks.is_empty() {
            return Ok(report);
        }
        let mut aggregates = Vec::new();
        for (measure, score) in [("auc", AREA), ("final_success", FINAL)] {
            for label in &labels {
                aggregates.push(aggregate(label, measure, &report.scores(label, score)?, bootstrap)?);
            }
        }
        let mut improvements = Vec::new();
        for method in &labels {
            for over in labels.iter().filter(|over| *over != method) {
                let (x, y) = (report.scores(method, AREA)?, report.scores(over, AREA)?);
                let probability = comparison::improvement_interval(&x, &y, bootstrap)?;
                let (method, over) = (method.clone(), over.clone());
                improvements.push(ImprovementRow { method, over, measure: "auc".to_owned(), probability });
            }
        }
        (report.aggregates, report.improvements) = (aggregates, improvements);
        Ok(report)
    }

    /// Scores of a method on the common tasks.
    fn scores(&self, label: &str, score: Score) -> Result<TaskScores, StatsError> {
        Learning(&self.learning).scores(&self.common_tasks, label, score)
    }

    /// Master seeds of the runs, each once.
    fn seeds(&self) -> Vec<u64> {
        let mut seeds: Vec<u64> = self.learning.iter().map(|row| row.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds
    }

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
            "Made by `{}` with mge {}, from {} finished runs with the seeds {seeds}. Intervals in brackets are {:.0} % percentile bootstrap intervals over seeds, resampled within each task ({resamples} resamples, seed {seed}).\n",
            self.command,
            self.mge_version,
            self.learning.len(),
            100.0 * confidence,
        );
        self.write_left_out(&mut text);
        text.push_str("## Sample efficiency\n\n");
        Learning(&self.learning).write_table(&mut text, &self.bootstrap)?;
        self.write_aggregates(&mut text);
        self.write_improvements(&mut text);
        self.write_figures(&mut text);
        Ok(text)
    }

    fn write_left_out(&self, text: &mut String) {
        if self.left_out.is_empty() {
            return;
        }
        let _ = writeln!(text, "Left out, because they are not finished:\n");
        for LeftOut { run, reason } in &self.left_out {
            let _ = writeln!(text, "- `{}`: {reason}", run.display());
        }
        text.push('\n');
    }

    fn write_aggregates(&self, text: &mut String) {
        if self.common_tasks.is_empty() {
            text.push_str("## Over all tasks\n\nNo task has runs of every method: nothing can be aggregated.\n\n");
            return;
        }
        let _ = writeln!(
            text,
            "## Over all tasks\n\nOver {}, stratified by task. The optimality gap is how far the mean falls short of 1.\n\n| measure | method | runs | IQM | mean | median | optimality gap |\n|---|---|---|---|---|---|---|",
            self.common_tasks.join(", ")
        );
        for row in &self.aggregates {
            let [iqm, mean, median, gap] = [row.iqm, row.mean, row.median, row.optimality_gap].map(format_share);
            let measure = if row.measure == "auc" { "area under the curve" } else { "final success" };
            let _ = writeln!(text, "| {measure} | {} | {} | {iqm} | {mean} | {median} | {gap} |", row.method, row.runs);
        }
        text.push('\n');
    }

    fn write_improvements(&self, text: &mut String) {
        if self.improvements.is_empty() {
            return;
        }
        text.push_str("## Probability of improvement\n\nHow likely a run of the method has a larger area under the curve than a run of the other on the same task, mean over the tasks; 0.5 is no difference.");
        let learning = Learning(&self.learning);
        let baseline = learning.baseline().filter(|_| learning.labels().len() > MOST_PAIRED);
        if let Some(baseline) = &baseline {
            let _ = write!(text, " Over {baseline}; all pairs are in `report.json`.");
        }
        text.push_str("\n\n| method | over | probability |\n|---|---|---|\n");
        for row in self.improvements.iter().filter(|row| baseline.as_ref().is_none_or(|baseline| row.over == *baseline))
        {
            let _ = writeln!(text, "| {} | {} | {} |", row.method, row.over, format_share(row.probability));
        }
        text.push('\n');
    }

    fn write_figures(&self, text: &mut String) {
        let greedy = self.learning.iter().any(|row| row.greedy_success.is_some());
        let figures = [
            ("methods", "Area under the curve by method and task", true),
            ("learning", "Rolling success during training", true),
            ("learning-greedy", "Success of the greedy policy", greedy),
            ("performance-profile", "Performance profile of the final success", !self.common_tasks.is_empty()),
        ];
        text.push_str("## Figures\n\n");
        for (file, caption, _) in figures.iter().filter(|(_, _, drawn)| *drawn) {
            let _ = writeln!(text, "![{caption}](figures/{file}.png)\n\n*{caption}*\n");
        }
    }
}

fn aggregate(
    label: &str,
    measure: &str,
    scores: &TaskScores,
    bootstrap: &Bootstrap,
) -> Result<AggregateRow, StatsError> {
    Ok(AggregateRow {
        method: label.to_owned(),
        measure: measure.to_owned(),
        runs: scores.all().count(),
        scores: scores.tasks().to_vec(),
        iqm: bootstrap.stratified(scores, iqm)?,
        mean: bootstrap.stratified(scores, mean)?,
        median: bootstrap.stratified(scores, median)?,
        optimality_gap: bootstrap.stratified(scores, |scores| optimality_gap(scores, 1.0))?,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::run::RunDirectory;
    use crate::trainer::RunConfig;

    #[test]
    fn a_run_is_counted_once() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
        for (name, seed) in [("a", "0"), ("b", "0"), ("c", "1")] {
            let config = config.with_setting("seed", seed).unwrap();
            RunDirectory::create(folder.path().join(name), &config).unwrap();
        }
        let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
        let (kept, copies) = without_copies(runs);
        assert_eq!(kept.iter().map(FoundRun::name).collect::<Vec<_>>(), ["a", "c"]);
        assert_eq!(copies.len(), 1);
        assert!(copies[0].run.ends_with("b") && copies[0].reason.ends_with("/a"), "{copies:?}");
    }
}
