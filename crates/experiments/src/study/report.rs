//! The results of a study, for machines (`report.json`) and for people (`report.md`).

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{ExperimentError, Result};
use crate::sweep::{HitCounts, HitJob, ModelJob, ModelResult, Summary, Sweep, Work, result_in, results_of};
use mge_base::markdown;
use mge_results::{Comparison, FoundRun, LearningRow, ResultsError, TrainedRun, read_runs};
use mge_run::RunError;
use mge_stats::Bootstrap;

/// What a study's sweeps have made.
pub(super) struct Results {
    /// The models.
    pub models: Vec<(ModelJob, ModelResult)>,
    /// The counts.
    pub hits: Vec<(HitJob, HitCounts)>,
    /// The trainings with a fixed start.
    pub fixed: Vec<TrainedRun>,
    /// The trainings from noisy starts.
    pub noisy: Vec<TrainedRun>,
}

impl Results {
    /// Reads the results of a study's sweeps in its folder.
    pub fn read(folder: &Path, models: &Sweep, hits: &Sweep, trainings: &Sweep) -> Result<Self> {
        let mut results = Self { models: Vec::new(), hits: Vec::new(), fixed: Vec::new(), noisy: Vec::new() };
        let (mut fixed, mut noisy) = (Vec::new(), Vec::new());
        let in_folders = [(models, folder.join("models")), (hits, folder.join("hits")), (trainings, folder.to_owned())];
        for (job, folder) in
            in_folders.iter().flat_map(|(sweep, folder)| sweep.jobs.iter().map(move |job| (job, folder)))
        {
            let path = job.folder(folder);
            match &job.work {
                Work::Dynamics(model) => results.models.push((ModelJob::clone(model), finished(&path)?)),
                Work::Hits(count) => results.hits.push((HitJob::clone(count), finished(&path)?)),
                Work::Train(config) if config.start_noise.is_none() => fixed.push(path),
                Work::Train(_) => noisy.push(path),
            }
        }
        (results.fixed, results.noisy) = (trained(&fixed)?, trained(&noisy)?);
        Ok(results)
    }

    /// The means of the models and counts, in their sweeps' folder.
    pub fn means(folder: &Path, models: &Sweep, hits: &Sweep, bootstrap: &Bootstrap) -> Result<Means> {
        let summary = |sweep: &Sweep, name: &str| {
            let paths: Vec<PathBuf> = sweep.jobs.iter().map(|job| job.folder(&folder.join(name))).collect();
            Ok::<_, ExperimentError>(Summary::new(&results_of(&paths)?.0, bootstrap)?)
        };
        Ok(Means { models: summary(models, "models")?, hits: summary(hits, "hits")? })
    }

    /// Their report.
    pub fn report(&self) -> Report {
        let rows = |runs: &[TrainedRun]| runs.iter().map(|run| run.row.clone()).collect();
        let hit_row = |(job, hits): &(HitJob, HitCounts)| HitRow {
            task: job.task.name.clone(),
            policy: job.policy.name().to_owned(),
            seed: job.seed,
            hits: hits.clone(),
        };
        let model_row = |(job, result): &(ModelJob, ModelResult)| ModelRow {
            structure: "full".to_owned(),
            tools: job.tools.iter().map(ToString::to_string).collect(),
            one_step_error: result.one_step_error,
            rollout_error: result.rollout_error.clone(),
        };
        Report {
            version: Report::VERSION,
            hits: self.hits.iter().map(hit_row).collect(),
            learning: rows(&self.fixed),
            noisy_starts: rows(&self.noisy),
            models: self.models.iter().map(model_row).collect(),
        }
    }
}

/// The result of a finished model or count.
fn finished<T: serde::de::DeserializeOwned>(folder: &Path) -> Result<T> {
    result_in(folder)?.ok_or_else(|| RunError::NotARun(folder.to_owned()).into())
}

/// The results of trainings, which are distinguished from each other.
fn trained(folders: &[PathBuf]) -> Result<Vec<TrainedRun>, RunError> {
    Ok(read_runs(folders)?.into_iter().map(|FoundRun { trained, .. }| trained).collect())
}

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

/// The means of a study over the seeds.
pub(super) struct Means {
    /// Of the models.
    pub models: Summary,
    /// Of the counts.
    pub hits: Summary,
}

impl Report {
    /// The version this program writes.
    pub const VERSION: u32 = 1;

    /// The report as Markdown.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    pub(super) fn to_markdown(
        &self,
        Means { models, hits }: &Means,
        bootstrap: &Bootstrap,
        command: &str,
    ) -> Result<String, ResultsError> {
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
        let tables = [
            ("Dynamics models", "Mean errors on launches and in scenes of the tasks that the models never saw", models),
            (
                "Exploration without learning",
                "Episodes that reached the goal and each subgoal, by the clusters of the learned models (guided) and by an untrained actor with Ornstein-Uhlenbeck noise (random)",
                hits,
            ),
        ];
        for (title, about, summary) in tables {
            let _ = writeln!(text, "## {title}\n\n{about}: means over the seeds, with their intervals.\n");
            text += &summary.to_markdown();
        }
        let fixed = "every episode begins in the same state, and the dynamics models are the study's own";
        let noisy = "the ball's start is moved a little in every episode, and the dynamics models are the shipped ones";
        for (rows, title, conditions) in
            [(&self.learning, "Learning", fixed), (&self.noisy_starts, "Learning from noisy starts", noisy)]
        {
            let episodes = rows.iter().map(|row| row.episodes).max().unwrap_or(0);
            let seeds = rows.iter().map(|row| row.seed).collect::<BTreeSet<u64>>().len();
            let _ = write!(text, "## {title}\n\n{episodes} episodes, {seeds} seeds; {conditions}. ");
            Comparison::new(rows.clone(), Vec::new(), bootstrap, command, None)?.write_tables(&mut text)?;
        }
        text.push_str("## Figures\n\n");
        for (file, caption) in FIGURES {
            let _ = writeln!(text, "![{caption}](figures/{file}.png)\n\n*{caption}*\n");
        }
        Ok(text)
    }
}

/// File stems of the figures and their captions.
pub(super) const FIGURES: [(&str, &str); 11] = [
    ("figure1", "Figure 1: single-tool launches"),
    ("figure2", "Figure 2: dynamic relative coordinates with the moving ball as origin"),
    ("figure3", "Figure 3: the tasks"),
    ("figure4", "Figure 4: actions sampled from the clusters"),
    ("figure5", "Figure 5: goals and subgoals hit, guided against random"),
    ("figure6", "Figure 6: rolling success during training"),
    ("figure6-greedy", "Figure 6, greedy policy: success without noise or guidance"),
    ("methods", "All methods: area under the curve of the rolling success, by task"),
    ("noisy-starts", "Noisy starts: rolling success during training"),
    ("noisy-starts-charged", "Noisy starts: rolling success against charged actions"),
    ("noisy-starts-methods", "Noisy starts: area under the curve of the rolling success, by task"),
];
