//! The session behind the screens: view models out, commands in.

mod refresh;
#[cfg(test)]
mod tests;

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::details::Details;
use super::groups::Grouper;
use super::histories::Histories;
use super::models::Models;
use super::past::{AgentReader, LastEpisode, episode_of};
use super::playback::Episode;
use super::rate::Rate;
use super::run_index::RunIndex;
use super::system::{Meter, System};
use super::{Level, LogLine, RunSummary, TaskModel, ViewModel};
use crate::tui::widgets::preview::PreviewJob;
use mge_results::Composition;
use mge_run::{Event, RunState};
use mge_task::Task;
use mge_trainer::{Phase, PriorSource};
use mge_workbench::{Command, FigureKind, Notice, RunView, SavedRun, Session, command};
use refresh::hand_episode;

/// What the screens need from a session.
pub trait Workspace {
    /// The view model.
    fn view(&self) -> &ViewModel;
    /// Takes over results of background work. True if the view model has changed.
    fn poll(&mut self) -> bool;
    /// Carries out a command and returns a message.
    ///
    /// # Errors
    /// What is wrong, in one line.
    fn apply(&mut self, command: Command) -> Result<String, String>;
    /// Requests the next finished training episode.
    fn request_live(&self);
    /// The model of the current settings for a task.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn model_for(&mut self, task: &Arc<Task>) -> Result<TaskModel, String>;
    /// Replays a past episode of the run in a folder.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn past_episode(&self, run: &Path, episode: u64) -> Result<Arc<Episode>, String>;
    /// Requests the curves of the runs in these folders, opened or not.
    fn request_curves(&mut self, runs: Vec<PathBuf>);
    /// Requests the contents of a run's folder.
    fn request_details(&mut self, run: &Path);
    /// Makes the groups with a label the baseline, or unpins them if they are it already; returns a message.
    fn pin_baseline(&mut self, label: &str) -> String;
    /// Requests the agent of the watched run from the checkpoint nearest to an episode, counted from 1. It
    /// appears in the view model once it has been read.
    fn request_agent(&mut self, episode: u64);
    /// A figure of the current state.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<PreviewJob, String>;
    /// Looks for new and changed runs in the folder of runs, in the background.
    fn look_for_runs(&mut self);
    /// Adds a line to the log.
    fn log(&mut self, level: Level, text: String);
}

/// Time after the latest command before outdated clusters are recomputed.
const RECOMPUTE_DELAY: Duration = Duration::from_millis(700);
/// Minimum time between two refreshes for frequent events such as episodes.
const REFRESH: Duration = Duration::from_millis(200);
/// Number of log lines kept.
const LOG: usize = 2000;

/// A session and its view model.
pub struct SessionWorkspace {
    session: Session,
    /// Which commands are carried out; the others are refused.
    allow: fn(&Command) -> bool,
    view: ViewModel,
    rates: HashMap<PathBuf, Rate>,
    models: Models,
    /// The model last requested, with the source and task it depends on.
    model: Option<(PriorSource, Arc<Task>, Result<TaskModel, String>)>,
    index: RunIndex,
    /// Runs that were in the session before they were found in the folder; they are listed last.
    begun: HashSet<PathBuf>,
    last: LastEpisode,
    agents: AgentReader,
    histories: Histories,
    grouper: Grouper,
    details: Details,
    meter: Meter,
    /// Runs trained by other processes have been reported.
    others_reported: bool,
    /// Why runs of the folder cannot be read, as far as it was logged.
    damaged: Vec<String>,
    /// When the latest command was carried out.
    touched: Instant,
    /// When the view was last refreshed.
    refreshed: Instant,
    /// The view lacks some changes.
    is_stale: bool,
}

impl SessionWorkspace {
    /// The workspace of a session.
    pub fn new(session: Session) -> Self {
        let task = Arc::new(session.task().clone());
        let mut models = Models::default();
        let view = ViewModel {
            file: None,
            dirty: false,
            proposed: Vec::new(),
            proposing: None,
            settings: session.config().clone(),
            extends_to: session.extends_to(),
            folder: session.folder().to_owned(),
            prior: None,
            prior_state: session.prior_state(),
            prior_failure: None,
            models: models.summaries(session.task()),
            runs: Vec::new(),
            groups: Arc::default(),
            details: None,
            runs_unread: 0,
            runs_damaged: 0,
            watched: None,
            hand: hand_episode(&session, &task, None),
            model_work: None,
            model_losses: Arc::default(),
            model_outcome: None,
            figures: Vec::new(),
            system: System::default(),
            log: Vec::new(),
            log_total: 0,
            task,
        };
        let index = RunIndex::new();
        let mut workspace = Self {
            session,
            allow: |_| true,
            view,
            rates: HashMap::new(),
            models,
            model: None,
            index,
            begun: HashSet::new(),
            last: LastEpisode::default(),
            agents: AgentReader::default(),
            histories: Histories::new(),
            grouper: Grouper::default(),
            details: Details::default(),
            meter: Meter::default(),
            others_reported: false,
            damaged: Vec::new(),
            touched: Instant::now(),
            refreshed: Instant::now(),
            is_stale: false,
        };
        workspace.refresh();
        workspace
    }

    /// The workspace with only some commands allowed.
    #[cfg(any(test, fuzzing))]
    pub fn allowing(self, allow: fn(&Command) -> bool) -> Self {
        Self { allow, ..self }
    }

    /// Recomputes clusters that an edit has made out of date, after a moment without commands.
    fn renew_clusters(&mut self) {
        if self.touched.elapsed() > RECOMPUTE_DELAY && self.session.clusters_are_outdated() {
            // The result appears in the log and on screen.
            let _ = self.apply(command::Clusters(None).into());
        }
    }

    /// Reports, once, which runs other processes are training.
    fn report_others(&mut self) {
        if self.others_reported || self.index.unread() > 0 {
            return;
        }
        self.others_reported = true;
        let is_elsewhere = |run: &&Arc<RunSummary>| {
            let is_ours = self.session.runs().iter().any(|own| own.directory().path() == run.path && own.is_active());
            matches!(run.state, RunState::Running | RunState::Paused) && !is_ours
        };
        let names: Vec<&str> = self.index.runs().iter().filter(is_elsewhere).map(|run| &*run.name).collect();
        if !names.is_empty() {
            let text = format!("trained by other processes: {}; the Runs screen controls them", names.join(", "));
            self.log(Level::Good, text);
        }
    }

    /// Logs why runs of the folder cannot be read, each reason once.
    fn report_damaged(&mut self) {
        let known = std::mem::replace(&mut self.damaged, self.index.damaged().to_vec());
        let news: Vec<String> = self.damaged.iter().filter(|reason| !known.contains(reason)).cloned().collect();
        news.into_iter().for_each(|reason| self.log(Level::Warning, reason));
    }

    /// Logs a notice of the session.
    fn note(&mut self, notice: &Notice) {
        match notice {
            Notice::Finished { command, outcome } => self.note_outcome(command, outcome),
            Notice::Warning(text) => self.log(Level::Warning, text.clone()),
            Notice::Run { event: Event::EpisodeFinished(_), .. } | Notice::Progress { .. } | Notice::Changed => {}
            Notice::Run { run, event } => {
                let level = match event {
                    Event::Failed { .. } => Level::Error,
                    Event::Stopped { .. } => Level::Warning,
                    Event::Finished { .. } => Level::Good,
                    _ => Level::Info,
                };
                let name = self.session.run_numbered(*run).map_or_else(String::new, RunView::name);
                self.log(level, format!("{name}: {event}"));
            }
        }
    }

    /// Logs the outcome of a background command and updates the view for it.
    fn note_outcome(&mut self, command: &Command, outcome: &Result<String, String>) {
        match command {
            Command::Clusters(_) => self.view.prior_failure = outcome.as_ref().err().cloned(),
            Command::ModelTrain(_) | Command::ModelEvaluate(_) => {
                self.view.models = self.models.summaries(self.session.task());
                self.view.model_outcome = Some(outcome.clone());
            }
            Command::Figure(figure) if outcome.is_ok() => {
                self.view.figures.retain(|known| *known != figure.to.path);
                self.view.figures.push(figure.to.path.clone());
            }
            _ => {}
        }
        let training = self.session.run().is_some_and(RunView::is_active);
        let (level, text) = match (command, outcome) {
            // Visible on screen.
            (Command::Open(_) | Command::Continue(_), Ok(_)) => return,
            (Command::Clusters(_), Ok(report)) if training => {
                (Level::Good, format!("{report}; `guide` gives them to the running training"))
            }
            (Command::Propose(_), Ok(report)) => {
                (Level::Good, format!("{report}: accept, move or reject them on the Edit screen"))
            }
            (_, Ok(report)) => (Level::Good, report.clone()),
            (Command::Clusters(_), Err(reason)) => (Level::Error, format!("action clusters: {reason}")),
            (Command::Propose(_), Err(reason)) => (Level::Error, format!("subgoals: {reason}")),
            (_, Err(reason)) => (Level::Error, reason.clone()),
        };
        self.log(level, text);
    }
}

impl Workspace for SessionWorkspace {
    fn view(&self) -> &ViewModel {
        &self.view
    }

    fn poll(&mut self) -> bool {
        let building = self.view.prior_state;
        self.renew_clusters();
        let notices = self.session.poll();
        for notice in &notices {
            self.note(notice);
        }
        let preparing = self.session.run().is_some_and(|run| preparing(run).is_some());
        let news = [
            self.index.collect(),
            self.last.collect(),
            self.agents.collect(),
            self.histories.collect(),
            self.details.collect(),
        ];
        self.grouper.update(&self.view.runs);
        let news = self.grouper.collect() || news.contains(&true);
        if news {
            self.report_others();
            self.report_damaged();
        }
        // Measured only while training: redrawing would keep an idle screen busy.
        let is_training = self.session.runs().iter().any(|run| run.is_active() || run.is_queued());
        let is_measured = is_training && self.meter.look();
        // Frequent notices wait for the next refresh.
        let is_urgent = news || is_measured || notices.iter().any(|notice| !is_frequent(notice));
        self.is_stale |= preparing || !notices.is_empty() || building != self.session.prior_state();
        let changed = is_urgent || (self.is_stale && self.refreshed.elapsed() >= REFRESH);
        if changed {
            self.refresh();
        }
        changed
    }

    fn apply(&mut self, command: Command) -> Result<String, String> {
        if !(self.allow)(&command) {
            return Err(format!("not allowed: {command}"));
        }
        self.touched = Instant::now();
        let changes_folder = matches!(
            command,
            Command::Out(_) | Command::Note(_) | Command::Tag(_) | Command::Delete(_) | Command::Restore(_)
        );
        let outcome = self.session.apply(command).map_err(|error| error.to_string());
        if changes_folder {
            self.look_for_runs();
        }
        match &outcome {
            Ok(report) if report.is_empty() => {}
            Ok(report) => self.log(Level::Info, report.clone()),
            Err(error) => self.log(Level::Error, error.clone()),
        }
        self.refresh();
        outcome
    }

    fn request_live(&self) {
        if let Some(run) = self.session.run() {
            run.request_live();
        }
    }

    fn model_for(&mut self, task: &Arc<Task>) -> Result<TaskModel, String> {
        let source = &self.session.config().prior;
        let known = self.model.as_ref().filter(|(known, of, _)| known == source && Arc::ptr_eq(of, task));
        if let Some((.., model)) = known {
            return model.clone();
        }
        let model = TaskModel::new(source, task);
        self.model = Some((source.clone(), task.clone(), model.clone()));
        model
    }

    fn past_episode(&self, run: &Path, episode: u64) -> Result<Arc<Episode>, String> {
        let summary = self.view.run(run).ok_or("the run no longer exists")?;
        let saved = SavedRun::open(run, summary.config.clone()).map_err(|error| error.to_string())?;
        let trace = saved.past_episode(episode).map_err(|error| error.to_string())?;
        Ok(Arc::new(episode_of(run, summary.config.task_of(episode), Arc::new(trace))))
    }

    fn request_curves(&mut self, runs: Vec<PathBuf>) {
        let is_opened = |path: &PathBuf| self.session.runs().iter().any(|run| run.directory().path() == path);
        let unopened = runs.into_iter().filter(|path| !is_opened(path)).collect();
        self.histories.want(unopened);
    }

    fn request_details(&mut self, run: &Path) {
        self.details.want(run);
    }

    fn pin_baseline(&mut self, label: &str) -> String {
        match self.grouper.pin(label) {
            Some(label) => format!("groups are compared with {label}"),
            None => "groups are compared with plain DDPG, or the first method".to_owned(),
        }
    }

    fn request_agent(&mut self, episode: u64) {
        if let Some(run) = self.session.run() {
            self.agents.want(run, episode);
        }
    }

    fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<PreviewJob, String> {
        let figure = self.session.figure(kind, composition).map_err(|error| error.to_string())?;
        Ok(Box::new(move || figure(&mut |_, _| ()).map(|drawn| drawn.figure)))
    }

    fn look_for_runs(&mut self) {
        self.index.look(self.session.folder());
        self.view.runs_unread = self.index.unread();
    }

    fn log(&mut self, level: Level, text: String) {
        self.view.log.push(LogLine { time: jiff::Zoned::now().time(), level, text });
        self.view.log_total += 1;
        let more = self.view.log.len().saturating_sub(LOG);
        self.view.log.drain(..more);
    }
}

/// Whether a notice arrives many times a second during trainings and computations.
fn is_frequent(notice: &Notice) -> bool {
    matches!(notice, Notice::Progress { .. } | Notice::Changed | Notice::Run { event: Event::EpisodeFinished(_), .. })
}

/// What the trainer of a run does before its first episode, in words.
fn preparing(run: &RunView) -> Option<String> {
    run.phase().as_ref().and_then(Phase::preparation)
}
