//! The session: the one place where the state of the workbench lives.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::SessionError;
use super::command::{self, Command, Epsilon, Expect, Guide, Quantity, Recording, Stop};
use super::hand_play::HandPlay;
use super::journal::Journal;
use super::model_job::ModelJob;
use super::prior_job::{PriorJob, PriorKey};
use super::proposal_job::ProposalJob;
use super::run::RunView;
use super::setup::Setup;
use crate::guidance::ActionPrior;
use crate::run::{Event, RunDirectory};
use crate::task::{self, Task};
use crate::trainer::{Control, RunConfig};

/// Something worth telling that happened in the background.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// The clusters' build reached a stage.
    PriorStage { stage: usize, stages: usize },
    /// The clusters are there.
    PriorReady,
    /// The clusters could not be computed.
    PriorFailed(String),
    /// A dynamics model was trained or measured: what came of it, or why it failed.
    Model(Result<String, String>),
    /// Subgoals are proposed: how many, or why there are none.
    Proposed(Result<String, String>),
    /// Something happened in a run.
    Run { index: usize, event: Event },
    /// Something else that is seen changed.
    Changed,
}

/// How the clusters stand to the present task and settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorState {
    /// There are none.
    Absent,
    /// They are being computed: the stage, from 0, of so many.
    Building { stage: usize, stages: usize },
    /// They belong to the task and settings as they are.
    Fresh,
    /// Task or settings have changed since.
    Stale,
}

/// The task that a script begins with unless it opens another.
pub const FIRST_TASK: &str = "task1";

/// Everything the workbench knows. Changed by commands, and by [`Session::poll`], which
/// takes in what the background threads have done.
#[derive(Debug)]
pub struct Session {
    pub(super) setup: Setup,
    pub(super) prior: Option<(PriorKey, Arc<ActionPrior>)>,
    pub(super) job: Option<PriorJob>,
    job_stage: Option<usize>,
    /// Of clusters that could not be computed: trying again would fail again.
    hopeless: Option<PriorKey>,
    model_job: Option<ModelJob>,
    pub(super) proposal_job: Option<ProposalJob>,
    pub(super) runs: Vec<RunView>,
    /// Number of the run that commands act on.
    pub(super) current: Option<usize>,
    /// Runs so far, also those deleted.
    pub(super) numbered: usize,
    /// Runs that are trained at the same time; more are queued.
    pub(super) cores: usize,
    pub(super) folder: PathBuf,
    pub(super) hand_play: HandPlay,
    pub(super) journal: Journal,
    pub(super) quit: bool,
}

impl Session {
    /// A session on a task, with `folder` for its runs.
    pub fn new(task: Task, folder: PathBuf) -> Self {
        let setup = Setup::new(task);
        Self {
            hand_play: HandPlay::new(setup.config.task.clone(), setup.config.seed),
            setup,
            prior: None,
            job: None,
            job_stage: None,
            hopeless: None,
            model_job: None,
            proposal_job: None,
            runs: Vec::new(),
            current: None,
            numbered: 0,
            cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            folder,
            journal: Journal::default(),
            quit: false,
        }
    }

    /// A session on a shipped task or a task file.
    ///
    /// # Errors
    /// When there is no such task, or one that cannot be played.
    pub fn on_task(name: &str, folder: PathBuf) -> Result<Self, SessionError> {
        let mut session = Self::new(task::load(name)?, folder);
        // The file is where the task is saved; and the recorded script says which task it is.
        session.apply(command::Task(name.to_owned()))?;
        Ok(session)
    }

    /// A session that has opened a run, on the run's task.
    ///
    /// # Errors
    /// When there is no run, or one that cannot be read.
    pub fn on_run(folder: &Path) -> Result<Self, SessionError> {
        let config: RunConfig = RunDirectory::open(folder)?.config()?;
        let mut session = Self::new(Task::clone(&config.task), folder.parent().unwrap_or(folder).to_owned());
        session.apply(command::Open(folder.to_owned()))?;
        Ok(session)
    }

    /// Carries out a command and returns what to report.
    ///
    /// # Errors
    /// When the command cannot be carried out; nothing has changed then.
    pub fn apply(&mut self, command: impl Into<Command>) -> Result<String, SessionError> {
        let command = command.into();
        let training = self.run().filter(|run| run.is_active());
        let training = training.map(|run| (run.number(), run.records().len() as u32));
        let recording = command.recording(self);
        let report = command.execute(self)?;
        match (recording, training) {
            (Recording::Never, _) | (Recording::WhenEffective, Some(_)) => {}
            (Recording::AtEpisode, Some((run, episode))) => self.journal.note_at(command, run, episode),
            (Recording::As(other), _) => self.journal.note(other, self.current),
            _ => self.journal.note(command, self.current),
        }
        Ok(report)
    }

    /// Changes the task or the settings of the next run.
    pub(super) fn change(
        &mut self,
        change: impl FnOnce(&mut Setup) -> Result<String, SessionError>,
    ) -> Result<String, SessionError> {
        let before = self.setup.config.task.clone();
        let report = change(&mut self.setup)?;
        if !Arc::ptr_eq(&before, &self.setup.config.task) {
            self.restart_hand_play();
        }
        Ok(report)
    }

    pub(super) fn restart_hand_play(&mut self) {
        self.hand_play = HandPlay::new(self.setup.config.task.clone(), self.setup.config.seed);
    }

    /// Forgets what belongs to the task that was left: its clusters say nothing about another.
    pub(super) fn forget_task(&mut self) {
        self.job = None;
        self.proposal_job = None;
        self.prior = None;
    }

    /// Notes what took effect in a run.
    fn note_effect(&mut self, run: usize, event: &Event) {
        let command: Command = match event {
            Event::ScheduleChanged { schedule, .. } => match schedule.parse() {
                Ok(schedule) => Epsilon(schedule).into(),
                Err(_) => return,
            },
            Event::ClustersChanged { episode: 1.., .. } => Guide.into(),
            Event::Stopped { .. } => Stop.into(),
            _ => return,
        };
        self.journal.note_at(command, run, u32::try_from(event.episode()).unwrap_or(u32::MAX));
    }

    /// Takes in what happened in the background since the last call.
    pub fn poll(&mut self) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.poll_job(&mut notices);
        self.poll_model_job(&mut notices);
        self.poll_proposals(&mut notices);
        for (index, run) in self.runs.iter_mut().enumerate() {
            let (events, changed) = run.poll();
            if changed && events.is_empty() {
                notices.push(Notice::Changed);
            }
            notices.extend(events.into_iter().map(|event| Notice::Run { index, event }));
        }
        for notice in &notices {
            if let Notice::Run { index, event } = notice
                && self.runs[*index].was_trained_here()
            {
                self.note_effect(self.runs[*index].number(), event);
            }
        }
        if self.start_queued() {
            notices.push(Notice::Changed);
        }
        notices
    }

    fn poll_model_job(&mut self, notices: &mut Vec<Notice>) {
        let Some(job) = &mut self.model_job else { return };
        if job.is_news() {
            notices.push(Notice::Changed);
        }
        if let Some(outcome) = job.outcome() {
            self.model_job = None;
            notices.push(Notice::Model(outcome));
        }
    }

    pub(super) fn begin_model_job(&mut self, job: std::io::Result<ModelJob>) -> Result<String, SessionError> {
        if let Some(job) = &self.model_job {
            return Err(SessionError::Failed(format!("{}: wait for its end, or end it with `model stop`", job.name())));
        }
        let job = job.map_err(SessionError::Thread)?;
        let told = job.name().to_owned();
        self.model_job = Some(job);
        Ok(told)
    }

    pub(super) fn end_model_job(&mut self) -> Result<String, SessionError> {
        match self.model_job.take() {
            Some(job) => Ok(format!("ended: {}", job.name())),
            None => Err(SessionError::Failed("no dynamics model is being trained or measured".to_owned())),
        }
    }

    fn poll_job(&mut self, notices: &mut Vec<Notice>) {
        let Some(job) = &mut self.job else { return };
        let stage = job.stage();
        if self.job_stage != Some(stage) {
            self.job_stage = Some(stage);
            notices.push(Notice::PriorStage { stage, stages: job.stages });
        }
        if let Some(outcome) = job.outcome() {
            let key = job.key.clone();
            self.job = None;
            self.job_stage = None;
            notices.push(match outcome {
                Ok(prior) => {
                    self.prior = Some((key, Arc::new(prior)));
                    Notice::PriorReady
                }
                Err(reason) => {
                    self.hopeless = Some(key);
                    Notice::PriorFailed(reason)
                }
            });
        }
    }

    /// Waits until no run is being trained and no clusters are being computed; `on_notice`
    /// sees what happens meanwhile.
    ///
    /// # Errors
    /// When the clusters or a run failed.
    pub fn wait(&mut self, mut on_notice: impl FnMut(&Notice)) -> Result<String, SessionError> {
        loop {
            let idle = self.is_idle();
            for notice in self.poll() {
                on_notice(&notice);
                match notice {
                    Notice::PriorFailed(reason) | Notice::Model(Err(reason)) | Notice::Proposed(Err(reason)) => {
                        return Err(SessionError::Failed(reason));
                    }
                    Notice::Run { index, event: Event::Failed { reason, .. } }
                        if self.runs.get(index).is_some_and(RunView::was_trained_here) =>
                    {
                        return Err(SessionError::Failed(reason));
                    }
                    _ => {}
                }
            }
            if idle {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        match self.run().and_then(RunView::failure) {
            Some(reason) => Err(SessionError::Failed(reason.to_owned())),
            None => Ok("nothing is under way".to_owned()),
        }
    }

    /// Whether nothing is under way but what is paused.
    pub fn is_idle(&self) -> bool {
        let busy = |run: &RunView| run.is_working() || run.is_queued();
        let jobs = self.job.is_some() || self.model_job.is_some() || self.proposal_job.is_some();
        !jobs && !self.runs.iter().any(busy)
    }

    pub(super) fn compute_clusters(&mut self, file: Option<&Path>) -> Result<String, SessionError> {
        self.setup.config.validate()?;
        self.job = Some(PriorJob::spawn(&self.setup.config).map_err(SessionError::Thread)?);
        let Some(path) = file else { return Ok("computing the action clusters".to_owned()) };
        self.wait(|_| {})?;
        let prior = self.prior().ok_or(SessionError::NoClusters)?;
        crate::atomic::write(path, prior.to_json().as_bytes())
            .map_err(|source| SessionError::Write { path: path.to_owned(), source })?;
        Ok(format!("saved the action clusters to {}", path.display()))
    }

    pub(super) fn expect(&mut self, expected: &Expect) -> Result<String, SessionError> {
        self.poll();
        let run = || self.run().ok_or(SessionError::NoRun);
        let found = match expected.quantity {
            Quantity::Episodes => run()?.records().len() as f64,
            Quantity::Success => run()?.records().last().map_or(0.0, |record| record.rolling_success),
            Quantity::Greedy => run()?.evaluations().last().map_or(0.0, |evaluation| evaluation.success),
            Quantity::Clusters => {
                let prior = self.prior().ok_or(SessionError::NoClusters)?;
                prior.stages.iter().map(|stage| stage.clusters.len()).sum::<usize>() as f64
            }
            Quantity::Subgoals => self.task().subgoals.len() as f64,
            Quantity::Proposals => self.proposed().len() as f64,
        };
        let Expect { comparison, value, .. } = *expected;
        if comparison.holds(found, value) {
            Ok(format!("{} is {found}", expected.quantity.name()))
        } else {
            Err(SessionError::Expectation { expected: *expected, found })
        }
    }

    /// The task as edited.
    pub fn task(&self) -> &Task {
        self.setup.editor.task()
    }

    /// Whether the task has edits that are not saved.
    pub fn is_dirty(&self) -> bool {
        self.setup.editor.is_dirty()
    }

    /// The file of the task, if it is not a shipped one.
    pub fn file(&self) -> Option<&Path> {
        self.setup.file.as_deref()
    }

    /// The settings of the next run.
    pub fn config(&self) -> &RunConfig {
        &self.setup.config
    }

    /// The action clusters, fresh or stale.
    pub fn prior(&self) -> Option<&Arc<ActionPrior>> {
        self.prior.as_ref().map(|(_, prior)| prior)
    }

    /// How the clusters stand to the present task and settings.
    pub fn prior_state(&self) -> PriorState {
        match (&self.job, &self.prior) {
            (Some(job), _) => PriorState::Building { stage: job.stage(), stages: job.stages },
            (None, None) => PriorState::Absent,
            (None, Some((key, _))) if *key == PriorKey::of(&self.setup.config) => PriorState::Fresh,
            (None, Some(_)) => PriorState::Stale,
        }
    }

    /// All runs of the session.
    pub fn runs(&self) -> &[RunView] {
        &self.runs
    }

    /// The run that commands act on.
    pub fn run(&self) -> Option<&RunView> {
        self.runs.iter().find(|run| Some(run.number()) == self.current)
    }

    pub(super) fn run_mut(&mut self) -> Option<&mut RunView> {
        self.runs.iter_mut().find(|run| Some(run.number()) == self.current)
    }

    /// What is being done about a dynamics model: its name and its progress from 0 to 1.
    pub fn model_work(&self) -> Option<(&str, Option<f32>)> {
        self.model_job.as_ref().map(|job| (job.name(), job.progress()))
    }

    /// Whether there are clusters, finished or on their way, that no longer belong to the
    /// task and settings, and computing them anew is worth trying.
    pub fn clusters_are_outdated(&self) -> bool {
        let key = PriorKey::of(&self.setup.config);
        let latest = self.job.as_ref().map(|job| &job.key).or(self.prior.as_ref().map(|(key, _)| key));
        latest.is_some_and(|latest| *latest != key) && self.hopeless.as_ref() != Some(&key)
    }

    /// The folder for new runs.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The episode played by hand.
    pub fn hand_play(&self) -> &HandPlay {
        &self.hand_play
    }

    /// The session so far as a script that does the same without a terminal.
    pub fn to_script(&self) -> String {
        self.journal.to_script()
    }

    /// Whether `quit` was given.
    pub fn has_quit(&self) -> bool {
        self.quit
    }
}

impl Drop for Session {
    /// All trainings are told to stop before the first is waited for.
    fn drop(&mut self) {
        for run in &mut self.runs {
            // What is not being trained has nothing to stop.
            let _ = run.send(Control::Stop { reason: "the program ended".to_owned() });
        }
    }
}
