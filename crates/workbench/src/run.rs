//! A run as the workbench shows it: its log, and its trainer if this process trains it.

use std::cell::Cell;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use mge_base::stop::Stop;
use mge_guidance::ActionPrior;
use mge_run::{
    CheckpointName, EpisodeRecord, EvaluationRecord, Event, EventReader, LoggedEvent, Practised, Request, RunDirectory,
    RunError, RunHistory, RunState,
};
use mge_task::Task;
use mge_trainer::{Control, LiveView, Phase, RunConfig, Trace, Trainer, saved_prior};

use super::SessionError;
use super::job::{CANCELLED, Job};
use super::saved::SavedRun;

/// Maximum number of episodes, and of evaluations, kept of a run; those of longer runs are thinned evenly.
const MAX_KEPT: NonZeroUsize = NonZeroUsize::new(16_384).unwrap();

/// A run, live or finished, of this or another process: a reader of its log.
#[derive(Debug)]
pub struct RunView {
    number: usize,
    directory: RunDirectory,
    config: Arc<RunConfig>,
    reader: EventReader,
    history: RunHistory,
    /// Time of the latest event read.
    latest: f64,
    /// Number of episodes at the latest checkpoint of a run in training.
    saved_episode: u64,
    trainer: Option<Trainer>,
    live: Option<LiveView>,
    failure: Option<String>,
    saved_prior: SavedPrior,
    /// A command that ends the pause was sent, but its effect has not been read yet.
    leaving_pause: bool,
    trained_here: bool,
    /// The latest requested episode of its greedy policy.
    greedy: Option<Arc<Trace>>,
    /// The checkpoint of the agent that plays.
    checkpoint: CheckpointName,
    /// The existing log is still being read in the background.
    unread: bool,
    turn: Option<Turn>,
}

/// The prior in a run's folder, read in the background on first use.
#[derive(Debug, Default)]
struct SavedPrior {
    /// The prior, or why it cannot be used, when last read.
    known: Option<PriorOutcome>,
    wanted: Cell<bool>,
    reading: Option<Job<Option<Arc<ActionPrior>>>>,
}

/// The prior of a run, if it has one, or why it cannot be used.
pub(super) type PriorOutcome = Result<Option<Arc<ActionPrior>>, String>;

impl SavedPrior {
    fn get(&self) -> Option<Arc<ActionPrior>> {
        if self.known.is_none() && self.reading.is_none() {
            self.wanted.set(true);
        }
        self.known.clone()?.ok().flatten()
    }

    /// Starts reading if wanted, and takes the result; true if a result was taken.
    fn poll(&mut self, directory: &RunDirectory, task: &Arc<Task>) -> bool {
        if let Some(job) = self.reading.take_if(|job| job.is_finished()) {
            self.known = Some(job.result());
            return true;
        }
        if self.reading.is_none() && self.wanted.take() {
            let (directory, task) = (directory.clone(), task.clone());
            match Job::spawn(move |_| read_prior(&directory, &task)) {
                Ok(job) => self.reading = Some(job),
                Err(error) => self.known = Some(Err(error.to_string())),
            }
        }
        false
    }
}

/// The existing log and prior of a run, read in the background.
pub(super) struct Past {
    reader: EventReader,
    history: RunHistory,
    /// Time of the latest event.
    latest: f64,
    /// The problem of the first invalid line of the log.
    problem: Option<String>,
    prior: PriorOutcome,
}

impl Past {
    /// Reads the log and the prior of a run on a task.
    ///
    /// # Errors
    /// When the log cannot be read, or `stop` is requested.
    pub fn read(directory: &RunDirectory, task: &Task, stop: &Stop) -> Result<Self, String> {
        let mut reader = directory.events();
        let (mut history, mut latest, mut problem) = (RunHistory::bounded(MAX_KEPT), f64::NEG_INFINITY, None);
        loop {
            let news = reader.poll().map_err(|error| error.to_string())?;
            if news.restarted {
                history = RunHistory::bounded(MAX_KEPT);
            }
            problem = problem.or(news.problems.first().map(ToString::to_string));
            for logged in news.events {
                history.add(&logged.event);
                latest = latest.max(logged.time);
            }
            if !news.more {
                break;
            }
            if stop.is_requested() {
                return Err(CANCELLED.to_owned());
            }
        }
        let prior = read_prior(directory, task);
        Ok(Self { reader, history, latest, problem, prior })
    }
}

/// Reads the saved prior of a run on a task.
fn read_prior(directory: &RunDirectory, task: &Task) -> PriorOutcome {
    let prior = saved_prior(directory, task).map_err(|error| error.to_string())?;
    Ok(prior.map(Arc::new))
}

/// The place of a run in the queue for a free core.
#[derive(Debug)]
struct Turn {
    /// Runs with lower numbers start first.
    number: u64,
    /// Pause after this many episodes in total.
    until: Option<u32>,
}

impl RunView {
    /// Opens the run in a folder without reading its log.
    ///
    /// # Errors
    /// When there is no run, or one that cannot be read.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        Self::new(RunDirectory::open(path)?)
    }

    /// Opens the run in a folder and reads its whole log.
    ///
    /// # Errors
    /// As [`RunView::open`].
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let mut view = Self::open(path)?;
        let (mut events, mut restarted) = (Vec::new(), false);
        while view.read_on(&mut restarted, &mut events) {
            events.clear();
        }
        Ok(view)
    }

    pub(super) fn new(directory: RunDirectory) -> Result<Self, RunError> {
        let config = Arc::new(RunConfig::of(&directory)?);
        let reader = directory.events();
        Ok(Self {
            number: 0,
            directory,
            config,
            reader,
            history: RunHistory::bounded(MAX_KEPT),
            latest: f64::NEG_INFINITY,
            saved_episode: 0,
            trainer: None,
            live: None,
            failure: None,
            saved_prior: SavedPrior::default(),
            leaving_pause: false,
            trained_here: false,
            greedy: None,
            checkpoint: CheckpointName::Last,
            unread: false,
            turn: None,
        })
    }

    /// The same run with its number in the session.
    pub(super) fn numbered(self, number: usize) -> Self {
        Self { number, ..self }
    }

    /// The same run, whose log is read by a job until [`RunView::take_past`].
    pub(super) fn with_past_unread(self) -> Self {
        Self { unread: true, ..self }
    }

    /// Takes over the state read by the job and continues reading the log from there. Past events
    /// are not reported.
    ///
    /// # Errors
    /// When the log could not be read; the run then leaves the queue.
    pub(super) fn take_past(&mut self, past: Result<Past, String>) -> Result<(), String> {
        self.unread = false;
        match past {
            Ok(Past { reader, history, latest, problem, prior }) => {
                (self.reader, self.history, self.latest) = (reader, history, latest);
                self.failure = problem.or(self.failure.take());
                self.saved_prior = SavedPrior { known: Some(prior), ..SavedPrior::default() };
                if self.is_queued() {
                    self.failure = None;
                }
                Ok(())
            }
            Err(reason) => {
                self.unqueue();
                self.failure = Some(reason.clone());
                Err(reason)
            }
        }
    }

    /// Whether the existing log is still being read.
    pub fn is_unread(&self) -> bool {
        self.unread
    }

    /// Its number in the session, from 0 in the order in which runs were started or opened.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Queues it for training in this process, after runs with lower turns; with `until`, it pauses
    /// after this many episodes in total.
    pub(super) fn enqueue(&mut self, turn: u64, until: Option<u32>) {
        // Reads the existing log first, so that an old failure is not reported again.
        self.poll();
        self.failure = None;
        self.trained_here = true;
        self.turn = Some(Turn { number: turn, until });
    }

    /// Removes it from the queue; false if it was not queued.
    pub(super) fn unqueue(&mut self) -> bool {
        self.turn.take().is_some()
    }

    /// Whether it is queued.
    pub fn is_queued(&self) -> bool {
        self.turn.is_some()
    }

    /// Its turn, if it is queued and ready to start.
    pub(super) fn turn(&self) -> Option<u64> {
        self.turn.as_ref().filter(|_| !self.unread).map(|turn| turn.number)
    }

    /// Starts training it if it is queued.
    pub(super) fn start(&mut self) -> Result<(), SessionError> {
        let Some(turn) = self.turn.take() else { return Ok(()) };
        let first = turn.until.map(|until| Control::PauseAt(until.into()));
        let trainer = Trainer::spawn(self.directory.clone(), first).map_err(SessionError::Thread);
        if let Err(error) = &trainer {
            self.failure = Some(error.to_string());
        }
        self.trainer = Some(trainer?);
        // How an earlier training ended says nothing about this one, which may fail before its first event.
        self.history.last = None;
        Ok(())
    }

    /// Whether it occupies a core.
    pub(super) fn is_working(&self) -> bool {
        self.is_active() && self.state() != RunState::Paused
    }

    /// Reads the new events. Returns them, and whether anything changed.
    pub(super) fn poll(&mut self) -> (Vec<Event>, bool) {
        if self.unread {
            return (Vec::new(), false);
        }
        let (mut events, mut changed) = (Vec::new(), false);
        while self.read_on(&mut changed, &mut events) {}
        if let Some(trainer) = &mut self.trainer {
            if let Some(view) = trainer.watch().take() {
                self.live = Some(view);
                changed = true;
            }
            if let Some(outcome) = trainer.outcome() {
                let failed = outcome.err();
                self.failure = failed.clone();
                self.saved_prior.known = Some(Ok(trainer.watch().prior()));
                self.trainer = None;
                self.leaving_pause = false;
                changed = true;
                // Its latest events. They lack a failure that could not be written, as on a full disk.
                let mut restarted = false;
                while self.read_on(&mut restarted, &mut events) {}
                if let Some(reason) = failed
                    && !matches!(self.history.last, Some(Event::Failed { .. }))
                {
                    events.push(Event::Failed { episode: self.episodes(), reason });
                }
            }
        }
        changed |= self.saved_prior.poll(&self.directory, &self.config.task) | !events.is_empty();
        (events, changed)
    }

    /// Reads a chunk of the log and appends the new events; true if there is more. Sets `restarted` when
    /// the log is read from the start again because the run was rolled back to a checkpoint; events that
    /// were read before are then not appended again.
    fn read_on(&mut self, restarted: &mut bool, events: &mut Vec<Event>) -> bool {
        let news = match self.reader.poll() {
            Ok(news) => news,
            Err(error) => {
                // An earlier failure, such as that of the training, explains more than a missing log.
                self.failure.get_or_insert_with(|| error.to_string());
                return false;
            }
        };
        if news.restarted {
            self.history = RunHistory::bounded(MAX_KEPT);
            *restarted = true;
        }
        self.failure = news.problems.first().map(ToString::to_string).or(self.failure.take());
        for LoggedEvent { time, event } in news.events {
            self.history.add(&event);
            self.leaving_pause &= !matches!(event, Event::Resumed { .. });
            if let Event::Started { episode, .. } | Event::Checkpointed { episode, .. } | Event::Paused { episode } =
                event
            {
                self.saved_episode = episode;
            }
            if matches!(event, Event::ClustersChanged { .. } | Event::Started { .. }) {
                self.saved_prior.wanted.set(self.saved_prior.known.is_some());
            }
            if !*restarted || time > self.latest {
                events.push(event);
            }
            self.latest = self.latest.max(time);
        }
        news.more
    }

    /// Sends a control to the trainer, in this or another process.
    pub(super) fn send(&mut self, control: Control) -> Result<(), SessionError> {
        match &self.trainer {
            Some(trainer) if trainer.is_active() => {
                let leaves = matches!(control, Control::Resume | Control::PauseAt(_) | Control::Stop { .. });
                self.leaving_pause |= leaves && matches!(self.history.last, Some(Event::Paused { .. }));
                trainer.send(control);
                Ok(())
            }
            _ if self.is_queued() => Err(SessionError::Queued(self.name())),
            _ => self.ask_others(control),
        }
    }

    /// Sends a control to the other process that trains the run, if there is one.
    fn ask_others(&self, control: Control) -> Result<(), SessionError> {
        if !self.directory.is_locked()? {
            return Err(SessionError::NotActive);
        }
        let request = match control {
            Control::Pause => Request::Pause,
            Control::Resume => Request::Resume,
            Control::PauseAt(episode) => match episode.saturating_sub(self.episodes()) {
                0 => Request::Pause,
                more => Request::Advance { episodes: u32::try_from(more).unwrap_or(u32::MAX) },
            },
            Control::Stop { .. } => Request::Stop,
            Control::SetSchedule(schedule) => Request::Epsilon { schedule: schedule.to_string() },
            Control::SetPrior(_) => return Err(SessionError::TrainedElsewhere(self.name())),
        };
        Ok(self.directory.request(&request)?)
    }

    /// The run's files.
    pub fn directory(&self) -> &RunDirectory {
        &self.directory
    }

    /// The name of its folder.
    pub fn name(&self) -> String {
        self.directory.path().file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Its configuration.
    pub fn config(&self) -> &Arc<RunConfig> {
        &self.config
    }

    /// Sets the configuration after its file was rewritten.
    pub(super) fn set_config(&mut self, config: RunConfig) {
        self.config = Arc::new(config);
    }

    /// Number of finished episodes.
    pub fn episodes(&self) -> u64 {
        self.records().last().map_or(0, |record| record.episode)
    }

    /// Number of episodes at the latest checkpoint of a run in training.
    pub(super) fn saved_episode(&self) -> u64 {
        self.saved_episode
    }

    /// The finished episodes, in order; a long history is thinned evenly, but includes the latest.
    pub fn records(&self) -> &[EpisodeRecord] {
        &self.history.records
    }

    /// The greedy evaluations, in order; a long history is thinned evenly, but includes the latest.
    pub fn evaluations(&self) -> &[EvaluationRecord] {
        &self.history.evaluations
    }

    /// Results of the practice before its first episode, if there was any.
    pub fn practised(&self) -> Option<&Practised> {
        self.history.practised.as_ref()
    }

    /// The present need for exploration of each stage, the goal last; empty if epsilon does not depend on need.
    pub fn needs(&self) -> &[f32] {
        &self.history.needs
    }

    /// Interventions of users and processes, in order.
    pub fn interventions(&self) -> &[Event] {
        &self.history.interventions
    }

    /// The latest requested episode, with its networks.
    pub fn live(&self) -> Option<&LiveView> {
        self.live.as_ref()
    }

    /// Requests a [`LiveView`] of the next episode.
    pub fn request_live(&self) {
        if let Some(trainer) = &self.trainer {
            trainer.watch().request();
        }
    }

    /// What the trainer is doing, if this process trains the run.
    pub fn phase(&self) -> Option<Phase> {
        self.trainer.as_ref().map(|trainer| trainer.watch().phase())
    }

    /// The action prior of the run, if it has one: the one in use, or the saved one of an inactive run.
    pub fn prior(&self) -> Option<Arc<ActionPrior>> {
        match &self.trainer {
            Some(trainer) => trainer.watch().prior(),
            None => self.saved_prior.get(),
        }
    }

    /// Whether this process is training it.
    pub fn is_active(&self) -> bool {
        self.trainer.is_some()
    }

    /// Whether this process trains it or has trained it.
    pub(super) fn was_trained_here(&self) -> bool {
        self.trained_here
    }

    /// Its failure in this process, if any.
    pub fn failure(&self) -> Option<&str> {
        let of_prior = || self.saved_prior.known.as_ref().and_then(|prior| prior.as_ref().err());
        self.failure.as_ref().or_else(of_prior).map(String::as_str)
    }

    /// Whether it is being trained, or how it ended.
    pub fn state(&self) -> RunState {
        let working = self.is_active();
        match &self.history.last {
            Some(Event::Finished { .. }) if working || self.trained_here => RunState::Finished,
            Some(Event::Stopped { reason, .. }) if !working => RunState::Stopped(reason.clone()),
            Some(Event::Failed { reason, .. }) if !working => RunState::Failed(reason.clone()),
            Some(Event::Paused { .. }) if working && !self.leaving_pause => RunState::Paused,
            _ if working => RunState::Running,
            _ => match &self.failure {
                Some(failure) => RunState::Failed(failure.clone()),
                None => self.directory.status().map_or(RunState::Interrupted, |status| status.state),
            },
        }
    }

    /// Access to its recorded episodes and checkpoints.
    pub fn saved(&self) -> SavedRun {
        SavedRun::new(self.directory.clone(), self.config.clone(), self.checkpoint)
    }

    pub(super) fn set_checkpoint(&mut self, checkpoint: CheckpointName) {
        self.checkpoint = checkpoint;
    }

    /// The latest requested episode of its greedy policy.
    pub fn greedy(&self) -> Option<&Arc<Trace>> {
        self.greedy.as_ref()
    }

    pub(super) fn set_greedy(&mut self, trace: Trace) {
        self.greedy = Some(Arc::new(trace));
    }
}
