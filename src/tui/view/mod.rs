//! The view model: what the screens show, as plain data. Screens are functions of the view model and
//! their own state, so they can be tested without a session or a thread.

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
pub use subject::{AgentView, Choice, ComparedEpisode, Subject};
pub use system::System;
pub use task_model::TaskModel;
pub use workspace::{SessionWorkspace, Workspace};

use crate::tui::scene::Objects;
use mge_agent::Ddpg;
use mge_dynamics::Evaluation;
use mge_env::{EndReason, Snapshot};
use mge_guidance::ActionPrior;
use mge_run::{Metric, Practised, RunState};
use mge_task::{Region, Task};
use mge_trainer::{RunConfig, Trace};
use mge_workbench::{PriorState, run_label};

use playback::Episode;

/// The view model: everything the screens show.
#[derive(Debug, Clone)]
pub struct ViewModel {
    /// The edited task.
    pub task: Arc<Task>,
    /// Its file, if it is not a shipped one.
    pub file: Option<PathBuf>,
    /// The task differs from its file.
    pub dirty: bool,
    /// Subgoals proposed for the task.
    pub proposed: Vec<Region>,
    /// Proposals tried so far and their maximum number, while subgoals are being searched for.
    pub proposing: Option<(usize, usize)>,
    /// The settings of the next run.
    pub settings: RunConfig,
    /// The number of episodes to which continuing extends a run that has fewer, if it was set.
    pub extends_to: Option<u32>,
    /// The folder for runs.
    pub folder: PathBuf,
    /// The latest clusters computed for the edited task, possibly before its last edits.
    pub prior: Option<Arc<ActionPrior>>,
    /// Whether these clusters match the task and the settings.
    pub prior_state: PriorState,
    /// Why the latest computation of clusters failed.
    pub prior_failure: Option<String>,
    /// The available dynamics models.
    pub models: Vec<ModelSummary>,
    /// Past and current runs, the latest last.
    pub runs: Vec<Arc<RunSummary>>,
    /// The latest grouping of the runs.
    pub groups: Arc<Grouping>,
    /// The folder contents of the run last requested.
    pub details: Option<Arc<RunDetails>>,
    /// Runs in the folder that have not been read yet; at least 1 while the folder is being read.
    pub runs_unread: usize,
    /// Number of damaged runs in the folder, which the log describes.
    pub runs_damaged: usize,
    /// The watched run.
    pub watched: Option<Watched>,
    /// The episode a person plays.
    pub hand: HandEpisode,
    /// The current work on a dynamics model and its progress as a share.
    pub model_work: Option<(String, Option<f32>)>,
    /// Losses of the model trained last, one per epoch.
    pub model_losses: Arc<Vec<f32>>,
    /// The result of the latest work on a dynamics model.
    pub model_outcome: Option<Result<String, String>>,
    /// Figures written in this session.
    pub figures: Vec<PathBuf>,
    /// Processor and memory use of the workbench.
    pub system: System,
    /// The latest lines of the log, oldest first.
    pub log: Vec<LogLine>,
    /// Number of log lines so far, including those no longer kept.
    pub log_total: usize,
}

/// The watched run, with the data that only an open run has.
#[derive(Debug, Clone)]
pub struct Watched {
    /// The run.
    pub run: Arc<RunSummary>,
    /// The task it is trained on.
    pub task: Arc<Task>,
    /// Its action clusters.
    pub prior: Option<Arc<ActionPrior>>,
    /// Its latest known episode.
    pub live: Option<Live>,
    /// The agent of the past episode last requested.
    pub agent: Option<PastAgent>,
    /// The latest requested episode of its greedy policy.
    pub greedy: Option<Arc<Episode>>,
}

/// The latest episode of a run.
#[derive(Debug, Clone)]
pub struct Live {
    /// The episode.
    pub episode: Arc<Episode>,
    /// Actor and critic after the episode, while this program trains the run.
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
    /// Why the episode has ended, if it has.
    pub fn end(&self) -> Option<EndReason> {
        self.snapshot.end()
    }
}

/// An available dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSummary {
    /// The name that selects it.
    pub name: String,
    /// Short description.
    pub about: String,
    /// Its evaluation, if there is one.
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
    /// Tags given by users.
    pub tags: Vec<String>,
    /// Note written by users.
    pub note: String,
    /// It is open in the session; otherwise only its last state is known.
    pub opened: bool,
    /// A thread of this program trains it.
    pub active: bool,
    /// It waits for a free core.
    pub queued: bool,
    /// Method, threshold and seed in words, as in legends.
    pub label: String,
    /// Its state.
    pub state: RunState,
    /// What the trainer does before the first episode, in words: see [`Phase::preparation`](mge_trainer::Phase).
    pub preparing: Option<String>,
    /// Results of the practice before the first episode, if they have been read.
    pub practised: Option<Practised>,
    /// The present need for exploration of each stage, the goal last, 0 to 1; empty if it is unknown or the epsilon
    /// schedule does not depend on it.
    pub needs: Vec<f32>,
    /// Number of finished episodes.
    pub done: u64,
    /// Share of the latest episodes that reached the goal, if known.
    pub success: Option<f32>,
    /// One value per episode for every metric, as far as they have been read.
    pub curves: Arc<Curves>,
    /// Greedy evaluations: episodes finished by then, share of successes.
    pub evaluations: Vec<(u64, f32)>,
    /// Interventions, as far as they have been read.
    pub marks: Vec<Mark>,
    /// Episodes per second; None until there is enough data.
    pub rate: Option<f64>,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// Local time of day.
    pub time: jiff::civil::Time,
    /// Severity.
    pub level: Level,
    /// What happened.
    pub text: String,
}

/// The severity of a line of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Information.
    Info,
    /// Success.
    Good,
    /// Something needs attention.
    Warning,
    /// A failure.
    Error,
}

impl ViewModel {
    /// The run in a folder.
    pub fn run(&self, path: &Path) -> Option<&RunSummary> {
        self.runs.iter().map(|run| &**run).find(|run| run.path == path)
    }

    /// The watched run.
    pub fn watched_run(&self) -> Option<&RunSummary> {
        self.watched.as_ref().map(|watched| &*watched.run)
    }

    /// Name of the model that predicts the rollouts of guidance.
    pub fn model_name(&self) -> String {
        self.settings.prior.name()
    }

    /// The objects of the edited task.
    pub fn objects(&self) -> Objects<'_> {
        Objects { task: &self.task, proposed: &self.proposed }
    }

    /// Runs that this program is training or will train, without paused ones.
    pub fn training_runs(&self) -> impl Iterator<Item = &RunSummary> {
        self.active_runs().filter(|run| run.queued || run.state != RunState::Paused)
    }

    /// The state of this program's trainings in short phrases: number of runs, number of groups if a group has
    /// several runs, speed, and time left for all of them. Empty without trainings.
    pub fn queue(&self) -> Vec<String> {
        let (mut training, mut queued, mut left, mut rate) = (0, 0, 0, 0.0);
        // A run that is not grouped yet counts as a group of its own.
        let (mut groups, mut single) = (HashSet::new(), 0);
        for run in self.training_runs() {
            match self.groups.of(&run.path).filter(|group| group.is_many()) {
                Some(group) => _ = groups.insert(std::ptr::from_ref(group)),
                None => single += 1,
            }
            *(if run.queued { &mut queued } else { &mut training }) += 1;
            left += run.episodes().saturating_sub(run.done);
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

    /// Runs that this program is training or will train.
    pub fn active_runs(&self) -> impl Iterator<Item = &RunSummary> {
        self.runs.iter().map(|run| &**run).filter(|run| run.active || run.queued)
    }
}

impl RunSummary {
    /// A summary from the settings of a run, before its log is read.
    pub fn new(path: &Path, config: Arc<RunConfig>, state: RunState) -> Self {
        Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            path: path.to_owned(),
            opened: false,
            active: false,
            queued: false,
            label: run_label(&config),
            state,
            preparing: None,
            practised: None,
            needs: Vec::new(),
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

    /// Configured number of episodes.
    pub fn episodes(&self) -> u64 {
        u64::from(self.config.episodes)
    }

    /// The rolling success in percent, or a dash before the first episode.
    pub fn success_text(&self) -> String {
        self.success.map_or_else(|| "-".to_owned(), |success| format!("{:.0} %", 100.0 * success))
    }

    /// Its state in one word.
    pub fn state_word(&self) -> &'static str {
        if self.queued { "queued" } else { self.state.name() }
    }

    /// How often the practice before the first episode reached each stage, in a short phrase.
    pub fn practice_in_short(&self) -> Option<String> {
        let Practised { rollouts, reached, .. } = self.practised.as_ref()?.in_short();
        let stages: Vec<String> = reached.iter().zip(&rollouts).map(|(hit, all)| format!("{hit}/{all}")).collect();
        Some(format!("reached {}", stages.join(", ")))
    }

    /// The present need for exploration of each stage, in a short phrase.
    pub fn needs_in_short(&self) -> Option<String> {
        let needs: Vec<String> = self.needs.iter().map(|need| format!("{:.0} %", 100.0 * need)).collect();
        (!needs.is_empty()).then(|| needs.join(", "))
    }

    /// Seconds until the run is finished at the current rate.
    pub fn seconds_left(&self) -> Option<f64> {
        let rate = self.rate.filter(|rate| *rate > 0.0 && self.state == RunState::Running)?;
        Some(self.episodes().saturating_sub(self.done) as f64 / rate)
    }

    /// For each subgoal whether each episode reached it, as 1 and 0; empty for a run of an earlier version on several
    /// tasks, which differ in their subgoals.
    pub fn subgoal_hits(&self) -> Vec<Vec<f32>> {
        if self.config.has_removed_tasks() {
            return Vec::new();
        }
        let shares = self.curves.get(Metric::SubgoalShare);
        let subgoals = self.config.task.subgoals.len();
        // Subgoals are reached in order, so the share tells which ones were reached.
        let reached = |subgoal: usize| {
            let least = (subgoal as f32 + 0.5) / subgoals as f32;
            shares.iter().map(|share| f32::from(*share > least)).collect()
        };
        (0..subgoals).map(reached).collect()
    }

    /// The latest finite value of a metric.
    pub fn latest(&self, metric: Metric) -> Option<f32> {
        self.curves.get(metric).iter().rev().copied().find(|value| value.is_finite())
    }
}
