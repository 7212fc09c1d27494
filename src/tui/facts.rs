//! What the screens show, as plain data: screens are functions of this and of the
//! screen's own state, and need neither a session nor a thread to be tested.

use std::path::PathBuf;
use std::sync::Arc;

use crate::guidance::{ActionPrior, EpsilonSchedule};
use crate::task::Task;

use super::metric::{Curves, Metric};
use super::playback::Episode;

/// Everything there is to see.
#[derive(Debug, Clone)]
pub struct Facts {
    /// The task as it is being edited.
    pub task: Arc<Task>,
    /// The task differs from its file.
    pub dirty: bool,
    /// An edit can be undone.
    pub can_undo: bool,
    /// An undone edit can be done again.
    pub can_redo: bool,
    /// What the next run will use.
    pub settings: Settings,
    /// The clusters of the task.
    pub prior: Option<Arc<ActionPrior>>,
    /// Whether the clusters fit the task as it is.
    pub prior_state: PriorState,
    /// Dynamics models one can choose, first the chosen one's name.
    pub models: Vec<ModelFacts>,
    /// Past and running runs, the latest last.
    pub runs: Vec<RunFacts>,
    /// The run that started last in this session.
    pub current: Option<usize>,
    /// The latest finished training episode.
    pub live: Option<Arc<Episode>>,
    /// The episode a person plays.
    pub played: Option<Arc<Episode>>,
    /// Figures written in this session.
    pub figures: Vec<PathBuf>,
    /// What happened, oldest first.
    pub log: Vec<LogLine>,
}

/// What the next run will use.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// `ddpg` or `ddpg-mge`.
    pub method: String,
    /// Master seed.
    pub seed: u64,
    /// Episodes of a run.
    pub episodes: u64,
    /// Epsilon threshold by episode.
    pub epsilon: EpsilonSchedule,
    /// What predicts the rollouts of guidance.
    pub model: String,
    /// Where figures and runs go.
    pub out: PathBuf,
}

/// Whether the clusters fit the task as it is.
#[derive(Debug, Clone, PartialEq)]
pub enum PriorState {
    /// There are none.
    Absent,
    /// They are being computed.
    Building {
        /// Stages finished.
        stage: usize,
        /// Stages of the task.
        stages: usize,
    },
    /// They belong to the task as it is.
    Fresh,
    /// The task was edited since.
    Stale,
    /// They could not be computed.
    Failed(String),
}

/// A dynamics model one can choose.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFacts {
    /// The name to choose it by.
    pub name: String,
    /// Its tool set, and how good it is, in a few words.
    pub about: String,
    /// It is chosen.
    pub chosen: bool,
    /// It knows all tools of the task.
    pub fits: bool,
}

/// A run and its curves.
#[derive(Debug, Clone)]
pub struct RunFacts {
    /// Short name, its directory's.
    pub name: String,
    /// The task's name.
    pub task: String,
    /// `ddpg` or `ddpg-mge`.
    pub method: String,
    /// Master seed.
    pub seed: u64,
    /// Episodes when it is finished.
    pub episodes: u64,
    /// What it is doing.
    pub state: RunState,
    /// One value an episode for every metric.
    pub curves: Curves,
    /// Greedy evaluations: episodes finished, share of successes.
    pub evaluations: Vec<(u64, f32)>,
    /// Episodes a second; None while it is too early to tell.
    pub rate: Option<f64>,
}

/// What a run is doing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunState {
    /// Waiting for a free core.
    Queued,
    /// Training.
    Running,
    /// Waiting to be resumed.
    Paused,
    /// All episodes are done.
    Finished,
    /// Somebody ended it early; it can be resumed.
    Stopped,
    /// An error ended it.
    Failed(String),
    /// Its process died; it can be resumed from its last checkpoint.
    Interrupted,
}

impl RunState {
    /// One word for people.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Stopped => "stopped",
            Self::Failed(_) => "failed",
            Self::Interrupted => "interrupted",
        }
    }

    /// A thread is at work on it.
    pub fn is_active(&self) -> bool {
        matches!(self, Self::Queued | Self::Running | Self::Paused)
    }
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
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

impl Facts {
    /// The run that is being watched: the one that started last.
    pub fn current_run(&self) -> Option<&RunFacts> {
        self.current.and_then(|index| self.runs.get(index))
    }

    /// Runs a thread is at work on.
    pub fn active_runs(&self) -> impl Iterator<Item = &RunFacts> {
        self.runs.iter().filter(|run| run.state.is_active())
    }
}

impl RunFacts {
    /// Episodes finished.
    pub fn done(&self) -> u64 {
        self.curves.len() as u64
    }

    /// Seconds until the run is finished at the present rate.
    pub fn seconds_left(&self) -> Option<f64> {
        let rate = self.rate.filter(|rate| *rate > 0.0 && self.state == RunState::Running)?;
        Some(self.episodes.saturating_sub(self.done()) as f64 / rate)
    }

    /// The latest finite value of a metric.
    pub fn latest(&self, metric: Metric) -> Option<f32> {
        self.curves.get(metric).iter().rev().copied().find(|value| value.is_finite())
    }
}
