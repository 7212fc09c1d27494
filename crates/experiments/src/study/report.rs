//! The results of a study, for machines (`report.json`) and for people (`report.md`).

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::hits::HitCounts;
use super::plan::{START_NOISE, StudyPlan};
use mge_base::markdown;
use mge_results::{Comparison, EvidenceError, LearningRow};
use mge_stats::{Bootstrap, Estimate, StatsError};
use mge_task::Task;

/// The results of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Format version.
    pub version: u32,
    /// Counts of how often exploration reached each stage.
    pub hits: Vec<HitRow>,
    /// Training results of the parts with a fixed start.
    pub learning: Vec<LearningRow>,
    /// Training results from noisy starts.
    pub noisy_starts: Vec<LearningRow>,
    /// Errors of the dynamics models.
    pub models: Vec<ModelRow>,
}

/// Hit counts of one policy on one task.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HitRow {
    /// Name of the task.
    pub task: String,
    /// `guided` (epsilon threshold 1) or `random` (actor and OU noise).
    pub policy: String,
    /// Seed of the episodes.
    pub seed: u64,
    /// The counts.
    #[serde(flatten)]
    pub hits: HitCounts,
}

/// One dynamics model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelRow {
    /// Its structure: full, or the assumption switched off.
    pub structure: String,
    /// Its tool set.
    pub tools: Vec<String>,
    /// Mean error of one prediction on fresh launches, normalised.
    pub one_step_error: f64,
    /// Mean error after 1, 2, ... actions in unseen scenes of the tasks, normalised.
    pub rollout_error: Vec<f64>,
}

impl Report {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    /// The report as Markdown.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub fn to_markdown(&self, plan: &StudyPlan, command: &str) -> Result<String, EvidenceError> {
        let bootstrap = plan.bootstrap();
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = writeln!(text, "# Model-guided exploration: study report\n");
        let _ = writeln!(
            text,
            "{}. Every number comes from the files in this folder; `report.json` has one row for each count and training. Intervals are 95 % percentile bootstrap intervals over seeds ({} resamples, seed {}).\n",
            markdown::made_by(command, mge_base::identity::version()),
            bootstrap.resamples,
            bootstrap.seed
        );
        self.write_models(&mut text);
        self.write_hits(&mut text, plan, &bootstrap)?;
        let trainings = format!("{} episodes, {} seeds", plan.learning_episodes, plan.learning_seeds);
        let planning = match plan.planning_episodes {
            0 => String::new(),
            episodes => format!(" ({episodes} episodes for planning, which does not learn)"),
        };
        let fixed = format!(
            "every episode begins in the same state, and the dynamics models are the study's own unless the method says otherwise{planning}"
        );
        let noisy = format!(
            "the ball's start is moved by up to {START_NOISE} in each direction in every episode, and the dynamics models are the shipped ones"
        );
        for (rows, title, conditions) in
            [(&self.learning, "Learning", fixed), (&self.noisy_starts, "Learning from noisy starts", noisy)]
        {
            let _ = write!(text, "## {title}\n\n{trainings}; {conditions}. ");
            Comparison::new(rows.clone(), Vec::new(), &bootstrap, command, None)?.write_tables(&mut text)?;
        }
        text.push_str("## Figures\n\n");
        for (file, caption) in FIGURES {
            let _ = writeln!(text, "![{caption}](figures/{file}.png)\n\n*{caption}*\n");
        }
        Ok(text)
    }

    fn write_models(&self, text: &mut String) {
        text.push_str("## Dynamics models\n\nMean errors in normalised units (the screen is 2 wide): of one prediction on launches that were not trained on, and after 1, 2, ... actions in scenes of the tasks that the model never saw.\n\n");
        *text += &markdown::header(["tools", "structure", "one step", "after 1, 2, ... actions"]);
        for row in &self.models {
            let rollout: Vec<String> = row.rollout_error.iter().map(|error| format!("{error:.3}")).collect();
            let (tools, one_step) = (row.tools.join(", "), format!("{:.4}", row.one_step_error));
            *text += &markdown::row([&tools, &row.structure, &one_step, &rollout.join(", ")]);
        }
        text.push('\n');
    }

    fn write_hits(&self, text: &mut String, plan: &StudyPlan, bootstrap: &Bootstrap) -> Result<(), StatsError> {
        let _ = writeln!(
            text,
            "## Exploration without learning\n\nEpisodes of {} that reached the goal and each subgoal: mean over {} seeds, with its interval. Guided play draws every action from the clusters of the learned models ({} independent builds); random play is an untrained actor with Ornstein-Uhlenbeck noise.\n",
            plan.hit_episodes, plan.hit_seeds, plan.builds
        );
        *text += &markdown::header(["task", "policy", "goal", "subgoals"]);
        for task in &plan.tasks {
            for policy in ["guided", "random"] {
                let (goal, subgoals) = self.mean_hits(task, policy, bootstrap)?;
                let subgoals: Vec<String> = subgoals.into_iter().map(format_count).collect();
                *text += &markdown::row([&task.name, policy, &format_count(goal), &subgoals.join("; ")]);
            }
        }
        text.push('\n');
        Ok(())
    }

    /// Means over the seeds of the episodes that reached the goal and each subgoal.
    ///
    /// # Errors
    /// When there are no counts for the task and policy.
    pub(super) fn mean_hits(
        &self,
        task: &Task,
        policy: &str,
        bootstrap: &Bootstrap,
    ) -> Result<(Estimate, Vec<Estimate>), StatsError> {
        let rows: Vec<&HitCounts> =
            self.hits.iter().filter(|row| row.task == task.name && row.policy == policy).map(|row| &row.hits).collect();
        let mean = |of: &dyn Fn(&HitCounts) -> u32| {
            bootstrap.mean(&rows.iter().map(|hits| f64::from(of(hits))).collect::<Vec<_>>())
        };
        let subgoals = (0..task.subgoals.len()).map(|n| mean(&|hits| hits.subgoals[n]));
        Ok((mean(&|hits| hits.goal)?, subgoals.collect::<Result<_, _>>()?))
    }
}

/// File stems of the figures and their captions.
pub(super) const FIGURES: [(&str, &str); 12] = [
    ("figure1", "Figure 1: single-tool launches"),
    ("figure2", "Figure 2: dynamic relative coordinates with the moving ball as origin"),
    ("figure3", "Figure 3: the tasks"),
    ("figure4", "Figure 4: actions sampled from the clusters"),
    ("figure5", "Figure 5: goals and subgoals hit, guided against random"),
    ("figure6", "Figure 6: rolling success during training"),
    ("figure6-greedy", "Figure 6, greedy policy: success without noise or guidance"),
    ("performance-profile", "Performance profile of the final success over all tasks"),
    ("methods", "All methods: area under the curve of the rolling success, by task"),
    ("noisy-starts", "Noisy starts: rolling success during training"),
    ("noisy-starts-steps", "Noisy starts: rolling success against all actions in the real environment"),
    ("noisy-starts-methods", "Noisy starts: area under the curve of the rolling success, by task"),
];

fn format_count(estimate: Estimate) -> String {
    format!("{:.0} [{:.0}, {:.0}]", estimate.value, estimate.lower, estimate.upper)
}
