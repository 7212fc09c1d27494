//! Comparison of runs: which method is better, by how much, and with what certainty.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::error::ResultsError;
use super::found::FoundRun;
use super::groups::{AREA, CHARGED_AREA, FINAL, Groups, HELD, Score, label_of};
use super::row::LearningRow;
use super::settings::training_key;
use mge_stats::aggregate::{iqm, mean, median, optimality_gap};
use mge_stats::comparison::improvement_interval;
use mge_stats::{Bootstrap, Estimate, StatsError, TaskScores};

/// Training results and the comparison of their methods.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Format version.
    pub version: u32,
    /// The command that reproduces the report.
    pub command: String,
    /// Version of the program that wrote it.
    pub mge_version: String,
    /// Parameters of the intervals.
    pub bootstrap: Bootstrap,
    /// Every finished run.
    pub learning: Vec<LearningRow>,
    /// Runs that are left out: unfinished ones and duplicates.
    pub left_out: Vec<ExcludedRun>,
    /// Label of the method that the others are compared with.
    #[serde(default)]
    pub reference: String,
    /// Tasks on which every method was trained; scores are aggregated over these.
    pub common_tasks: Vec<String>,
    /// Each method's scores over the common tasks.
    pub aggregates: Vec<AggregateRow>,
    /// Each pair of methods over the common tasks.
    pub improvements: Vec<ImprovementRow>,
}

/// A run that is left out of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExcludedRun {
    /// Its folder.
    pub run: PathBuf,
    /// The reason.
    pub reason: String,
}

/// Scores of one method, aggregated over several tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AggregateRow {
    /// Its label.
    pub method: String,
    /// The aggregated measure: `charged_area`, `auc`, `final_success` or `held_success`.
    pub measure: String,
    /// Number of runs.
    pub runs: usize,
    /// Their scores on each of the common tasks.
    #[serde(default)]
    pub scores: Vec<Vec<f64>>,
    /// Interquartile mean.
    pub iqm: Estimate,
    /// Mean.
    pub mean: Estimate,
    /// Median.
    pub median: Estimate,
    /// How far the mean falls short of 1.
    pub optimality_gap: Estimate,
}

/// The probability that a run of one method beats a run of another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImprovementRow {
    /// Label of the method.
    pub method: String,
    /// Label of the method it is compared with.
    pub over: String,
    /// The compared measure: `charged_area`, or `auc` in reports of earlier versions.
    pub measure: String,
    /// The probability; a tie counts one half.
    pub probability: Estimate,
}

/// A score that is aggregated over tasks.
struct Measure {
    /// Its name in `report.json`.
    key: &'static str,
    /// Its name in tables.
    label: &'static str,
    score: Score,
}

/// The name in tables of [`LearningRow::greedy_success`].
pub(super) const GREEDY: &str = "greedy over the last tenth";

/// The name in tables of a result of a run, given its key in JSON.
pub fn result_label(key: &str) -> &str {
    match key {
        "episodes_to_50" => "episodes to 50 %",
        "episodes_to_80" => "episodes to 80 %",
        "actions_to_80" => "actions to 80 %",
        "charged_to_80" => "charged to 80 %",
        "charged_outside" => "charged outside episodes and practice",
        "charged_area" => "charged area (same budget)",
        "charged_actions" => "charged actions",
        "episodes" => "episodes done",
        "greedy_success" => GREEDY,
        key => MEASURES.iter().find(|measure| measure.key == key).map_or(key, |measure| measure.label),
    }
}

/// The scores that are aggregated over tasks.
const MEASURES: [Measure; 4] = [
    Measure { key: "charged_area", label: "charged area", score: CHARGED_AREA },
    Measure { key: "auc", label: "area", score: AREA },
    Measure { key: "final_success", label: "final success", score: FINAL },
    Measure { key: "held_success", label: "held success", score: HELD },
];

/// Separates runs from duplicates with the same settings and seed, which would make intervals too
/// narrow.
pub(super) fn without_duplicates(runs: Vec<FoundRun>) -> (Vec<FoundRun>, Vec<ExcludedRun>) {
    let mut kept: Vec<FoundRun> = Vec::new();
    let mut copies = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for mut run in runs {
        match known.entry(training_key(&run.config)) {
            Entry::Vacant(place) => {
                place.insert(kept.len());
                kept.push(run);
            }
            Entry::Occupied(same) => {
                let kept = &mut kept[*same.get()];
                // That which users gave a name is shown by it.
                if kept.trained.row.name.is_empty() && !run.trained.row.name.is_empty() {
                    std::mem::swap(kept, &mut run);
                }
                let reason = format!("has the settings and the seed of {}", kept.path.display());
                copies.push(ExcludedRun { run: run.path, reason });
            }
        }
    }
    (kept, copies)
}

pub(super) fn left_out(run: &FoundRun) -> ExcludedRun {
    let episodes = format!("{} of {} episodes", run.trained.row.episodes, run.config.episodes);
    let why = run.state.reason().map_or_else(String::new, |reason| format!(": {reason}"));
    ExcludedRun { run: run.path.clone(), reason: format!("{}{why} ({episodes})", run.state.name()) }
}

impl Comparison {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    /// Compares finished runs; with those called `reference` in particular, or else with the usual baseline.
    ///
    /// # Errors
    /// When there are no runs with that label, or a statistic cannot be computed.
    pub fn new(
        learning: Vec<LearningRow>,
        left_out: Vec<ExcludedRun>,
        bootstrap: &Bootstrap,
        command: &str,
        reference: Option<&str>,
    ) -> Result<Self, ResultsError> {
        let mut report = Self {
            version: Self::VERSION,
            command: command.to_owned(),
            mge_version: mge_base::identity::version().to_owned(),
            bootstrap: *bootstrap,
            learning,
            left_out,
            ..Self::default()
        };
        let groups = Groups::new(&report.learning);
        let reference = reference.map(|text| label_of(&groups.legend(), text)).transpose()?;
        report.reference = reference.or(groups.baseline().map(str::to_owned)).unwrap_or_default();
        let common_tasks = groups.common_tasks();
        if common_tasks.is_empty() {
            return Ok(report);
        }
        let scores = |label: &str, score| groups.scores(&common_tasks, label, score);
        let mut aggregates = Vec::new();
        for Measure { key, score, .. } in MEASURES {
            for label in &groups.labels {
                aggregates.push(aggregate(label, key, &scores(label, score)?, bootstrap)?);
            }
        }
        let mut improvements = Vec::new();
        for method in &groups.labels {
            for over in groups.labels.iter().filter(|over| *over != method) {
                let probability =
                    improvement_interval(&scores(method, CHARGED_AREA)?, &scores(over, CHARGED_AREA)?, bootstrap)?;
                let (method, over) = (method.clone(), over.clone());
                improvements.push(ImprovementRow { method, over, measure: "charged_area".to_owned(), probability });
            }
        }
        (report.aggregates, report.improvements, report.common_tasks) = (aggregates, improvements, common_tasks);
        Ok(report)
    }

    /// The distinct master seeds of the runs.
    pub(super) fn seeds(&self) -> Vec<u64> {
        let mut seeds: Vec<u64> = self.learning.iter().map(|row| row.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds
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
    use crate::{find_runs, read_runs};
    use mge_run::RunDirectory;
    use mge_trainer::RunConfig;

    #[test]
    fn a_run_is_counted_once() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let config = config.with_setting("method", "ddpg").unwrap();
        // Without clusters, epsilon has no effect; checkpoints never have one.
        for (name, seed, epsilon, checkpoints) in
            [("a", "0", "0.1", "100"), ("b", "0", "0.3", "2"), ("c", "1", "0.1", "100")]
        {
            let changes = [("seed", seed), ("epsilon", epsilon), ("checkpoints.last_every", checkpoints)];
            let changed = |config: RunConfig, (key, value): (&str, &str)| config.with_setting(key, value).unwrap();
            let config = changes.into_iter().fold(config.clone(), changed);
            RunDirectory::create(folder.path().join(name), &config).unwrap();
        }
        let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
        let (kept, copies) = without_duplicates(runs);
        assert_eq!(kept.iter().map(FoundRun::name).collect::<Vec<_>>(), ["a", "c"]);
        assert_eq!(copies.len(), 1);
        assert!(copies[0].run.ends_with("b") && copies[0].reason.ends_with("/a"), "{copies:?}");
    }
}
