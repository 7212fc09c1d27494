//! A run as the workbench shows it: its log, and its trainer if this process trains it.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use mge_base::stop::Stop;
use mge_guidance::ActionPrior;
use mge_run::{CheckpointName, Event, LoggedEvent, Poll, RunDirectory, RunError, RunHistory, RunState};
use mge_trainer::{Control, LiveView, Phase, RunConfig, Trace, Trainer};

use super::SessionError;
use super::job::CANCELLED;
use super::loader::Loader;
use super::run_log::{MAX_KEPT, RunLog, read_prior};
use super::saved::SavedRun;

/// A run, live or finished, of this or another process: a reader of its log.
#[derive(Debug)]
pub struct RunView {
    /// In the session, from 0 in the order in which runs were started or opened.
    pub number: usize,
    /// Its name, if it has one, otherwise that of its folder.
    pub name: String,
    /// Its folder and configuration, and the checkpoint of the agent that plays.
    pub saved: SavedRun,
    pub(super) log: RunLog,
    /// Number of episodes at the latest checkpoint of a run in training.
    pub(super) saved_episode: u64,
    trainer: Option<Trainer>,
    /// The latest requested episode, with its networks.
    pub live: Option<LiveView>,
    failure: Option<String>,
    /// The prior in its folder, by the number of its changes.
    saved_prior: Loader<u64, Option<Arc<ActionPrior>>>,
    /// Number of events so far after which the prior in the folder is another one.
    prior_changes: u64,
    /// The end of a pause was sent, the effect of which has not been read yet.
    resuming: bool,
    /// This process trains it or has trained it.
    pub(super) trained_here: bool,
    /// The latest requested episode of its greedy policy.
    pub greedy: Option<Arc<Trace>>,
    /// The existing log is still being read in the background.
    pub unread: bool,
    turn: Option<Turn>,
}

/// What is wrong with commands for a run in the queue.
pub(super) const QUEUED: &str = "waits for a free core: `stop` takes it out of the queue";

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
        view.read_to_end(&mut false, &mut Vec::new());
        Ok(view)
    }

    pub(super) fn new(directory: RunDirectory) -> Result<Self, RunError> {
        let config = Arc::new(RunConfig::of(&directory)?);
        Ok(Self {
            number: 0,
            name: directory.name(),
            log: RunLog::new(&directory, MAX_KEPT),
            saved: SavedRun { config, directory, checkpoint: CheckpointName::Last },
            saved_episode: 0,
            trainer: None,
            live: None,
            failure: None,
            saved_prior: Loader::default(),
            prior_changes: 0,
            resuming: false,
            trained_here: false,
            greedy: None,
            unread: false,
            turn: None,
        })
    }

    /// The run with its whole log and its prior, which takes long.
    ///
    /// # Errors
    /// When the log cannot be read, or `stop` is requested.
    pub(super) fn with_whole_log(mut self, stop: &Stop) -> Result<Self, String> {
        loop {
            // Of several problems the first is told.
            let problem = self.failure.take();
            let news = self.log.read()?;
            let more = self.follow(Ok(news), &mut false, &mut Vec::new());
            self.failure = problem.or(self.failure);
            if !more {
                break;
            }
            if stop.is_requested() {
                return Err(CANCELLED.to_owned());
            }
        }
        self.saved_prior.set(self.prior_changes, read_prior(&self.saved.directory, &self.saved.config.task));
        Ok(self)
    }

    /// Takes over what the job has [read](Self::with_whole_log) and continues reading the log from there. Past events
    /// are not reported.
    ///
    /// # Errors
    /// When the log could not be read; the run then leaves the queue.
    pub(super) fn take_over(&mut self, read: Result<Self, String>) -> Result<(), String> {
        self.unread = false;
        match read {
            Ok(read) => {
                self.failure = read.failure.or(self.failure.take()).filter(|_| !self.is_queued());
                (self.log, self.saved_episode) = (read.log, read.saved_episode);
                (self.saved_prior, self.prior_changes) = (read.saved_prior, read.prior_changes);
                Ok(())
            }
            Err(reason) => {
                self.unqueue();
                self.failure = Some(reason.clone());
                Err(reason)
            }
        }
    }

    /// Queues it for training in this process, after runs with lower turns; with `until`, it pauses
    /// after this many episodes in total.
    pub(super) fn enqueue(&mut self, turn: u64, until: Option<u32>) {
        // Reads the existing log first, so that an old failure is not reported again.
        self.poll(true);
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

    /// Starts training it if it is queued; false if it does not begin.
    pub(super) fn start(&mut self) -> bool {
        let Some(turn) = self.turn.take() else { return false };
        let first = turn.until.map(|until| Control::PauseAt(until.into()));
        match Trainer::spawn(self.saved.directory.clone(), first) {
            // How an earlier training ended says nothing about this one, which may fail before its first event.
            Ok(trainer) => (self.trainer, self.log.history.last) = (Some(trainer), None),
            Err(error) => self.failure = Some(format!("cannot start a thread: {error}")),
        }
        self.trainer.is_some()
    }

    /// Whether it occupies a core.
    pub(super) fn is_working(&self) -> bool {
        self.is_active() && self.state() != RunState::Paused
    }

    /// Reads the new events: with `waits` all of them, also if that takes long, else those that were read in the
    /// background. Returns them, and whether anything changed.
    pub(super) fn poll(&mut self, waits: bool) -> (Vec<Event>, bool) {
        let (mut events, mut changed, mut is_over) = (Vec::new(), false, false);
        if self.unread {
            return (events, changed);
        }
        let has_ended = self.trainer.as_ref().is_some_and(|trainer| !trainer.is_active());
        if waits {
            self.read_to_end(&mut changed, &mut events);
            is_over = has_ended;
        } else if let Some(part) = self.log.poll(self.is_active(), has_ended) {
            let more = self.follow(part.news, &mut changed, &mut events);
            is_over = part.has_ended && !more;
            changed |= self.name != part.name;
            self.name = part.name;
            if let Some(config) = part.config.filter(|config| *config != *self.saved.config) {
                (self.saved.config, changed) = (Arc::new(config), true);
            }
        }
        self.take_outcome(is_over, changed, events)
    }

    /// Takes over what a training shows and, once `has_ended` and all its events were read, how it ended.
    fn take_outcome(&mut self, has_ended: bool, mut changed: bool, mut events: Vec<Event>) -> (Vec<Event>, bool) {
        if let Some(trainer) = &mut self.trainer {
            if let Some(view) = trainer.watch.take() {
                self.live = Some(view);
                changed = true;
            }
            if has_ended && let Some(outcome) = trainer.outcome() {
                let failed = outcome.err();
                self.saved_prior.set(self.prior_changes, Ok(trainer.watch.prior()));
                self.trainer = None;
                self.resuming = false;
                changed = true;
                // Its events lack a failure that could not be written, as on a full disk.
                if let Some(reason) = failed.clone()
                    && !matches!(self.log.history.last, Some(Event::Failed { .. }))
                {
                    events.push(Event::Failed { episode: self.episodes(), reason });
                }
                self.failure = failed;
            }
        }
        if self.trainer.is_none() && !self.trained_here {
            let (directory, task) = (self.saved.directory.clone(), self.saved.config.task.clone());
            self.saved_prior.request(self.prior_changes, Duration::MAX, move |_| read_prior(&directory, &task));
        }
        changed |= self.saved_prior.poll() | !events.is_empty();
        (events, changed)
    }

    /// Reads the log to its end and appends the new events. Sets `restarted` when the log is read from the start again
    /// because the run was rolled back to a checkpoint; events that were read before are then not appended again.
    fn read_to_end(&mut self, restarted: &mut bool, events: &mut Vec<Event>) {
        loop {
            let news = self.log.read();
            if !self.follow(news, restarted, events) {
                return;
            }
        }
    }

    /// Takes over a part of the log, as [`RunView::read_to_end`]; true if there is more.
    fn follow(&mut self, news: Result<Poll, String>, restarted: &mut bool, events: &mut Vec<Event>) -> bool {
        let news = match news {
            Ok(news) => news,
            Err(error) => {
                // An earlier failure, such as that of the training, explains more than a missing log.
                self.failure.get_or_insert(error);
                return false;
            }
        };
        *restarted |= news.restarted;
        self.failure = news.problems.first().map(ToString::to_string).or(self.failure.take());
        for LoggedEvent { time, event } in news.events {
            if matches!(event, Event::Paused { .. } | Event::Resumed { .. } | Event::Started { .. }) {
                self.resuming = false;
            }
            if let Event::Started { episode, .. } | Event::Checkpointed { episode, .. } | Event::Paused { episode } =
                event
            {
                self.saved_episode = episode;
            }
            if matches!(event, Event::ClustersChanged { .. } | Event::Started { .. }) {
                self.prior_changes += 1;
            }
            if !*restarted || time > self.log.latest {
                events.push(event);
            }
            self.log.latest = self.log.latest.max(time);
        }
        news.more
    }

    /// Sends a control to the trainer, in this or another process.
    pub(super) fn send(&mut self, control: Control) -> Result<(), SessionError> {
        let is_paused = matches!(self.log.history.last, Some(Event::Paused { .. }));
        let ends_pause = matches!(control, Control::Resume | Control::PauseAt(_) | Control::Stop { .. });
        match &self.trainer {
            Some(trainer) if trainer.is_active() => trainer.send(control),
            _ if self.is_queued() => return Err(format!("{} {QUEUED}", self.name).into()),
            _ => self.ask_others(control)?,
        }
        self.resuming |= is_paused && ends_pause;
        Ok(())
    }

    /// Sends a control to the other process that trains the run, if there is one.
    fn ask_others(&self, control: Control) -> Result<(), SessionError> {
        if !self.saved.directory.is_locked()? {
            let problem = "is not being trained: `continue` resumes one that is not finished";
            return Err(format!("{} {problem}", self.name).into());
        }
        let request = match control {
            Control::PauseAt(episode) => match episode.saturating_sub(self.episodes()) {
                0 => Control::Pause,
                more => Control::Advance { episodes: u32::try_from(more).unwrap_or(u32::MAX) },
            },
            Control::SetPrior(_) => {
                return Err(format!("{} is trained by another process, which cannot be given clusters", self.name))?;
            }
            request => request,
        };
        Ok(self.saved.directory.request(&request)?)
    }

    /// The run's files.
    pub fn directory(&self) -> &RunDirectory {
        &self.saved.directory
    }

    /// Its configuration.
    pub fn config(&self) -> &Arc<RunConfig> {
        &self.saved.config
    }

    /// Number of finished episodes.
    pub fn episodes(&self) -> u64 {
        self.log.history.records.last().map_or(0, |record| record.episode)
    }

    /// What its log says; many episodes or evaluations are thinned evenly, but include the latest.
    pub fn history(&self) -> &RunHistory {
        &self.log.history
    }

    /// Requests a [`LiveView`] of the next episode.
    pub fn request_live(&self) {
        if let Some(trainer) = &self.trainer {
            trainer.watch.request();
        }
    }

    /// What the trainer is doing, if this process trains the run.
    pub fn phase(&self) -> Option<Phase> {
        self.trainer.as_ref().map(|trainer| trainer.watch.phase())
    }

    /// The action prior of the run, if it has one: the one in use, or the saved one of an inactive run.
    pub fn prior(&self) -> Option<Arc<ActionPrior>> {
        match &self.trainer {
            Some(trainer) => trainer.watch.prior(),
            None => self.saved_prior.latest(|_| true)?.1.clone().ok().flatten(),
        }
    }

    /// Whether this process is training it.
    pub fn is_active(&self) -> bool {
        self.trainer.is_some()
    }

    /// Its failure in this process, if any.
    pub fn failure(&self) -> Option<&str> {
        let of_prior = || self.saved_prior.latest(|_| true).and_then(|(_, prior)| prior.as_ref().err());
        self.failure.as_ref().or_else(of_prior).map(String::as_str)
    }

    /// Whether its log cannot be read, or not completely.
    pub fn is_damaged(&self) -> bool {
        let has_failed = matches!(self.log.history.last, Some(Event::Failed { .. }));
        !self.trained_here && !has_failed && self.failure.is_some()
    }

    /// Whether it is being trained, or how it ended.
    pub fn state(&self) -> RunState {
        let on_disk = || self.saved.directory.status().map_or(RunState::Interrupted, |status| status.state);
        self.last_state().unwrap_or_else(on_disk)
    }

    /// Its state as far as it is known without reading its files: None if another process may have changed it.
    pub fn last_state(&self) -> Option<RunState> {
        let working = self.is_active();
        match &self.log.history.last {
            Some(Event::Finished { .. }) if working || self.trained_here => Some(RunState::Finished),
            Some(Event::Stopped { reason, .. }) if !working => Some(RunState::Stopped(reason.clone())),
            Some(Event::Failed { reason, .. }) if !working => Some(RunState::Failed(reason.clone())),
            Some(Event::Paused { .. }) if working && !self.resuming => Some(RunState::Paused),
            _ if working => Some(RunState::Running),
            _ => self.failure.clone().map(RunState::Failed),
        }
    }
}
