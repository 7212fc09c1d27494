//! A run as the workbench shows it: its log so far, and the trainer if it is ours.

use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::agent::Ddpg;
use crate::run::{
    CheckpointName, EpisodeRecord, EvaluationRecord, Event, EventReader, RunDirectory, RunError, RunHistory, RunState,
};
use crate::trainer::{Control, LiveView, NETWORKS_SECTION, Phase, RunConfig, Trace, Trainer, greedy_episode};

use super::SessionError;

/// A run, live or finished, ours or another process's: a reader of its log.
#[derive(Debug)]
pub struct RunView {
    directory: RunDirectory,
    config: RunConfig,
    reader: EventReader,
    history: RunHistory,
    trainer: Option<Trainer>,
    live: Option<LiveView>,
    failure: Option<String>,
    /// It was asked to go on and has not said so yet.
    resuming: bool,
    trained_here: bool,
}

impl RunView {
    /// Opens the run in a folder, to look at.
    ///
    /// # Errors
    /// When there is no run, or one that cannot be read.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        Self::new(RunDirectory::open(path)?)
    }

    /// Opens the run in a folder and reads all there is of its log.
    ///
    /// # Errors
    /// As [`RunView::open`].
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let mut view = Self::open(path)?;
        view.poll();
        Ok(view)
    }

    pub(super) fn new(directory: RunDirectory) -> Result<Self, RunError> {
        let config = directory.config()?;
        let reader = directory.events();
        Ok(Self {
            directory,
            config,
            reader,
            history: RunHistory::default(),
            trainer: None,
            live: None,
            failure: None,
            resuming: false,
            trained_here: false,
        })
    }

    /// Begins to train it in this process.
    pub(super) fn start(&mut self) -> Result<(), SessionError> {
        // What the log says so far is the past: an old failure is no news.
        self.poll();
        self.failure = None;
        self.trained_here = true;
        self.trainer = Some(Trainer::spawn(self.directory.clone()).map_err(SessionError::Thread)?);
        Ok(())
    }

    /// Reads what is new. Returns the new events, and whether anything changed.
    pub(super) fn poll(&mut self) -> (Vec<Event>, bool) {
        let mut changed = false;
        let mut events = Vec::new();
        match self.reader.poll() {
            Ok(poll) => {
                if poll.restarted {
                    self.history = RunHistory::default();
                    changed = true;
                }
                self.failure = poll.problems.first().map(ToString::to_string).or(self.failure.take());
                events.extend(poll.events.into_iter().map(|logged| logged.event));
            }
            Err(error) => self.failure = Some(error.to_string()),
        }
        for event in &events {
            self.history.note(event);
            self.resuming &= !matches!(event, Event::Resumed { .. });
        }
        if let Some(trainer) = &mut self.trainer {
            if let Some(view) = trainer.watch().take() {
                self.live = Some(view);
                changed = true;
            }
            if let Some(outcome) = trainer.outcome() {
                self.failure = outcome.err();
                self.trainer = None;
                changed = true;
            }
        }
        changed |= !events.is_empty();
        (events, changed)
    }

    /// Asks the trainer for something, if the run is ours and active.
    pub(super) fn send(&mut self, control: Control) -> Result<(), SessionError> {
        match &self.trainer {
            Some(trainer) if trainer.is_active() => {
                let goes_on = matches!(control, Control::Resume | Control::Advance(_));
                self.resuming = goes_on && matches!(self.history.last, Some(Event::Paused { .. }));
                trainer.send(control);
                Ok(())
            }
            _ => Err(SessionError::NotActive),
        }
    }

    /// The run's files.
    pub fn directory(&self) -> &RunDirectory {
        &self.directory
    }

    /// The name of its folder.
    pub fn name(&self) -> String {
        self.directory.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    /// Its configuration.
    pub fn config(&self) -> &RunConfig {
        &self.config
    }

    /// The finished episodes, in order.
    pub fn records(&self) -> &[EpisodeRecord] {
        &self.history.records
    }

    /// The greedy evaluations, in order.
    pub fn evaluations(&self) -> &[EvaluationRecord] {
        &self.history.evaluations
    }

    /// The latest finished episode that was asked for, with its networks.
    pub fn live(&self) -> Option<&LiveView> {
        self.live.as_ref()
    }

    /// Asks for a [`LiveView`] of the next episode.
    pub fn request_live(&self) {
        if let Some(trainer) = &self.trainer {
            trainer.watch().request();
        }
    }

    /// What the trainer is doing, if the run is ours and active.
    pub fn phase(&self) -> Option<Phase> {
        self.trainer.as_ref().map(|trainer| trainer.watch().phase())
    }

    /// The action prior of the run, if the run is ours and has one.
    pub fn prior(&self) -> Option<Arc<crate::guidance::ActionPrior>> {
        self.trainer.as_ref().and_then(|trainer| trainer.watch().prior())
    }

    /// Whether this process trains it now.
    pub fn is_active(&self) -> bool {
        self.trainer.is_some()
    }

    /// Whether this process has trained it at any time.
    pub(super) fn was_trained_here(&self) -> bool {
        self.trained_here
    }

    /// What went wrong with it here, if anything.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Whether somebody works on it, or how it ended.
    pub fn state(&self) -> RunState {
        let working = self.is_active();
        match &self.history.last {
            Some(Event::Finished { .. }) => RunState::Finished,
            Some(Event::Stopped { reason, .. }) if !working => RunState::Stopped(reason.clone()),
            Some(Event::Failed { reason, .. }) if !working => RunState::Failed(reason.clone()),
            Some(Event::Paused { .. }) if working && !self.resuming => RunState::Paused,
            _ if working => RunState::Running,
            _ => match &self.failure {
                Some(failure) => RunState::Failed(failure.clone()),
                None => self.directory.status().map_or(RunState::Interrupted, |status| status.state),
            },
        }
    }

    /// The agent of the newest checkpoint.
    ///
    /// # Errors
    /// When there is no checkpoint yet, or one that cannot be read.
    pub fn saved_agent(&self) -> Result<Ddpg, SessionError> {
        let checkpoint = self.directory.checkpoints().load(CheckpointName::Last)?;
        Ok(Ddpg::load(checkpoint.section(NETWORKS_SECTION)?)?)
    }

    /// An episode of the greedy policy of the newest checkpoint.
    ///
    /// # Errors
    /// As [`RunView::saved_agent`].
    pub fn greedy_episode(&self, seed: u64) -> Result<Trace, SessionError> {
        let agent = self.saved_agent()?;
        Ok(greedy_episode(&self.config.task, &agent, &mut ChaCha8Rng::seed_from_u64(seed)))
    }
}
