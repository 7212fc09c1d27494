//! A run and its curves, as screens show it.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use super::{Curves, XAxis};
use crate::run_label;
use mge_run::{Event, Metric, RunDirectory, RunHistory, RunState};
use mge_trainer::RunConfig;

/// A run and its curves.
#[derive(Debug, Clone, Default)]
pub struct RunSummary {
    /// The name that users gave it, or else that of its folder.
    pub name: String,
    /// Its folder.
    pub path: PathBuf,
    /// Its settings; the epsilon schedule is the one in force, as far as its log has been read.
    pub config: Arc<RunConfig>,
    /// The latest change of its epsilon or clusters during the training, as far as its log has been read: it is no longer
    /// like the runs with the same settings.
    pub changed: Option<String>,
    /// Note written by users.
    pub note: String,
    /// It is open in the session; otherwise only its last state is known.
    pub opened: bool,
    /// It is a run of the session, in another folder than that for runs.
    pub elsewhere: bool,
    /// A thread of this program trains it.
    pub active: bool,
    /// It waits for a free core.
    pub queued: bool,
    /// Its log was read and is damaged: it belongs to no group, as it is left out of reports.
    pub damaged: bool,
    /// Method, threshold and seed in words, as in legends.
    pub label: String,
    /// Its state.
    pub state: RunState,
    /// What the trainer does before the first episode, in words: see [`Phase::preparation`](mge_trainer::Phase).
    pub preparing: Option<String>,
    /// Number of finished episodes.
    pub done: u64,
    /// Share of the latest episodes that reached the goal, if known.
    pub success: Option<f64>,
    /// One value per episode for every metric, as far as they have been read.
    pub curves: Arc<Curves>,
    /// When its folder was made, if that is known.
    pub made: Option<SystemTime>,
    /// When it began, in seconds since 1970, as far as that has been read.
    pub began: Option<f64>,
    /// The seconds that an episode of its rest will take, as others tell.
    pub expected: Option<f64>,
    /// Greedy evaluations: episodes finished by then, share of successes.
    pub evaluations: Vec<(u64, f32)>,
}

impl RunSummary {
    /// A summary from the settings of a run, before its log is read.
    pub fn new(path: &Path, config: Arc<RunConfig>, state: RunState) -> Self {
        Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            path: path.to_owned(),
            label: run_label(&config),
            state,
            config,
            ..Self::default()
        }
    }

    /// The same run with what its log says, and the curves of that.
    pub(crate) fn with_log(self, log: &RunHistory, curves: Arc<Curves>) -> Self {
        let evaluations = log.evaluations.iter().map(|e| (e.episode, e.success as f32)).collect();
        let changed =
            log.interventions.iter().rev().find(|event| {
                matches!(event, Event::ScheduleChanged { .. } | Event::ClustersChanged { given: true, .. })
            });
        let config = self.config.in_force(&log.interventions).map_or(self.config, Arc::new);
        let (label, changed) = (run_label(&config), changed.map(Event::to_string));
        // The log of a fork begins with that of the run it comes from.
        let began = match (&config.fork, self.made) {
            (Some(_), made) => made.and_then(|made| Some(made.duration_since(UNIX_EPOCH).ok()?.as_secs_f64())),
            _ => log.began,
        };
        Self { config, label, curves, evaluations, changed, began, ..self }
    }

    /// The same run with what the log in its folder says, unless that is missing or damaged; without curves.
    #[must_use]
    pub fn with_whole_log(self) -> Self {
        let log = RunHistory::read(&RunDirectory::at(&self.path)).unwrap_or_default();
        self.with_log(&log, Arc::default())
    }

    /// The name of its folder.
    pub fn folder(&self) -> Cow<'_, str> {
        self.path.file_name().unwrap_or_default().to_string_lossy()
    }

    /// Configured number of episodes.
    pub fn episodes(&self) -> u64 {
        u64::from(self.config.episodes)
    }

    /// The name that users gave it, if they gave one.
    pub fn given_name(&self) -> Option<&str> {
        Some(&*self.name).filter(|name| self.path.file_name().is_some_and(|folder| *folder != **name))
    }

    /// Whether its success ended it.
    pub fn is_solved(&self) -> bool {
        self.success.is_some_and(|success| self.config.is_solved(self.done, success))
    }

    /// Its state in one word.
    pub fn state_word(&self) -> &'static str {
        match &self.state {
            _ if self.queued => "queued",
            state => state.name(),
        }
    }

    /// Episodes per second, while it is trained and once there is enough data.
    pub fn rate(&self) -> Option<f64> {
        self.curves.pace().filter(|rate| *rate > 0.0 && self.state == RunState::Running)
    }

    /// Episodes a second of the rest: as other runs tell, and the more of its own rate the more of it is done. Without
    /// others its rate, but not in the first two fifths, in which it becomes slower and faster by learning.
    pub fn pace(&self) -> Option<f64> {
        let share = self.done as f64 / self.episodes() as f64;
        let told = self.expected.map(|seconds| 1.0 / seconds);
        let own = self.rate().filter(|_| told.is_some() || share >= 0.4);
        told.zip(own).map(|(told, own)| told.powf(1.0 - share) * own.powf(share)).or(told).or(own)
    }

    /// Seconds until the run is finished.
    pub fn seconds_left(&self) -> Option<f64> {
        Some(self.episodes().saturating_sub(self.done) as f64 / self.pace()?)
    }

    /// The seconds that it has been trained, as far as they have been read.
    pub fn seconds(&self) -> Option<f64> {
        Some(*self.curves.positions(XAxis::Time).last()? as f64 / 1000.0)
    }

    /// Episodes a second: now, or else on the whole.
    pub fn speed(&self) -> Option<f64> {
        let whole = || self.seconds().filter(|time| *time > 0.0).map(|time| self.done as f64 / time);
        self.rate().or_else(whole)
    }

    /// The latest finite value of a metric.
    pub fn latest(&self, metric: Metric) -> Option<f32> {
        self.curves.get(metric).iter().rev().copied().find(|value| value.is_finite())
    }
}
