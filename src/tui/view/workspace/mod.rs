//! The session behind the screens: view models out, commands in.

mod refresh;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::playback::{Episode, Origin};
use super::{Level, LogLine, ModelSummary, TaskModel, ViewModel};
use mge_dynamics::TaskModelConfig;
use mge_results::Composition;
use mge_run::Event;
use mge_task::Task;
use mge_trainer::{PriorSource, RunConfig, Trace};
use mge_workbench::listing::{Listing, named_tasks};
use mge_workbench::{Command, FigureJob, FigureKind, Loader, Notice, RunView, SavedAgent, SavedRun, Session, command};
use refresh::view_of;

/// What the screens need from a session.
pub trait Workspace {
    /// The view model.
    fn view(&self) -> &ViewModel;
    /// Takes over results of background work. True if the view model has changed.
    fn poll(&mut self) -> bool;
    /// Carries out a command and returns a message. Only an error is logged.
    ///
    /// # Errors
    /// What is wrong, in one line.
    fn apply(&mut self, command: Command) -> Result<String, String>;
    /// Checks commands, each after those before it, without carrying them out.
    ///
    /// # Errors
    /// Why one of them would be refused, in one line.
    fn check(&self, commands: &[Command]) -> Result<(), String>;
    /// Requests the next finished training episode.
    fn request_live(&self);
    /// The model of the current settings for a task, or why there is none; None while it is being loaded.
    fn model_for(&mut self, task: &Arc<Task>) -> Option<Result<TaskModel, String>>;
    /// A past episode of the run in a folder, or why there is none; None while it is being read.
    fn past_episode(&mut self, run: &Path, episode: u64) -> Option<Result<Arc<Episode>, String>>;
    /// Requests the curves of the runs in these folders, opened or not.
    fn request_curves(&mut self, runs: Vec<PathBuf>);
    /// Requests the agent of the watched run from the checkpoint nearest to an episode, counted from 1. It
    /// appears in the view model once it has been read.
    fn request_agent(&mut self, episode: u64);
    /// A figure of the current state.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<FigureJob, String>;
    /// Adds a line to the log.
    fn log(&mut self, level: Level, text: String);
}

/// Time after the latest command before outdated clusters are recomputed.
const RECOMPUTE_DELAY: Duration = Duration::from_millis(700);
/// Minimum time between two refreshes for frequent events such as episodes.
const REFRESH: Duration = Duration::from_millis(200);
/// Number of log lines kept.
const LOG: usize = 2000;

/// Number of further episodes of a running training after which its checkpoints are looked up again.
const RECHECK_EPISODES: u64 = 50;
/// Number of past episodes and of models kept.
const KEPT: usize = 4;

/// A session and its view model.
pub struct SessionWorkspace {
    session: Session,
    /// Which commands are carried out; the others are refused.
    allow: fn(&Command) -> bool,
    view: ViewModel,
    listing: Listing,
    /// The available models, by the task that they are described for and the number of changes of their files.
    models: Loader<(Arc<Task>, usize), Vec<ModelSummary>>,
    /// The tasks that can be opened, read again when the task is of another file.
    tasks: Loader<Option<PathBuf>, Vec<(String, Task)>>,
    /// How often a command has changed the files of models.
    model_changes: usize,
    /// Models by the source, the settings of a trained one, the seed and the task they depend on.
    model: Loader<(PriorSource, TaskModelConfig, u64, Arc<Task>), TaskModel>,
    /// Past episodes, by the folder of their run and their number.
    episodes: Loader<(PathBuf, u64), Arc<Episode>>,
    /// Agents, by the folder of their run, an episode of it, and its progress in units of `RECHECK_EPISODES` episodes.
    agents: Loader<(PathBuf, u64, u64), Arc<SavedAgent>>,
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
        let listing = Listing::default();
        let mut workspace = Self {
            view: view_of(&session, &listing),
            session,
            allow: |_| true,
            listing,
            models: Loader::default(),
            tasks: Loader::default(),
            model_changes: 0,
            model: Loader::new(KEPT),
            episodes: Loader::new(KEPT),
            agents: Loader::default(),
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

    /// Logs a notice of the session.
    fn take_notice(&mut self, notice: &Notice) {
        match notice {
            Notice::Finished { command, outcome } => self.take_outcome(command, outcome),
            Notice::Warning(text) => self.log(Level::Warning, text.clone()),
            Notice::Run { event: Event::EpisodeFinished(_) | Event::Checkpointed { .. }, .. }
            | Notice::Progress { .. }
            | Notice::Changed => {}
            Notice::Run { run, event } => {
                let level = match event {
                    Event::Failed { .. } => Level::Error,
                    Event::Stopped { .. } => Level::Warning,
                    Event::Finished { .. } => Level::Good,
                    _ => Level::Info,
                };
                let name = self.session.run_numbered(*run).map_or("", |run| &run.name);
                self.log(level, format!("{name}: {event}"));
            }
        }
    }

    /// Logs the outcome of a background command and updates the view for it.
    fn take_outcome(&mut self, command: &Command, outcome: &Result<String, String>) {
        match command {
            Command::Clusters(_) => self.view.prior_failure = outcome.as_ref().err().cloned(),
            Command::ModelTrain(_) => self.model_changes += 1,
            Command::Figure(figure) if outcome.is_ok() => {
                self.view.figures.retain(|known| *known != figure.to.path);
                self.view.figures.push(figure.to.path.clone());
            }
            _ => {}
        }
        let training = self.session.run().is_some_and(RunView::is_active);
        let (level, text) = match (command, outcome) {
            // Visible on screen.
            (Command::Open(_) | Command::Continue(_) | Command::Restore(_), Ok(_)) => return,
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
        let notices = self.session.poll_in_background();
        for notice in &notices {
            self.take_notice(notice);
        }
        let preparing = self.session.run().and_then(RunView::phase).is_some_and(|phase| phase.preparation().is_some());
        let (task, changes) = (self.view.task.clone(), self.model_changes);
        let key = (task.clone(), changes);
        self.models.request(key, Duration::MAX, move |_| Ok(ModelSummary::all(&task)));
        self.tasks.request(self.view.file.clone(), Duration::MAX, |_| Ok(named_tasks()));
        let news = [
            self.listing.poll(&self.session),
            self.episodes.poll(),
            self.agents.poll(),
            self.models.poll(),
            self.tasks.poll(),
            self.model.poll(),
        ];
        let news = news.contains(&true);
        // Frequent notices wait for the next refresh.
        let is_urgent = news || notices.iter().any(|notice| !is_frequent(notice));
        self.is_stale |= preparing || !notices.is_empty() || building != self.session.prior_state();
        let changed = is_urgent || (self.is_stale && self.refreshed.elapsed() >= REFRESH);
        if changed {
            self.refresh();
        }
        changed
    }

    fn apply(&mut self, mut command: Command) -> Result<String, String> {
        if let Command::Figure(figure) = &mut command {
            figure.composition.colors = self.view.groups.colors();
        }
        if !(self.allow)(&command) {
            return Err(format!("not allowed: {command}"));
        }
        self.touched = Instant::now();
        let changes_folder = matches!(
            command,
            Command::Out(_) | Command::Note(_) | Command::Rename(_) | Command::Delete(_) | Command::Restore(_)
        );
        let outcome = self.session.apply(command).map_err(|error| error.to_string());
        if changes_folder {
            self.listing.is_due = true;
        }
        if let Err(error) = &outcome {
            self.log(Level::Error, error.clone());
        }
        self.refresh();
        outcome
    }

    fn check(&self, commands: &[Command]) -> Result<(), String> {
        self.session.check(commands).map_err(|error| error.to_string())
    }

    fn request_live(&self) {
        if let Some(run) = self.session.run() {
            run.request_live();
        }
    }

    fn model_for(&mut self, task: &Arc<Task>) -> Option<Result<TaskModel, String>> {
        let RunConfig { prior, model, seed, .. } = self.session.config();
        let key = (prior.clone(), *model, *seed, task.clone());
        // An equal task is another value; a model belongs to one of them.
        let known = self.model.latest(|known| *known == key && Arc::ptr_eq(&known.3, task));
        let known = known.map(|(_, model)| model.clone());
        if known.is_none() {
            let of = RunConfig { task: task.clone(), ..self.session.config().clone() };
            self.model.request(key, Duration::ZERO, move |_| TaskModel::new(&of));
        }
        known
    }

    fn past_episode(&mut self, run: &Path, episode: u64) -> Option<Result<Arc<Episode>, String>> {
        let Some(summary) = self.view.run(run) else { return Some(Err("the run no longer exists".to_owned())) };
        let config = summary.config.clone();
        let key = (run.to_owned(), episode);
        let known = self.episodes.latest(|known| *known == key).map(|(_, episode)| episode.clone());
        if known.is_none() {
            let path = run.to_owned();
            self.episodes.request(key, Duration::MAX, move |_| {
                let saved = SavedRun::open(&path, config.clone()).map_err(|error| error.to_string())?;
                let trace = saved.past_episode(episode).map_err(|error| error.to_string())?;
                Ok(Arc::new(episode_of(&path, config.task_of(episode), Arc::new(trace))))
            });
        }
        known
    }

    fn request_curves(&mut self, runs: Vec<PathBuf>) {
        self.listing.request_curves(runs, &self.session);
    }

    fn request_agent(&mut self, episode: u64) {
        let Some(run) = self.session.run() else { return };
        let path = run.directory().path().to_owned();
        let known = self.agents.latest(|(of, ..)| *of == path).and_then(|(_, agent)| agent.clone().ok());
        let saved = run.saved.clone();
        let load = move |_: &_| saved.agent_near(episode, known).map_err(|error| error.to_string());
        self.agents.request((path, episode, run.episodes() / RECHECK_EPISODES), Duration::MAX, load);
    }

    fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<FigureJob, String> {
        let composition = Composition { colors: self.view.groups.colors(), ..composition.clone() };
        self.session.figure(kind, &composition).map_err(|error| error.to_string())
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

/// A recorded trace as an episode of the run in a folder.
fn episode_of(run: &Path, task: &Arc<Task>, trace: Arc<Trace>) -> Episode {
    Episode { task: task.clone(), trace, origin: Origin::Run(run.to_owned()) }
}
