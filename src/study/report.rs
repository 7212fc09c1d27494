//! What a study found: for machines (`report.json`) and for people (`report.md`).

use std::fmt::Write as _;
use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::plan::StudyPlan;
use crate::stats::aggregate::{iqm, mean};
use crate::stats::efficiency::{Efficiency, efficiency};
use crate::stats::{Bootstrap, Estimate, StatsError, TaskScores, comparison};
use crate::trainer::WINDOW;

/// The numbers of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Format version.
    pub version: u32,
    /// How often exploration reached each stage.
    pub hits: Vec<HitsRow>,
    /// How the trainings went.
    pub learning: Vec<LearningRow>,
    /// How well the dynamics models predict.
    pub models: Vec<ModelRow>,
}

/// One hit count.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HitsRow {
    /// Name of the task.
    pub task: String,
    /// `guided` (epsilon threshold 1) or `random` (actor and OU noise).
    pub policy: String,
    /// Seed of the episodes.
    pub seed: u64,
    /// Episodes played.
    pub episodes: u32,
    /// Episodes that reached the goal.
    pub goal: u32,
    /// Episodes that reached each subgoal.
    pub subgoals: Vec<u32>,
}

/// One training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearningRow {
    /// Name of the task.
    pub task: String,
    /// `ddpg` or `ddpg-mge`.
    pub method: String,
    /// The epsilon schedule.
    pub epsilon: String,
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

/// One dynamics model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelRow {
    /// Its tool set.
    pub tools: Vec<String>,
    /// Mean error of one prediction on fresh launches, normalised.
    pub one_step_error: f64,
    /// Mean error after 1, 2, ... actions in unseen scenes of the tasks, normalised.
    pub rollout_error: Vec<f64>,
}

/// The window of the rolling success.
pub(super) fn window() -> NonZeroUsize {
    // The constant is positive.
    NonZeroUsize::new(WINDOW).expect("the window is not empty")
}

/// Efficiency of a run from whether its episodes reached the goal.
pub(super) fn run_efficiency(successes: &[bool]) -> Efficiency {
    efficiency(successes, window())
}

/// Name of a method and its threshold, as in legends and tables.
pub(super) fn method_label(method: &str, epsilon: &str) -> String {
    match method {
        "ddpg" => "DDPG".to_owned(),
        _ => match epsilon.split(':').collect::<Vec<_>>().as_slice() {
            ["linear", from, to, _] => format!("DDPG-MGE, epsilon {from} to {to}"),
            _ => format!("DDPG-MGE, epsilon {epsilon}"),
        },
    }
}

impl Report {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    /// Labels of the methods, in the order in which they appear.
    pub(super) fn methods(&self) -> Vec<String> {
        let mut labels: Vec<String> = Vec::new();
        for row in &self.learning {
            let label = method_label(&row.method, &row.epsilon);
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
        labels
    }

    /// The rows of one method on one task.
    pub(super) fn runs<'a>(&'a self, task: &'a str, label: &'a str) -> impl Iterator<Item = &'a LearningRow> {
        self.learning.iter().filter(move |row| row.task == task && method_label(&row.method, &row.epsilon) == label)
    }

    /// The report as Markdown.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn to_markdown(&self, plan: &StudyPlan, command: &str) -> Result<String, StatsError> {
        let bootstrap = Bootstrap { resamples: plan.resamples, ..Bootstrap::default() };
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = writeln!(text, "# Model-guided exploration: study report\n");
        let _ = writeln!(
            text,
            "Made by `{command}` with mge {}. Every number comes from the files in this folder; `report.json` has one row for each count and training. Intervals are 95 % percentile bootstrap intervals over seeds ({} resamples, seed {}).\n",
            env!("CARGO_PKG_VERSION"),
            bootstrap.resamples,
            bootstrap.seed
        );
        self.write_models(&mut text);
        self.write_hits(&mut text, plan, &bootstrap)?;
        self.write_learning(&mut text, plan, &bootstrap)?;
        text.push_str("## Figures\n\n");
        for (file, caption) in FIGURES {
            let _ = writeln!(text, "![{caption}](figures/{file}.png)\n\n*{caption}*\n");
        }
        Ok(text)
    }

    fn write_models(&self, text: &mut String) {
        text.push_str("## Dynamics models\n\nMean errors in normalised units (the screen is 2 wide): of one prediction on launches that were not trained on, and after 1, 2, ... actions in scenes of the tasks that the model never saw.\n\n| tools | one step | after 1, 2, ... actions |\n|---|---|---|\n");
        for row in &self.models {
            let rollout: Vec<String> = row.rollout_error.iter().map(|error| format!("{error:.3}")).collect();
            let _ = writeln!(text, "| {} | {:.4} | {} |", row.tools.join(", "), row.one_step_error, rollout.join(", "));
        }
        text.push('\n');
    }

    fn write_hits(&self, text: &mut String, plan: &StudyPlan, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let _ = writeln!(
            text,
            "## Exploration without learning\n\nEpisodes of {} that reached the goal and each subgoal: mean over {} seeds, with its interval. Guided play draws every action from the clusters of the learned models ({} independent builds); random play is an untrained actor with Ornstein-Uhlenbeck noise.\n\n| task | policy | goal | subgoals |\n|---|---|---|---|",
            plan.hit_episodes, plan.hit_seeds, plan.builds
        );
        for task in &plan.tasks {
            for policy in ["guided", "random"] {
                let rows: Vec<&HitsRow> =
                    self.hits.iter().filter(|row| row.task == task.name && row.policy == policy).collect();
                let estimate = |of: &dyn Fn(&HitsRow) -> u32| {
                    bootstrap.mean(&rows.iter().map(|row| f64::from(of(row))).collect::<Vec<_>>())
                };
                let goal = format_count(estimate(&|row| row.goal)?);
                let subgoals = (0..task.subgoals.len())
                    .map(|n| Ok(format_count(estimate(&|row| row.subgoals[n])?)))
                    .collect::<Result<Vec<String>, StatsError>>()?;
                let _ = writeln!(text, "| {} | {policy} | {goal} | {} |", task.name, subgoals.join("; "));
            }
        }
        text.push('\n');
        Ok(())
    }

    fn write_learning(&self, text: &mut String, plan: &StudyPlan, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let _ = writeln!(
            text,
            "## Learning\n\n{} episodes, {} seeds. Area under the curve of the rolling success (window {WINDOW}) and final rolling success: interquartile mean with its interval. Episodes to 50 % and 80 %: median over the seeds that got there, and how many did. Probability of improvement over DDPG in the area under the curve.\n\n| task | method | area | final | to 50 % | to 80 % | greedy at the end | P(better than DDPG) |\n|---|---|---|---|---|---|---|---|",
            plan.learning_episodes, plan.learning_seeds
        );
        let methods = self.methods();
        for task in &plan.tasks {
            let areas = |label: &str| scores(self.runs(&task.name, label).map(|row| row.efficiency.auc));
            for label in &methods {
                let runs = || self.runs(&task.name, label);
                let area = bootstrap.stratified(&areas(label)?, iqm)?;
                let last = bootstrap.stratified(&scores(runs().map(|row| row.efficiency.final_success))?, iqm)?;
                let greedy = mean(&scores(runs().map(|row| row.greedy_success))?);
                let better = match methods.first() {
                    Some(baseline) if baseline != label => {
                        let p = comparison::probability_of_improvement(&areas(label)?, &areas(baseline)?)?;
                        format!("{p:.2}")
                    }
                    _ => String::new(),
                };
                let _ = writeln!(
                    text,
                    "| {} | {label} | {} | {} | {} | {} | {greedy:.2} | {better} |",
                    task.name,
                    format_share(area),
                    format_share(last),
                    reached(runs().map(|row| row.efficiency.episodes_to_50)),
                    reached(runs().map(|row| row.efficiency.episodes_to_80)),
                );
            }
        }
        text.push('\n');
        Ok(())
    }
}

/// File stems of the figures and their captions.
pub(super) const FIGURES: [(&str, &str); 7] = [
    ("figure1", "Figure 1: single-tool launches"),
    ("figure2", "Figure 2: dynamic relative coordinates with the moving ball as origin"),
    ("figure3", "Figure 3: the tasks"),
    ("figure4", "Figure 4: actions sampled from the clusters"),
    ("figure5", "Figure 5: goals and subgoals hit, guided against random"),
    ("figure6", "Figure 6: rolling success during training"),
    ("figure6-greedy", "Figure 6, greedy policy: success without noise or guidance"),
];

/// Scores of one task; a run without a number counts as 0.
fn scores(values: impl Iterator<Item = Option<f64>>) -> Result<TaskScores, StatsError> {
    TaskScores::of_one_task(&values.map(|value| value.unwrap_or(0.0)).collect::<Vec<_>>())
}

fn format_count(estimate: Estimate) -> String {
    format!("{:.0} [{:.0}, {:.0}]", estimate.value, estimate.lower, estimate.upper)
}

fn format_share(estimate: Estimate) -> String {
    format!("{:.2} [{:.2}, {:.2}]", estimate.value, estimate.lower, estimate.upper)
}

/// Median of the runs that got there, and how many of all did.
fn reached(episodes: impl Iterator<Item = Option<u64>>) -> String {
    let all: Vec<Option<u64>> = episodes.collect();
    let mut there: Vec<u64> = all.iter().flatten().copied().collect();
    there.sort_unstable();
    match there.get(there.len() / 2) {
        Some(median) => format!("{median} ({}/{})", there.len(), all.len()),
        None => format!("never (0/{})", all.len()),
    }
}
