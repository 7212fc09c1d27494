//! What trainings came to: a row each for machines, tables for people. Shared by the study
//! of the paper and by reports of any runs.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use crate::guidance::EpsilonSchedule;
use crate::run::RunHistory;
use crate::stats::aggregate::{iqm, mean};
use crate::stats::efficiency::{Efficiency, efficiency};
use crate::stats::rolling::{WINDOW, rolling_mean};
use crate::stats::{Bootstrap, Estimate, StatsError, TaskScores, comparison};
use crate::trainer::{Method, RunConfig};

/// One training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearningRow {
    /// Name of the task.
    pub task: String,
    /// Name of the method, such as `ddpg-mge`.
    pub method: String,
    /// The epsilon schedule.
    pub epsilon: String,
    /// Other settings that tell it from the runs beside it, by JSON path.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: BTreeMap<String, String>,
    /// Master seed.
    pub seed: u64,
    /// Episodes trained.
    pub episodes: u64,
    /// Episodes to thresholds, area under the curve, final success.
    #[serde(flatten)]
    pub efficiency: Efficiency,
    /// Success of the last greedy evaluations, over the last tenth of the run.
    pub greedy_success: Option<f64>,
}

/// A training as figures show it: of its history, which is long, only the curves are kept.
#[derive(Debug, Clone)]
pub struct TrainedRun {
    /// What it came to.
    pub row: LearningRow,
    /// Episodes and the rolling success after them.
    pub training: Vec<[f64; 2]>,
    /// Episodes and the mean success of the last greedy evaluations.
    pub greedy: Vec<[f64; 2]>,
}

/// Points of a learning curve, at most.
const CURVE_POINTS: usize = 100;
/// Greedy evaluations that a point is the mean of: one alone is often 0 or 1.
pub(super) const EVALUATIONS: NonZeroUsize = NonZeroUsize::new(10).unwrap();

impl TrainedRun {
    /// The run with this configuration and history.
    pub fn new(config: &RunConfig, history: &RunHistory) -> Self {
        let every = history.records.len().div_ceil(CURVE_POINTS).max(1);
        let records = history.records.iter().skip(every - 1).step_by(every);
        let successes: Vec<f64> = history.evaluations.iter().map(|evaluation| evaluation.success).collect();
        let greedy = history.evaluations.iter().zip(rolling_mean(&successes, EVALUATIONS));
        Self {
            row: LearningRow::new(config, history),
            training: records.map(|record| [record.episode as f64, record.rolling_success]).collect(),
            greedy: greedy.map(|(evaluation, success)| [evaluation.episode as f64, success]).collect(),
        }
    }
}

impl LearningRow {
    /// The row of a run with this configuration and history.
    pub fn new(config: &RunConfig, history: &RunHistory) -> Self {
        let successes: Vec<bool> = history.records.iter().map(|record| record.goal).collect();
        let last_tenth = u64::from(config.episodes) * 9 / 10;
        let last = history.evaluations.iter().filter(|evaluation| evaluation.episode > last_tenth);
        let greedy: Vec<f64> = last.map(|evaluation| evaluation.success).collect();
        Self {
            task: config.task.name.clone(),
            method: config.method.name().to_owned(),
            epsilon: config.epsilon.to_string(),
            settings: BTreeMap::new(),
            seed: config.seed,
            episodes: successes.len() as u64,
            efficiency: efficiency(&successes, WINDOW),
            greedy_success: (!greedy.is_empty()).then(|| greedy.iter().sum::<f64>() / greedy.len() as f64),
        }
    }

    /// Name of its method, threshold and settings, as in legends and tables.
    pub fn label(&self) -> String {
        let mut label = match self.method.parse::<Method>() {
            Ok(method) if method.has_clusters() => format!("{}, epsilon {}", method.label(), self.threshold()),
            Ok(method) => method.label().to_owned(),
            Err(_) => self.method.clone(),
        };
        let told = |(key, value): &(&String, &String)| *key != WHOLE_SCHEDULE && !USUAL.contains(&(key, value));
        for (key, value) in self.settings.iter().filter(told) {
            let _ = write!(label, ", {} {value}", if key == "prior" { "model" } else { key });
        }
        label
    }

    /// The threshold in words, or whole where the words would be those of another one too.
    fn threshold(&self) -> String {
        match self.epsilon.split(':').collect::<Vec<_>>().as_slice() {
            ["linear", from, to, _] if !self.settings.contains_key(WHOLE_SCHEDULE) => format!("{from} to {to}"),
            _ => self
                .epsilon
                .parse()
                .map_or_else(|_| self.epsilon.clone(), |schedule: EpsilonSchedule| schedule.describe()),
        }
    }

    /// Makes its label say the schedule whole.
    pub(super) fn tell_whole_schedule(&mut self) {
        self.settings.insert(WHOLE_SCHEDULE.to_owned(), self.epsilon.clone());
    }
}

/// The setting of a row that is a threshold only if two of them are called the same.
const WHOLE_SCHEDULE: &str = "epsilon";

/// Settings that go without saying in a label, though another run has another value: the whole
/// model of the tool set, clusters that stay as they are, a shipped task.
const USUAL: [(&str, &str); 4] =
    [("prior", WHOLE_MODEL), ("refinement.every", "0"), ("subgoals", AS_SHIPPED), ("scene", AS_SHIPPED)];
/// What is called so of a task that is as it was shipped.
pub(super) const AS_SHIPPED: &str = "shipped";
/// What a whole model is called among models that lack something.
pub(super) const WHOLE_MODEL: &str = "full";

/// Rows of trainings, asked by task and by label.
#[derive(Debug, Clone, Copy)]
pub(super) struct Learning<'a>(pub &'a [LearningRow]);

impl<'a> Learning<'a> {
    /// Labels of the methods, in the order in which they appear.
    pub fn labels(self) -> Vec<String> {
        distinct(self.0.iter().map(LearningRow::label))
    }

    /// Names of the tasks, in the order in which they appear.
    pub fn tasks(self) -> Vec<String> {
        distinct(self.0.iter().map(|row| row.task.clone()))
    }

    /// The rows of one method on one task.
    pub fn of(self, task: &str, label: &str) -> Vec<&'a LearningRow> {
        self.0.iter().filter(|row| row.task == task && row.label() == label).collect()
    }

    /// Tasks on which every method was trained.
    pub fn common_tasks(self) -> Vec<String> {
        let labels = self.labels();
        let common = |task: &String| labels.iter().all(|label| !self.of(task, label).is_empty());
        self.tasks().into_iter().filter(common).collect()
    }

    /// Scores of a method on these tasks.
    ///
    /// # Errors
    /// When the method has no run on one of them.
    pub fn scores(self, tasks: &[String], label: &str, score: Score) -> Result<TaskScores, StatsError> {
        let of_task = |task: &String| Ok(scores(&self.of(task, label), score)?.all().collect::<Vec<f64>>());
        TaskScores::new(tasks.iter().map(of_task).collect::<Result<_, StatsError>>()?)
    }

    /// Scores of each method on the common tasks.
    ///
    /// # Errors
    /// When there is no common task.
    pub fn common_scores(self, score: Score) -> Result<Vec<(String, TaskScores)>, StatsError> {
        let tasks = self.common_tasks();
        self.labels().into_iter().map(|label| Ok((label.clone(), self.scores(&tasks, &label, score)?))).collect()
    }

    /// With what the others are compared: plain DDPG, or else the first method.
    pub fn baseline(self) -> Option<String> {
        let labels = self.labels();
        labels.iter().find(|label| *label == "DDPG").or(labels.first()).cloned()
    }

    /// The sample-efficiency table, one row a task and method, with the text that explains it.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn write_table(self, text: &mut String, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let Some(baseline) = self.baseline() else { return Ok(()) };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "Area under the curve of the rolling success (window {WINDOW}) and final rolling success: interquartile mean with its interval. Episodes to 50 % and 80 %: median over the seeds that got there, and how many did. Probability of improvement over {baseline} in the area under the curve.\n\n| task | method | seeds | area | final | to 50 % | to 80 % | greedy at the end | P(better than {baseline}) |\n|---|---|---|---|---|---|---|---|---|"
        );
        for task in self.tasks() {
            let base = self.of(&task, &baseline);
            for label in self.labels() {
                let runs = self.of(&task, &label);
                if runs.is_empty() {
                    continue;
                }
                let areas = scores(&runs, AREA)?;
                let last = bootstrap.stratified(&scores(&runs, FINAL)?, iqm)?;
                let better = match label != baseline && !base.is_empty() {
                    true => format!("{:.2}", comparison::probability_of_improvement(&areas, &scores(&base, AREA)?)?),
                    false => String::new(),
                };
                let _ = writeln!(
                    text,
                    "| {task} | {label} | {} | {} | {} | {} | {} | {} | {better} |",
                    runs.len(),
                    format_share(bootstrap.stratified(&areas, iqm)?),
                    format_share(last),
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_50)),
                    reached(runs.iter().map(|row| row.efficiency.episodes_to_80)),
                    greedy_mean(&runs)?,
                );
            }
        }
        text.push('\n');
        Ok(())
    }
}

/// A score of a run.
pub(super) type Score = fn(&LearningRow) -> Option<f64>;

/// Area under the curve of the rolling success.
pub(super) const AREA: Score = |row| row.efficiency.auc;
/// Rolling success at the end.
pub(super) const FINAL: Score = |row| row.efficiency.final_success;

/// Scores of runs on one task; a run without a number counts as 0.
pub(super) fn scores(rows: &[&LearningRow], score: Score) -> Result<TaskScores, StatsError> {
    TaskScores::of_one_task(&rows.iter().map(|row| score(row).unwrap_or(0.0)).collect::<Vec<_>>())
}

/// Mean success of the last greedy evaluations; nothing for a method that has none.
fn greedy_mean(rows: &[&LearningRow]) -> Result<String, StatsError> {
    if rows.iter().all(|row| row.greedy_success.is_none()) {
        return Ok(String::new());
    }
    Ok(format!("{:.2}", mean(&scores(rows, |row| row.greedy_success)?)))
}

/// Each value once, in order of appearance.
fn distinct(values: impl Iterator<Item = String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// A share with its interval, to two digits.
pub(super) fn format_share(estimate: Estimate) -> String {
    format!("{:.2} [{:.2}, {:.2}]", estimate.value, estimate.lower, estimate.upper)
}

/// Median of the runs that got there, and how many of all did.
fn reached(episodes: impl Iterator<Item = Option<u64>>) -> String {
    let all: Vec<Option<u64>> = episodes.collect();
    let mut there: Vec<u64> = all.iter().flatten().copied().collect();
    there.sort_unstable();
    let middle = there.len() / 2;
    let median = match there.len() {
        0 => return format!("never (0/{})", all.len()),
        odd if odd % 2 == 1 => there[middle],
        _ => (there[middle - 1] + there[middle]).div_ceil(2),
    };
    format!("{median} ({}/{})", there.len(), all.len())
}
