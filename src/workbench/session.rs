//! The session: the one place where the state of the workbench lives.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::SessionError;
use super::command::{Command, Expectation, Quantity};
use super::hand::HandPlay;
use super::journal::Journal;
use super::model_job::ModelJob;
use super::prior_job::{PriorJob, PriorKey};
use super::proposal_job::ProposalJob;
use super::runs::RunView;
use crate::guidance::{ActionPrior, EpsilonSchedule};
use crate::run::Event;
use crate::task::{Editor, Task};
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

/// Everything the workbench knows. Changed by commands, and by [`Session::poll`], which
/// takes in what the background threads have done.
#[derive(Debug)]
pub struct Session {
    pub(super) editor: Editor,
    pub(super) file: Option<PathBuf>,
    pub(super) settings: RunConfig,
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
    pub(super) hand: HandPlay,
    pub(super) journal: Journal,
    quit: bool,
}

impl Session {
    /// A session on a task, with `folder` for its runs.
    pub fn new(task: Task, folder: PathBuf) -> Self {
        let settings = RunConfig::new(Arc::new(task.clone()));
        Self {
            hand: HandPlay::new(settings.task.clone(), settings.seed),
            editor: Editor::new(task),
            file: None,
            settings,
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

    /// A session with the same task and settings, and none of the work.
    pub(super) fn at_rest(&self) -> Self {
        let mut other = Self::new(self.task().clone(), self.folder.clone());
        other.editor = self.editor.clone();
        other.settings = self.settings.clone();
        other
    }

    /// Carries out a command and returns what to tell the person.
    ///
    /// # Errors
    /// When the command cannot be carried out; nothing has changed then.
    pub fn apply(&mut self, command: Command) -> Result<String, SessionError> {
        let before = self.run().map(|run| (run.number(), run.is_active(), run.records().len() as u32));
        let known = matches!(&command, Command::Open(folder) if self.number_of(folder).is_some());
        let told = self.carry_out(&command)?;
        match (command, before) {
            // Of these, the effect on the training is noted when it is heard of.
            (Command::Epsilon(_) | Command::Guide | Command::Stop, Some((_, true, _))) => {}
            (
                Command::Pause
                | Command::Resume { .. }
                | Command::Wait
                | Command::Record(_)
                | Command::Delete(_)
                | Command::ModelStop
                | Command::Propose(_)
                | Command::Quit,
                _,
            ) => {}
            (
                command @ (Command::Figure { .. } | Command::Evaluate | Command::Expect(_)),
                Some((run, true, episode)),
            ) => {
                self.journal.note_at(command, run, episode);
            }
            (Command::Open(_), _) if known => {
                self.journal.note(Command::Watch(self.current.unwrap_or(0)), self.current);
            }
            (command, _) => self.journal.note(command, self.current),
        }
        Ok(told)
    }

    /// Notes what took effect in a run.
    fn note_effect(&mut self, run: usize, event: &Event) {
        let command = match event {
            Event::ScheduleChanged { schedule, .. } => match schedule.parse() {
                Ok(schedule) => Command::Epsilon(schedule),
                Err(_) => return,
            },
            Event::ClustersChanged { episode: 1.., .. } => Command::Guide,
            Event::Stopped { .. } => Command::Stop,
            _ => return,
        };
        self.journal.note_at(command, run, u32::try_from(event.episode()).unwrap_or(u32::MAX));
    }

    fn carry_out(&mut self, command: &Command) -> Result<String, SessionError> {
        match command {
            Command::Task(name) => self.load_task(name),
            Command::Save(path) => self.save_task(path.as_deref()),
            Command::Undo => self.step_history(Editor::undo, "undo", "the edit is taken back"),
            Command::Redo => self.step_history(Editor::redo, "redo", "the edit is made again"),
            Command::Edit(edit) => self.edit(edit),
            Command::Propose(count) => self.propose(*count),
            Command::Seed(seed) => {
                self.settings.seed = *seed;
                Ok(format!("seed {seed}"))
            }
            Command::Method(method) => {
                self.settings.method = *method;
                Ok(format!("method {method}"))
            }
            Command::Episodes(episodes) => self.set("episodes", &episodes.to_string()),
            Command::Epsilon(schedule) => self.set_schedule(schedule),
            Command::Set { key, value } => self.set(key, value),
            Command::Model(source) => {
                self.settings.prior = source.clone();
                Ok(format!("model {}", String::from(source.clone())))
            }
            Command::ModelTrain { tools, path, epochs } => {
                self.begin_model_job(ModelJob::train(tools, path, *epochs, self.settings.seed))
            }
            Command::ModelEvaluate(model) => self.begin_model_job(ModelJob::evaluate(model, self.settings.seed)),
            Command::ModelStop => match self.model_job.take() {
                Some(job) => Ok(format!("ended: {}", job.name())),
                None => Err(SessionError::Failed("no dynamics model is being trained or measured".to_owned())),
            },
            Command::Clusters(file) => self.compute_clusters(file.as_deref()),
            Command::Guide => self.guide(),
            Command::Out(folder) => {
                self.folder.clone_from(folder);
                Ok(format!("runs go to {}", folder.display()))
            }
            Command::Train { folder, until } => self.train(folder.as_deref(), *until),
            Command::Pause => self.send(Control::Pause, "pausing after this episode"),
            Command::Resume { until } => self.resume(*until),
            Command::Stop => self.stop(),
            Command::Wait => self.wait(|_| {}),
            Command::Open(folder) => self.open(folder),
            Command::Watch(number) => self.watch(*number),
            Command::Delete(folder) => self.delete(folder),
            Command::Continue(folder) => self.continue_run(folder.as_deref()),
            Command::Evaluate => self.evaluate(),
            Command::Place(action) => self.place(*action),
            Command::Reset => {
                self.hand = HandPlay::new(self.settings.task.clone(), self.settings.seed);
                Ok("a new episode".to_owned())
            }
            Command::Figure { kind, path, dpi } => self.export(*kind, path, *dpi),
            Command::Expect(expectation) => self.expect(expectation),
            Command::Record(path) => {
                crate::atomic::write(path, self.to_script().as_bytes())
                    .map_err(|source| SessionError::Write { path: path.clone(), source })?;
                Ok(format!("saved the session to {}", path.display()))
            }
            Command::Quit => {
                self.quit = true;
                Ok(String::new())
            }
        }
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

    fn begin_model_job(&mut self, job: std::io::Result<ModelJob>) -> Result<String, SessionError> {
        if let Some(job) = &self.model_job {
            return Err(SessionError::Failed(format!("{}: wait for its end, or end it with `model stop`", job.name())));
        }
        let job = job.map_err(SessionError::Thread)?;
        let told = job.name().to_owned();
        self.model_job = Some(job);
        Ok(told)
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

    /// Waits until no run is being trained and no clusters are being computed; `tell`
    /// sees what happens meanwhile.
    ///
    /// # Errors
    /// When the clusters or a run failed.
    pub fn wait(&mut self, mut tell: impl FnMut(&Notice)) -> Result<String, SessionError> {
        loop {
            let idle = self.is_idle();
            for notice in self.poll() {
                tell(&notice);
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

    fn set(&mut self, key: &str, value: &str) -> Result<String, SessionError> {
        self.settings = self.settings.with_setting(key, value)?;
        Ok(format!("{key} = {value}"))
    }

    fn set_schedule(&mut self, schedule: &EpsilonSchedule) -> Result<String, SessionError> {
        self.settings.epsilon = schedule.clone();
        let told = format!("epsilon {schedule}");
        let Some(run) = self.run_mut() else { return Ok(told) };
        if run.send(Control::SetSchedule(schedule.clone())).is_err() {
            return Ok(told);
        }
        Ok(match run.prior() {
            Some(_) => format!("{told}, from the next episode on"),
            None => format!("{told}; the run has no action clusters to draw from: compute them, then `guide`"),
        })
    }

    fn compute_clusters(&mut self, file: Option<&Path>) -> Result<String, SessionError> {
        self.settings.validate()?;
        self.job = Some(PriorJob::spawn(&self.settings).map_err(SessionError::Thread)?);
        let Some(path) = file else { return Ok("computing the action clusters".to_owned()) };
        self.wait(|_| {})?;
        let prior = self.prior().ok_or(SessionError::NoClusters)?;
        crate::atomic::write(path, prior.to_json().as_bytes())
            .map_err(|source| SessionError::Write { path: path.to_owned(), source })?;
        Ok(format!("saved the action clusters to {}", path.display()))
    }

    /// Gives the present clusters to the running training.
    fn guide(&mut self) -> Result<String, SessionError> {
        let prior = self.prior().ok_or(SessionError::NoClusters)?.clone();
        let run = self.run_mut().ok_or(SessionError::NoRun)?;
        let (there, here) = (run.config().task.subgoals.len(), prior.stages.len() - 1);
        if there != here {
            let message = format!("the clusters are for {here} subgoals, but the run's task has {there}");
            return Err(SessionError::Failed(message));
        }
        run.send(Control::SetPrior(prior))?;
        Ok("the training takes the clusters at its next episode".to_owned())
    }

    fn place(&mut self, action: [f32; 2]) -> Result<String, SessionError> {
        let step = self.hand.place(action)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        Ok(format!("{:?}, reward {:.2}{end}", step.placement, step.reward).to_lowercase())
    }

    fn expect(&mut self, expected: &Expectation) -> Result<String, SessionError> {
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
        let Expectation { comparison, value, .. } = *expected;
        if comparison.holds(found, value) {
            Ok(format!("{} is {found}", expected.quantity.name()))
        } else {
            Err(SessionError::Expectation { expected: *expected, found })
        }
    }

    /// The settings of the next run.
    pub fn config(&self) -> &RunConfig {
        &self.settings
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
            (None, Some((key, _))) if *key == PriorKey::of(&self.settings) => PriorState::Fresh,
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
        let key = PriorKey::of(&self.settings);
        let latest = self.job.as_ref().map(|job| &job.key).or(self.prior.as_ref().map(|(key, _)| key));
        latest.is_some_and(|latest| *latest != key) && self.hopeless.as_ref() != Some(&key)
    }

    /// The folder for new runs.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The episode played by hand.
    pub fn hand(&self) -> &HandPlay {
        &self.hand
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
