//! The view model: what the screens show, as plain data. Screens are functions of the view model and
//! their own state, so they can be tested without a session or a thread.

pub mod playback;
mod subject;
mod workspace;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use subject::{AgentView, Choice, Subject, TaskModel};
pub use workspace::{SessionWorkspace, Workspace};

use crate::tui::scene::Objects;
use mge_agent::Ddpg;
pub use mge_base::text::span;
use mge_guidance::ActionPrior;
use mge_run::RunState;
use mge_task::{Region, Task};
use mge_trainer::RunConfig;
pub use mge_workbench::listing::{
    Curves, GroupCurves, Grouping, ModelSummary, RunGroup, RunSummary, XAxis, comparable, cost_of_an_episode, scores_of,
};
use mge_workbench::{HandPlay, PriorState, SavedAgent};

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
    /// The tasks that can be opened by their names.
    pub tasks: Vec<(String, Task)>,
    /// The available dynamics models.
    pub models: Vec<ModelSummary>,
    /// Past and current runs, the latest last.
    pub runs: Vec<Arc<RunSummary>>,
    /// The latest grouping of the runs.
    pub groups: Arc<Grouping>,
    /// Runs in the folder that have not been read yet; at least 1 while the folder is being read.
    pub runs_unread: usize,
    /// Why each damaged run in the folder cannot be read, which the log tells.
    pub damaged: Vec<String>,
    /// The watched run.
    pub watched: Option<Watched>,
    /// The episode a person plays.
    pub hand: HandPlay,
    /// The current work on a dynamics model and its progress as a share.
    pub model_work: Option<(String, Option<f32>)>,
    /// The fork that is being made and its progress as a share.
    pub forking: Option<(String, Option<f32>)>,
    /// Figures written in this session.
    pub figures: Vec<PathBuf>,
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
    /// Its action clusters.
    pub prior: Option<Arc<ActionPrior>>,
    /// Its latest known episode.
    pub live: Option<Live>,
    /// The agent of the past episode last requested.
    pub agent: Option<PastAgent>,
    /// The latest requested episode of its greedy policy.
    pub greedy: Option<Arc<Episode>>,
}

/// The agent of the checkpoint nearest to a past episode, or why there is none.
pub type PastAgent = Result<Arc<SavedAgent>, String>;

/// The latest episode of a run.
#[derive(Debug, Clone)]
pub struct Live {
    /// The episode.
    pub episode: Arc<Episode>,
    /// Actor and critic after the episode, while this program trains the run.
    pub networks: Option<Arc<Ddpg>>,
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Information.
    #[default]
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

    /// The objects of the edited task.
    pub fn objects(&self) -> Objects<'_> {
        Objects { task: &self.task, proposed: &self.proposed }
    }

    /// Runs that this program is training or will train, without those that are paused.
    pub fn training_runs(&self) -> impl Iterator<Item = &RunSummary> {
        self.active_runs().filter(|run| run.queued || run.state != RunState::Paused)
    }

    /// Runs that this program is training or will train.
    pub fn active_runs(&self) -> impl Iterator<Item = &RunSummary> {
        // The thread of a finished one only ends.
        let is_active = |run: &RunSummary| run.active && run.state != RunState::Finished;
        self.runs.iter().map(|run| &**run).filter(move |run| run.queued || is_active(run))
    }
}
