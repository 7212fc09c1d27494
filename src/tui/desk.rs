//! The session as the screens see it: facts out, command lines in.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::env::{Action, Environment, Placement};
use crate::guidance::RolloutModel;
use crate::run::{Event, RunDirectory, RunState};
use crate::task::Task;
use crate::trainer::{LiveView, Phase, RunConfig, rollout_model, unusual_settings};
use crate::workbench::{Command, FigureKind, Notice, RunView, Session};

use super::facts::{Facts, Level, LogLine, ModelFacts, RunFacts, Settings};
use super::metric::Curves;
use super::playback::Episode;
use super::preview::Drawing;
use super::rate::Rate;
use super::scene::{Ghost, Heat};

/// What the screens need of a session.
pub trait Desk {
    /// Everything there is to see.
    fn facts(&self) -> &Facts;
    /// Takes in what happened in the background; true if anything did.
    fn poll(&mut self) -> bool;
    /// Carries out a line of the command language; what to tell the person.
    ///
    /// # Errors
    /// What is wrong, in one line.
    fn apply(&mut self, line: &str) -> Result<String, String>;
    /// Asks for the next finished training episode.
    fn request_live(&self);
    /// What would become of a tool placed by hand, and what the model predicts.
    fn ghost(&mut self, action: Action) -> Ghost;
    /// What the watched agent, as it is now, thinks before action number `action` of an episode.
    fn mind(&self, episode: &Episode, action: usize) -> Option<Mind>;
    /// What the model predicts for the next actions of an episode, from its action
    /// number `action` on: normalised positions of the ball.
    fn foresee(&mut self, episode: &Episode, action: usize) -> Vec<[f32; 2]>;
    /// An episode of the watched run's past, played again.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn past_episode(&self, episode: u64) -> Result<Arc<Episode>, String>;
    /// A figure of what there is now.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn figure(&self, kind: FigureKind) -> Result<Drawing, String>;
    /// All settings of the next run, by path, that are not the usual ones.
    fn unusual_settings(&self) -> Vec<(String, String)>;
    /// Looks for runs on disk.
    fn look_for_runs(&mut self);
    /// Adds a line to the log.
    fn log(&mut self, level: Level, text: String);
}

/// What an agent thinks of a situation.
#[derive(Debug, Clone, PartialEq)]
pub struct Mind {
    /// The critic's value of every action.
    pub heat: Heat,
    /// Where the actor would place the tool.
    pub choice: Action,
}

/// Time after an edit before the clusters are computed anew.
const SETTLED: Duration = Duration::from_millis(700);
/// Lines of the log that are kept.
const LOG: usize = 2000;
/// Rows and columns of the grid of actions for the critic.
const HEAT_SIDE: usize = 36;
/// Actions a prediction looks ahead.
pub const LOOK_AHEAD: usize = 3;

/// A session with the facts about it.
pub struct SessionDesk {
    session: Session,
    facts: Facts,
    live: Option<LiveView>,
    rates: HashMap<PathBuf, Rate>,
    model: Option<(RunConfig, Option<Box<dyn RolloutModel>>)>,
    on_disk: Vec<RunFacts>,
    /// When the latest command was carried out.
    touched: Instant,
}

impl SessionDesk {
    /// The desk of a session.
    pub fn new(session: Session) -> Self {
        let task = Arc::new(session.task().clone());
        let facts = Facts {
            file: None,
            dirty: false,
            proposed: Vec::new(),
            proposing: None,
            settings: settings(&session),
            prior: None,
            prior_state: session.prior_state(),
            prior_failure: None,
            models: models(&session),
            runs: Vec::new(),
            current: None,
            live: None,
            played: Arc::default(),
            played_end: None,
            model_work: None,
            model_outcome: None,
            figures: Vec::new(),
            log: Vec::new(),
            log_total: 0,
            task,
        };
        let mut desk = Self {
            session,
            facts,
            live: None,
            rates: HashMap::new(),
            model: None,
            on_disk: Vec::new(),
            touched: Instant::now(),
        };
        desk.look_for_runs();
        desk.refresh();
        desk
    }

    /// Takes the session's state over into the facts.
    fn refresh(&mut self) {
        let session = &self.session;
        let facts = &mut self.facts;
        if *facts.task != *session.task() {
            facts.task = Arc::new(session.task().clone());
            facts.models = models(session);
        }
        facts.file = session.file().map(Path::to_owned);
        facts.dirty = session.is_dirty();
        facts.proposed = session.proposed().to_vec();
        facts.proposing = session.proposing();
        facts.settings = settings(session);
        facts.prior_state = session.prior_state();
        let of_run = || session.run().and_then(RunView::prior);
        facts.prior = session.prior().cloned().or_else(of_run);
        let hand = session.hand_play();
        if facts.played.steps.len() != hand.trace().steps.len() || hand.trace().steps.is_empty() {
            facts.played = Arc::new(hand.trace().clone());
        }
        facts.played_end = hand.snapshot().end();
        facts.model_work = session.model_work().map(|(name, done)| (name.to_owned(), done));
        self.refresh_runs();
        self.refresh_live();
    }

    /// Computes clusters anew once an edit has made them out of date and the person has
    /// stopped to edit for a moment.
    fn renew_clusters(&mut self) {
        if self.touched.elapsed() > SETTLED && self.session.clusters_are_outdated() {
            // What comes of it is in the log, and on the screen.
            let _ = self.apply("clusters");
        }
    }

    fn refresh_runs(&mut self) {
        let mut old: HashMap<PathBuf, Curves> =
            self.facts.runs.drain(..).filter(|run| run.opened).map(|run| (run.path, run.curves)).collect();
        let current = self.session.run().map(|run| run.directory().path().to_owned());
        let now = Instant::now();
        let opened = self.session.runs().iter().map(|view| {
            let path = view.directory().path();
            let rate = self.rates.entry(path.to_owned()).or_default();
            if view.state() == RunState::Running {
                rate.note(now, view.records().len() as u64);
            } else {
                rate.forget();
            }
            run_facts(view, old.remove(path).unwrap_or_default(), rate.per_second())
        });
        let opened: Vec<RunFacts> = opened.collect();
        let unopened = self.on_disk.iter().filter(|run| opened.iter().all(|other| other.path != run.path)).cloned();
        self.facts.runs = unopened.collect();
        self.facts.runs.extend(opened);
        self.facts.current = current.and_then(|path| self.facts.runs.iter().position(|run| run.path == path));
    }

    fn refresh_live(&mut self) {
        let Some(run) = self.session.run() else { return };
        let Some(live) = run.live() else {
            // The networks of another run have nothing to say of this one.
            self.live = None;
            return;
        };
        if self.live.as_ref().is_some_and(|shown| Arc::ptr_eq(&shown.trace, &live.trace)) {
            return;
        }
        let title = format!("episode {} of {}", live.trace.episode, run.name());
        let task = run.config().task.clone();
        self.facts.live = Some(Arc::new(Episode { title, task, trace: live.trace.clone() }));
        self.live = Some(live.clone());
    }

    fn note(&mut self, notice: &Notice) {
        match notice {
            Notice::PriorReady => {
                self.facts.prior_failure = None;
                let training = self.session.run().is_some_and(RunView::is_active);
                let more = if training { "; `guide` gives them to the running training" } else { "" };
                self.log(Level::Good, format!("the action clusters are there{more}"));
            }
            Notice::PriorFailed(reason) => {
                self.facts.prior_failure = Some(reason.clone());
                self.log(Level::Error, format!("action clusters: {reason}"));
            }
            Notice::Model(outcome) => {
                self.facts.models = models(&self.session);
                self.facts.model_outcome = Some(outcome.clone());
                match outcome {
                    Ok(told) => self.log(Level::Good, told.clone()),
                    Err(reason) => self.log(Level::Error, reason.clone()),
                }
            }
            Notice::Proposed(Ok(told)) => {
                self.log(Level::Good, format!("{told}: accept, move or reject them on the Edit screen"));
            }
            Notice::Proposed(Err(reason)) => self.log(Level::Error, format!("subgoals: {reason}")),
            Notice::Run { event: Event::EpisodeFinished(_), .. } | Notice::PriorStage { .. } | Notice::Changed => {}
            Notice::Run { index, event } => {
                let level = match event {
                    Event::Failed { .. } => Level::Error,
                    Event::Stopped { .. } => Level::Warning,
                    Event::Finished { .. } => Level::Good,
                    _ => Level::Info,
                };
                let name = self.session.runs().get(*index).map_or_else(String::new, RunView::name);
                self.log(level, format!("{name}: {event}"));
            }
        }
    }

    /// The model of the present settings; None if it predicts nothing or cannot be had.
    fn rollout_model(&mut self) -> Option<&dyn RolloutModel> {
        let config = self.session.config();
        let same = |(known, _): &(RunConfig, _)| known.prior == config.prior && known.task == config.task;
        if !self.model.as_ref().is_some_and(same) {
            let model = rollout_model(&config.prior, &config.task).ok().flatten().map(|(model, _)| model);
            self.model = Some((config.clone(), model));
        }
        self.model.as_ref()?.1.as_deref()
    }
}

impl Desk for SessionDesk {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn poll(&mut self) -> bool {
        let building = self.facts.prior_state;
        self.renew_clusters();
        let notices = self.session.poll();
        for notice in &notices {
            self.note(notice);
        }
        let failed: Vec<String> = super::terminal::take_panics();
        for panic in &failed {
            self.log(Level::Error, panic.clone());
        }
        let preparing = self.facts.runs.iter().any(|run| run.preparing.is_some());
        let changed = !notices.is_empty() || !failed.is_empty() || building != self.session.prior_state();
        if changed || preparing {
            self.refresh();
        }
        changed || preparing
    }

    fn apply(&mut self, line: &str) -> Result<String, String> {
        self.touched = Instant::now();
        let outcome = match Command::parse(line) {
            Ok(None) => return Ok(String::new()),
            Ok(Some(command)) => {
                let figure = if let Command::Figure(figure) = &command { Some(figure.path.clone()) } else { None };
                let deleted = matches!(command, Command::Delete(_));
                let outcome = self.session.apply(command).map_err(|error| error.to_string());
                if deleted {
                    self.look_for_runs();
                }
                if let (Ok(_), Some(path)) = (&outcome, figure) {
                    self.facts.figures.retain(|known| *known != path);
                    self.facts.figures.push(path);
                }
                outcome
            }
            Err(error) => Err(error.to_string()),
        };
        match &outcome {
            Ok(told) if told.is_empty() => {}
            Ok(told) => self.log(Level::Info, told.clone()),
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

    fn ghost(&mut self, action: Action) -> Ghost {
        let snapshot = self.session.hand_play().snapshot().clone();
        let task = self.session.hand_play().task().clone();
        let placement = snapshot.check_placement(&task, action);
        let mut ghost = Ghost { action, placement, predicted: Vec::new() };
        if snapshot.end().is_none()
            && placement == Placement::Placed
            && let Some(model) = self.rollout_model()
        {
            // After the placement the tool in hand would only overlap itself: the ball goes its way.
            let sequence = vec![action; LOOK_AHEAD];
            ghost.predicted = model.rollouts(&task, &[&snapshot], &[sequence]).pop().map_or_else(Vec::new, |r| r.path);
        }
        ghost
    }

    fn mind(&self, episode: &Episode, action: usize) -> Option<Mind> {
        let live = self.live.as_ref()?;
        let observation = replay(episode, action)?.observation();
        // Another run may be watched by now, on another task.
        if observation.len() != live.ddpg.observation_len() {
            return None;
        }
        let choice: [f32; 2] = live.ddpg.act(&observation).try_into().ok()?;
        let middle = |index: usize| (index as f32 + 0.5) / HEAT_SIDE as f32 * 2.0 - 1.0;
        let rows = (0..HEAT_SIDE).map(|row| -middle(row));
        let actions: Vec<f32> = rows.flat_map(|y| (0..HEAT_SIDE).flat_map(move |x| [middle(x), y])).collect();
        let values = live.ddpg.q_values(&observation, &actions);
        Some(Mind { heat: Heat { side: HEAT_SIDE, values }, choice })
    }

    fn foresee(&mut self, episode: &Episode, action: usize) -> Vec<[f32; 2]> {
        let Some(env) = replay(episode, action) else { return Vec::new() };
        let next = episode.trace.steps.iter().skip(action).take(LOOK_AHEAD).map(|step| step.action).collect();
        let Some(model) = self.rollout_model() else { return Vec::new() };
        model.rollouts(&episode.task, &[env.snapshot()], &[next]).pop().map_or_else(Vec::new, |rollout| rollout.path)
    }

    fn past_episode(&self, episode: u64) -> Result<Arc<Episode>, String> {
        let run = self.session.run().ok_or("no run is being watched")?;
        let trace = run.past_episode(episode).map_err(|error| error.to_string())?;
        let title = format!("episode {episode} of {}", run.name());
        Ok(Arc::new(Episode { title, task: run.config().task.clone(), trace: Arc::new(trace) }))
    }

    fn figure(&self, kind: FigureKind) -> Result<Drawing, String> {
        let figure = self.session.figure(kind).map_err(|error| error.to_string())?;
        figure.ok_or_else(|| "An animation: the Scene screen plays it.".to_owned())
    }

    fn unusual_settings(&self) -> Vec<(String, String)> {
        unusual_settings(self.session.config())
    }

    fn look_for_runs(&mut self) {
        let Ok(entries) = std::fs::read_dir(self.session.folder()) else { return };
        let mut found: Vec<RunFacts> = entries.flatten().filter_map(|entry| glance(&entry.path())).collect();
        found.sort_by(|a, b| a.name.cmp(&b.name));
        self.on_disk = found;
        self.refresh();
    }

    fn log(&mut self, level: Level, text: String) {
        self.facts.log.push(LogLine { time: jiff::Zoned::now().time(), level, text });
        self.facts.log_total += 1;
        let more = self.facts.log.len().saturating_sub(LOG);
        self.facts.log.drain(..more);
    }
}

/// The environment as it was before an episode's action number `action`. None if the
/// episode cannot be repeated.
fn replay(episode: &Episode, action: usize) -> Option<Environment> {
    let mut env = Environment::shifted(episode.task.clone(), episode.trace.shift);
    for step in episode.trace.steps.iter().take(action) {
        env.step(step.action).ok()?;
    }
    Some(env)
}

fn settings(session: &Session) -> Settings {
    let config = session.config();
    Settings {
        method: config.method.name().to_owned(),
        seed: config.seed,
        episodes: u64::from(config.episodes),
        epsilon: config.epsilon.clone(),
        model: String::from(config.prior.clone()),
        folder: session.folder().to_owned(),
    }
}

fn models(session: &Session) -> Vec<ModelFacts> {
    let mut models = vec![
        model("learned", "the shipped dynamics model of the task's tool set"),
        model("true", "the environment's own physics: the upper bound of guidance"),
        model("uniform", "no model: uniform random actions in place of clusters"),
    ];
    models.extend(crate::dynamics::shipped_names().filter_map(|name| {
        let known = crate::dynamics::shipped(name).ok().flatten()?;
        let about = known.check_task(session.task()).map_or_else(|error| error.to_string(), |()| "shipped".to_owned());
        Some(model(name, &about))
    }));
    if let Ok(entries) = std::fs::read_dir("models") {
        let files = entries.flatten().map(|entry| entry.path());
        let mut files: Vec<PathBuf> =
            files.filter(|path| path.extension().is_some_and(|e| e == "safetensors")).collect();
        files.sort();
        models
            .extend(files.iter().map(|path| model(&path.display().to_string(), &describe_model(path, session.task()))));
    }
    models
}

fn model(name: &str, about: &str) -> ModelFacts {
    ModelFacts { name: name.to_owned(), about: about.to_owned() }
}

fn describe_model(path: &Path, task: &Task) -> String {
    match crate::dynamics::Model::load(path) {
        Ok(model) => match model.check_task(task) {
            Ok(()) => format!("trained by you: {}", model.name()),
            Err(error) => error.to_string(),
        },
        Err(error) => error.to_string(),
    }
}

fn run_facts(view: &RunView, mut curves: Curves, rate: Option<f64>) -> RunFacts {
    let records = view.records();
    curves.truncate(records.len());
    for record in &records[curves.episodes()..] {
        curves.push_record(record);
    }
    let config = view.config();
    let evaluations = view.evaluations().iter().map(|e| (e.episode, e.success as f32)).collect();
    let preparing = match view.phase() {
        Some(Phase::BuildingPrior { stage, stages }) => Some((stage, stages)),
        _ => None,
    };
    RunFacts {
        name: view.name(),
        path: view.directory().path().to_owned(),
        opened: true,
        active: view.is_active(),
        queued: view.is_queued(),
        task: config.task.name.clone(),
        method: config.method.name().to_owned(),
        seed: config.seed,
        subgoals: config.task.subgoals.len(),
        episodes: u64::from(config.episodes),
        state: view.state(),
        preparing,
        done: records.len() as u64,
        success: records.last().map(|record| record.rolling_success as f32),
        curves,
        evaluations,
        rate,
    }
}

/// What can be known of a run without reading its log. None if the folder is no run.
fn glance(path: &Path) -> Option<RunFacts> {
    let directory = RunDirectory::open(path).ok()?;
    let config: RunConfig = directory.config().ok()?;
    let status = directory.status().ok()?;
    Some(RunFacts {
        name: path.file_name()?.to_string_lossy().into_owned(),
        path: path.to_owned(),
        opened: false,
        active: false,
        queued: false,
        task: config.task.name.clone(),
        method: config.method.name().to_owned(),
        seed: config.seed,
        subgoals: config.task.subgoals.len(),
        episodes: u64::from(config.episodes),
        state: status.state,
        preparing: None,
        done: status.last_episode.as_ref().map_or(0, |record| record.episode),
        success: status.last_episode.map(|record| record.rolling_success as f32),
        curves: Curves::default(),
        evaluations: Vec::new(),
        rate: None,
    })
}
