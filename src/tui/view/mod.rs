//! What the screens show, as plain data: screens are functions of this and of the
//! screen's own state, and need neither a session nor a thread to be tested.

mod curves;
mod details;
mod groups;
mod histories;
mod marks;
mod models;
mod past;
pub mod playback;
mod rate;
mod run_index;
mod subject;
mod system;
mod task_model;
mod workspace;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use curves::Curves;
pub use details::RunDetails;
pub use groups::{GroupCurves, Grouping, RunGroup};
pub use marks::{Mark, marks};
pub use past::PastAgent;
pub use rate::span;
pub use subject::{AgentView, Beside, Choice, Subject};
pub use system::System;
pub use task_model::TaskModel;
pub use workspace::{SessionWorkspace, Workspace};

use crate::agent::Ddpg;
use crate::dynamics::Evaluation;
use crate::env::{EndReason, Snapshot};
use crate::guidance::ActionPrior;
use crate::run::{Metric, Practised, RunState};
use crate::task::{Region, Task};
use crate::trainer::{RunConfig, Trace};
use crate::tui::scene::Objects;
use crate::workbench::{PriorState, run_label};

use playback::Episode;

/// Everything there is to see.
#[derive(Debug, Clone)]
pub struct ViewModel {
    /// The task as it is being edited.
    pub task: Arc<Task>,
    /// Its file, if it is not a shipped one.
    pub file: Option<PathBuf>,
    /// The task differs from its file.
    pub dirty: bool,
    /// Subgoals that are proposed for the task.
    pub proposed: Vec<Region>,
    /// Proposals tried so far and at most, while subgoals are looked for.
    pub proposing: Option<(usize, usize)>,
    /// What the next run will use.
    pub settings: RunConfig,
    /// Where runs go.
    pub folder: PathBuf,
    /// The clusters computed for the task as it is being edited, or as it was.
    pub prior: Option<Arc<ActionPrior>>,
    /// How these clusters stand to the task and the settings.
    pub prior_state: PriorState,
    /// Why the clusters could not be computed the last time.
    pub prior_failure: Option<String>,
    /// Dynamics models one can choose.
    pub models: Vec<ModelSummary>,
    /// Past and running runs, the latest last.
    pub runs: Vec<Arc<RunSummary>>,
    /// The runs in groups, as they were a moment ago.
    pub groups: Arc<Grouping>,
    /// The files of the run that was last asked for.
    pub details: Option<Arc<RunDetails>>,
    /// Runs in the folder that were not read yet; at least 1 while it is being read.
    pub runs_unread: usize,
    /// The run that is being watched.
    pub watched: Option<Watched>,
    /// The episode a person plays.
    pub hand: HandEpisode,
    /// What is being done about a dynamics model, and how much of it is done.
    pub model_work: Option<(String, Option<f32>)>,
    /// Losses of the model that is or was trained last, one an epoch.
    pub model_losses: Arc<Vec<f32>>,
    /// The result of the latest work on a dynamics model.
    pub model_outcome: Option<Result<String, String>>,
    /// Figures written in this session.
    pub figures: Vec<PathBuf>,
    /// What the workbench costs.
    pub system: System,
    /// What happened, oldest first, as far as it is kept.
    pub log: Vec<LogLine>,
    /// Lines of the log so far, also those no longer kept.
    pub log_total: usize,
}

/// The run that is being watched, with what only an open run has.
#[derive(Debug, Clone)]
pub struct Watched {
    /// The run.
    pub run: Arc<RunSummary>,
    /// The task it is trained on.
    pub task: Arc<Task>,
    /// Its action clusters.
    pub prior: Option<Arc<ActionPrior>>,
    /// Its latest episode that is known.
    pub live: Option<Live>,
    /// The agent of the past episode that was last asked for.
    pub agent: Option<PastAgent>,
    /// The latest episode of its greedy policy that was asked for.
    pub greedy: Option<Arc<Episode>>,
}

/// The latest episode of a run.
#[derive(Debug, Clone)]
pub struct Live {
    /// The episode.
    pub episode: Arc<Episode>,
    /// Actor and critic after it, while it is trained here.
    pub networks: Option<Arc<Ddpg>>,
}

/// The episode a person plays.
#[derive(Debug, Clone)]
pub struct HandEpisode {
    /// The task it is played on.
    pub task: Arc<Task>,
    /// The actions so far.
    pub trace: Arc<Trace>,
    /// The state after them.
    pub snapshot: Arc<Snapshot>,
}

impl HandEpisode {
    /// Why it is over, if it is.
    pub fn end(&self) -> Option<EndReason> {
        self.snapshot.end()
    }
}

/// A dynamics model one can choose.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSummary {
    /// The name to choose it by.
    pub name: String,
    /// What it is, in a few words.
    pub about: String,
    /// What was found when it was measured.
    pub evaluation: Option<Arc<Evaluation>>,
}

/// A run and its curves.
#[derive(Debug, Clone)]
pub struct RunSummary {
    /// Name of its folder.
    pub name: String,
    /// Its folder.
    pub path: PathBuf,
    /// Its settings.
    pub config: Arc<RunConfig>,
    /// Words that people find it by.
    pub tags: Vec<String>,
    /// What people wrote about it.
    pub note: String,
    /// Its log is being read; otherwise only its last state is known.
    pub opened: bool,
    /// A thread of this program trains it.
    pub active: bool,
    /// It waits until a core is free for it.
    pub queued: bool,
    /// The task's name.
    pub task: String,
    /// Method, threshold and seed in words, as in legends.
    pub label: String,
    /// Name of the method.
    pub method: &'static str,
    /// Master seed.
    pub seed: u64,
    /// Subgoals of its task.
    pub subgoals: usize,
    /// Episodes when it is finished.
    pub episodes: u64,
    /// What it is doing.
    pub state: RunState,
    /// What the trainer does before the first episode, in words: see [`Phase::preparation`](crate::trainer::Phase).
    pub preparing: Option<String>,
    /// What came of the practice before the first episode, as far as it was read.
    pub practised: Option<Practised>,
    /// Episodes finished.
    pub done: u64,
    /// Share of the latest episodes that reached the goal, as far as it is known.
    pub success: Option<f32>,
    /// One value an episode for every metric, as far as they were read.
    pub curves: Arc<Curves>,
    /// Greedy evaluations: episodes finished, share of successes.
    pub evaluations: Vec<(u64, f32)>,
    /// Where somebody interfered with it, as far as it was read.
    pub marks: Vec<Mark>,
    /// Episodes a second; None while it is too early to say.
    pub rate: Option<f64>,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// When it happened: local time of day.
    pub time: jiff::civil::Time,
    /// How much it matters.
    pub level: Level,
    /// What happened.
    pub text: String,
}

/// How much a line matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// It happened.
    Info,
    /// It worked, as asked.
    Good,
    /// It needs attention.
    Warning,
    /// It failed.
    Error,
}

impl ViewModel {
    /// The run in a folder.
    pub fn run(&self, path: &Path) -> Option<&RunSummary> {
        self.runs.iter().map(|run| &**run).find(|run| run.path == path)
    }

    /// The run that is being watched.
    pub fn watched_run(&self) -> Option<&RunSummary> {
        self.watched.as_ref().map(|watched| &*watched.run)
    }

    /// Name of what predicts the rollouts of guidance.
    pub fn model(&self) -> String {
        String::from(self.settings.prior.clone())
    }

    /// The objects of the task as it is being edited.
    pub fn objects(&self) -> Objects<'_> {
        Objects { task: &self.task, proposed: &self.proposed }
    }

    /// Runs that keep this program busy, now or later; one that is paused does not.
    pub fn training_runs(&self) -> impl Iterator<Item = &RunSummary> {
        self.active_runs().filter(|run| run.queued || run.state != RunState::Paused)
    }

    /// How it stands with what is trained here, in a few words each: runs, the groups they belong to where that
    /// says more, speed, time left of all of them; none if nothing is.
    pub fn queue(&self) -> Vec<String> {
        let (mut training, mut queued, mut left, mut rate) = (0, 0, 0, 0.0);
        // A run that is not grouped yet counts alone.
        let (mut groups, mut single) = (HashSet::new(), 0);
        for run in self.training_runs() {
            match self.groups.of(&run.path).filter(|group| group.is_many()) {
                Some(group) => _ = groups.insert(std::ptr::from_ref(group)),
                None => single += 1,
            }
            *(if run.queued { &mut queued } else { &mut training }) += 1;
            left += run.episodes.saturating_sub(run.done);
            rate += run.rate.filter(|_| !run.queued).unwrap_or(0.0);
        }
        let count = |count: usize, word: &str| Some(format!("{count} {word}")).filter(|_| count > 0);
        let speed = Some(format!("{rate:.1} episodes/s")).filter(|_| rate > 0.0);
        let time = Some(format!("{} left", span(left as f64 / rate))).filter(|_| rate > 0.0);
        let of_groups = match groups.len() + single {
            1 => "in 1 group".to_owned(),
            several => format!("in {several} groups"),
        };
        let of_groups = Some(of_groups).filter(|_| !groups.is_empty());
        [count(training, "training"), count(queued, "queued"), of_groups, speed, time].into_iter().flatten().collect()
    }

    /// Runs this program is training or going to train.
    pub fn active_runs(&self) -> impl Iterator<Item = &RunSummary> {
        self.runs.iter().map(|run| &**run).filter(|run| run.active || run.queued)
    }
}

impl RunSummary {
    /// What the settings of a run say of it; nothing of its log has been read.
    pub fn new(path: &Path, config: Arc<RunConfig>, state: RunState) -> Self {
        Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            path: path.to_owned(),
            opened: false,
            active: false,
            queued: false,
            task: config.task.name.clone(),
            label: run_label(&config),
            method: config.method.name(),
            seed: config.seed,
            subgoals: config.task.subgoals.len(),
            episodes: u64::from(config.episodes),
            state,
            preparing: None,
            practised: None,
            done: 0,
            success: None,
            curves: Arc::default(),
            evaluations: Vec::new(),
            marks: marks(&config, &[]),
            rate: None,
            tags: Vec::new(),
            note: String::new(),
            config,
        }
    }

    /// One word for what it is doing.
    pub fn state_word(&self) -> &'static str {
        if self.queued { "queued" } else { self.state.name() }
    }

    /// How often the practice before the first episode reached each stage, in a few words.
    pub fn practice_in_short(&self) -> Option<String> {
        let Practised { rollouts, reached, .. } = self.practised.as_ref()?;
        let stages: Vec<String> = reached.iter().zip(rollouts).map(|(hit, all)| format!("{hit}/{all}")).collect();
        Some(format!("reached {}", stages.join(", ")))
    }

    /// Seconds until the run is finished at the present rate.
    pub fn seconds_left(&self) -> Option<f64> {
        let rate = self.rate.filter(|rate| *rate > 0.0 && self.state == RunState::Running)?;
        Some(self.episodes.saturating_sub(self.done) as f64 / rate)
    }

    /// For each subgoal whether each episode reached it, as 1 and 0.
    pub fn subgoal_hits(&self) -> Vec<Vec<f32>> {
        let shares = self.curves.get(Metric::SubgoalShare);
        // Subgoals count in order: so many of them are the first so many.
        let reached = |subgoal: usize| {
            let least = (subgoal as f32 + 0.5) / self.subgoals as f32;
            shares.iter().map(|share| f32::from(*share > least)).collect()
        };
        (0..self.subgoals).map(reached).collect()
    }

    /// The latest finite value of a metric.
    pub fn latest(&self, metric: Metric) -> Option<f32> {
        self.curves.get(metric).iter().rev().copied().find(|value| value.is_finite())
    }
}
