//! The session, which owns the whole state of the workbench.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use serde_json::Value;

use super::SessionError;
use super::clusters::ClusterStore;
use super::command::{self, Command, DependsOn, Expect, HandPlay, Pause, Quantity, ScriptRole, Stop};
use super::job::{CommandJob, Progress};
use super::journal::{Journal, run_name, run_number};
use super::run::RunView;
use super::runs::Runs;
use super::setup::Setup;
use mge_base::{json, stop};
use mge_results::RunReader;
use mge_run::{Event, RunDirectory, RunState};
use mge_task::{self as task, Task};
use mge_trainer::{Control, RunConfig, SettingError, SettingsFileError, set_the_same, settings_of, warnings};

/// Something that happened in the background.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// The job of a command made progress.
    Progress { command: Command, progress: Progress },
    /// The job of a command ended, with its report or the reason of its failure.
    Finished { command: Command, outcome: Result<String, String> },
    /// A new event of the run with this number.
    Run { run: usize, event: Event },
    /// The settings of a run that was started or steered are doubtful.
    Warning(String),
    /// Other visible state changed.
    Changed,
}

/// The initial task of a script.
pub const FIRST_TASK: &str = "task1";

/// The state of the workbench. It is changed by commands and by [`Session::poll`], which applies
/// the results of background threads.
#[derive(Debug)]
pub struct Session {
    pub(super) setup: Setup,
    pub(super) clusters: ClusterStore,
    /// Background jobs, in the order in which they were requested.
    pub(super) jobs: Vec<CommandJob>,
    /// Notices since the last poll.
    pub(super) notices: Vec<Notice>,
    /// Jobs block while a test holds this lock.
    #[cfg(test)]
    pub(crate) gate: Arc<std::sync::Mutex<()>>,
    pub(super) runs: Runs,
    /// Cache of the runs read for figures.
    pub(super) reader: Arc<Mutex<RunReader>>,
    /// The episode played by hand.
    pub hand_play: HandPlay,
    pub(super) journal: Journal,
    /// Whether `quit` was executed.
    pub quit: bool,
    /// Aborts all waiting once set.
    pub interrupt: stop::Stop,
}

impl Session {
    /// A session on a task, with its runs in `folder`.
    pub fn new(task: Task, folder: PathBuf) -> Self {
        let setup = Setup::new(task, folder);
        Self {
            hand_play: HandPlay::new(setup.config.task.clone(), setup.config.seed),
            setup,
            clusters: ClusterStore::default(),
            jobs: Vec::new(),
            notices: Vec::new(),
            #[cfg(test)]
            gate: Arc::default(),
            runs: Runs::default(),
            reader: Arc::default(),
            journal: Journal::default(),
            quit: false,
            interrupt: stop::Stop::default(),
        }
    }

    /// A session on a shipped task or a task file.
    ///
    /// # Errors
    /// When there is no such task, or it is invalid.
    pub fn on_task(name: &str, folder: PathBuf) -> Result<Self, SessionError> {
        let mut session = Self::new(task::load(name)?, folder);
        // The task is saved to its file, and the recorded script opens it.
        session.setup.file = task::file_of(name);
        session.journal.note(command::Task(name.to_owned()).into(), None);
        Ok(session)
    }

    /// A session that has opened a run, on the run's task.
    ///
    /// # Errors
    /// When there is no run, or it cannot be read.
    pub fn on_run(folder: &Path) -> Result<Self, SessionError> {
        let run = RunView::read(folder)?;
        let mut session = Self::new(Task::clone(&run.config().task), folder.parent().unwrap_or(folder).to_owned());
        session.runs.current = Some(session.runs.add(run, false));
        session.journal.note(command::Open(folder.to_owned()).into(), session.runs.current);
        Ok(session)
    }

    /// Executes a command and returns its report. Never blocks: longer work runs as a job, whose end
    /// [`Session::poll`] reports.
    ///
    /// # Errors
    /// When the command cannot be executed; nothing has changed then.
    pub fn apply(&mut self, command: impl Into<Command>) -> Result<String, SessionError> {
        let command = self.with_folders(command.into())?;
        let ScriptRole { unrecorded, depends_on, .. } = command.as_execute().script_role();
        let at = self.episodes_of(depends_on);
        // A run of the session is recorded by number, as its folder may differ when the script is played.
        let named = |folder: &Path| Ok::<_, SessionError>(self.runs.number_ever_of(folder).map(run_name));
        let recorded = command.clone().with_run_folders(named)?;
        command.check_output(self.file())?;
        command.check_room(&self.setup)?;
        let report = command.as_execute().execute(self)?;
        if unrecorded {
            return Ok(report);
        }
        let entry = self.journal.note_at(recorded, self.runs.current, at);
        // An earlier job of the same command, such as that of a run opened twice, decides about both entries.
        if let Some(pending) = self.jobs.iter_mut().rev().find(|pending| pending.command == command) {
            pending.entries.push(entry);
        }
        Ok(report)
    }

    /// Sets settings of the next run by their JSON paths: those of a file, except where `own` sets the same, and `own`.
    /// They may be valid only together.
    ///
    /// # Errors
    /// When the file cannot be used, or a setting is refused; nothing has changed then.
    pub fn set_all(&mut self, file: Option<&Path>, own: Vec<(String, Value)>) -> Result<(), SessionError> {
        let mut of_file = file.map(settings_of).transpose()?.unwrap_or_default();
        of_file.retain(|(key, _)| !own.iter().any(|(own, _)| set_the_same(own, key)));
        let is_of_file = |path: &str| of_file.iter().any(|(key, _)| key == path);
        let mut all = [of_file.clone(), own].concat();
        // The method comes first: it determines the defaults of other settings.
        all.sort_by_key(|(key, _)| key != "method");
        let changed = self.setup.config.with_settings(&all);
        self.setup.config = changed.map_err(|source| match (&source, file) {
            (SettingError::Range(problem), Some(file)) if is_of_file(&problem.path) => {
                SettingsFileError::Setting { origin: file.display().to_string(), source }.into()
            }
            _ => SessionError::from(source),
        })?;
        for (key, value) in all {
            self.setup.set.insert(key.clone());
            self.journal.note(command::Set { key, value: json::text(&value) }.into(), None);
        }
        Ok(())
    }

    /// The command with the folders of the runs that it names as `%N`, or by their names in the folder for runs.
    ///
    /// # Errors
    /// When the session has no run of the number.
    pub(super) fn with_folders(&self, command: Command) -> Result<Command, SessionError> {
        let is_restored = command.is_restore();
        command.with_run_folders(|name| match (run_number(name), self.setup.folder.join(name)) {
            (Some(number), _) => Ok(Some(self.runs.folder_of(number).ok_or_else(|| no_such_run(number))?.to_owned())),
            _ if name.exists() => Ok(Some(self.setup.listed(name))),
            (None, place) if place.exists() => Ok(Some(place)),
            // A deleted run may have the name that another was given.
            _ => match RunDirectory::named_so(name, &self.setup.folder).filter(|_| !is_restored) {
                Some(other) => Err(format!("{} does not exist{other}", name.display()).into()),
                None => Ok(None),
            },
        })
    }

    /// The trainings that a command depends on, with the numbers of their finished episodes; the current one first.
    fn episodes_of(&self, depends_on: DependsOn) -> Vec<(usize, u32)> {
        let runs: Vec<&RunView> = match depends_on {
            DependsOn::Nothing => Vec::new(),
            DependsOn::Run | DependsOn::Checkpoint => self.run().into_iter().filter(|run| run.is_active()).collect(),
            DependsOn::Runs => self.runs.all.iter().filter(|run| run.is_active() || run.is_queued()).collect(),
        };
        let is_saved = depends_on == DependsOn::Checkpoint;
        let episodes = |run: &RunView| if is_saved { run.saved_episode } else { run.episodes() };
        runs.into_iter().map(|run| (run.number, episode_number(episodes(run)))).collect()
    }

    /// Changes the task or the settings of the next run; a new task restarts hand play.
    pub(super) fn change<T>(
        &mut self,
        change: impl FnOnce(&mut Setup) -> Result<T, SessionError>,
    ) -> Result<T, SessionError> {
        let before = self.setup.config.task.clone();
        let report = change(&mut self.setup)?;
        if !Arc::ptr_eq(&before, &self.setup.config.task) {
            self.restart_hand_play();
        }
        Ok(report)
    }

    /// Checks commands, each after those before it, without carrying them out.
    ///
    /// # Errors
    /// Why the first of them would be refused.
    pub fn check(&self, commands: &[Command]) -> Result<(), SessionError> {
        let mut setup = self.setup.clone();
        commands.iter().try_for_each(|command| setup.try_command(command))
    }

    pub(super) fn restart_hand_play(&mut self) {
        self.hand_play = HandPlay::new(self.setup.config.task.clone(), self.setup.config.seed);
    }

    /// Records a command that took effect in a run, given its event.
    fn note_effect(&mut self, run: usize, event: &Event) {
        let episode = episode_number(event.episode());
        match event {
            Event::ScheduleChanged { schedule, .. } => {
                if let Ok(schedule) = schedule.parse() {
                    self.journal.note_schedule(schedule, &self.setup.config.epsilon, run, episode);
                }
            }
            Event::ClustersChanged { given: true, .. } => self.journal.note_guided(run, episode),
            Event::Stopped { .. } => _ = self.journal.note_at(Stop.into(), None, vec![(run, episode)]),
            _ => {}
        }
    }

    /// Applies the results of background work and returns the notices since the last call.
    pub fn poll(&mut self) -> Vec<Notice> {
        self.advance(true);
        std::mem::take(&mut self.notices)
    }

    /// Like [`Session::poll`], but never waits for the disk: the logs of runs are read in the background.
    pub fn poll_in_background(&mut self) -> Vec<Notice> {
        self.advance(false);
        std::mem::take(&mut self.notices)
    }

    /// Applies the results of background work, and the events of the runs, for which it `waits`; the next poll returns
    /// the notices.
    pub(super) fn advance(&mut self, waits: bool) {
        self.advance_jobs();
        let mut effects = Vec::new();
        for run in &mut self.runs.all {
            let (events, changed) = run.poll(waits);
            if changed && events.is_empty() {
                self.notices.push(Notice::Changed);
            }
            for event in events {
                if run.trained_here {
                    effects.push((run.number, event.clone()));
                }
                self.notices.push(Notice::Run { run: run.number, event });
            }
        }
        for (run, event) in effects {
            self.note_effect(run, &event);
        }
        if self.runs.start_queued() {
            self.notices.push(Notice::Changed);
        }
    }

    /// Reports what is doubtful about a configuration in which these settings were set.
    pub(super) fn warn(&mut self, config: &RunConfig, set: &BTreeSet<String>) {
        for warning in warnings([(config, set)]).into_iter().map(Notice::Warning) {
            // Runs with several seeds are started at once.
            if !self.notices.contains(&warning) {
                self.notices.push(warning);
            }
        }
    }

    /// Whether there are no jobs, and no runs but ended and paused ones.
    pub fn is_idle(&self) -> bool {
        let busy = |run: &RunView| run.is_working() || run.is_queued();
        self.jobs.is_empty() && !self.runs.all.iter().any(busy)
    }

    pub(super) fn expect(&mut self, expected: &Expect) -> Result<String, SessionError> {
        self.advance(true);
        let run = || self.run().ok_or(SessionError::NoRun);
        let Expect { quantity, comparison, value } = *expected;
        let found = match quantity {
            Quantity::Episodes => run()?.episodes() as f64,
            Quantity::Success => run()?.history().records.last().map_or(0.0, |record| record.rolling_success),
            Quantity::Greedy => run()?.history().evaluations.last().map_or(0.0, |evaluation| evaluation.success),
            Quantity::Clusters => {
                let prior = self.prior().ok_or(SessionError::NoClusters)?;
                prior.stages.iter().map(|stage| stage.clusters.len()).sum::<usize>() as f64
            }
            Quantity::Subgoals => self.task().subgoals.len() as f64,
            Quantity::Proposals => self.proposed().len() as f64,
        };
        if !comparison.holds(found, value) {
            return Err(format!("expected {quantity} {comparison} {value}, but it is {found}").into());
        }
        Ok(format!("{quantity} is {found}"))
    }

    /// The task with its edits.
    pub fn task(&self) -> &Task {
        self.setup.editor.task()
    }

    /// Whether the task has unsaved edits.
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

    /// All runs of the session.
    pub fn runs(&self) -> &[RunView] {
        &self.runs.all
    }

    /// The current run, on which commands act.
    pub fn run(&self) -> Option<&RunView> {
        self.run_numbered(self.runs.current?)
    }

    /// The run with a number.
    pub fn run_numbered(&self, number: usize) -> Option<&RunView> {
        self.runs.all.iter().find(|run| run.number == number)
    }

    pub(super) fn run_numbered_mut(&mut self, number: usize) -> Option<&mut RunView> {
        self.runs.all.iter_mut().find(|run| run.number == number)
    }

    pub(super) fn run_mut(&mut self) -> Option<&mut RunView> {
        self.run_numbered_mut(self.runs.current?)
    }

    /// The folder for new runs.
    pub fn folder(&self) -> &Path {
        &self.setup.folder
    }

    /// The session so far, as a script that repeats it without a terminal.
    pub fn to_script(&self) -> String {
        let mut journal = self.journal.clone();
        for run in self.runs.all.iter().filter(|run| run.is_active() && run.state() == RunState::Paused) {
            journal.note_at(Pause.into(), None, vec![(run.number, episode_number(run.episodes()))]);
        }
        journal.to_script()
    }
}

/// That no run has a number, counted from 0.
pub(super) fn no_such_run(number: usize) -> SessionError {
    format!("the session has no run {}", number + 1).into()
}

/// An episode number as the journal stores it; saturates beyond 32 bits, which no run reaches.
pub(super) fn episode_number(episodes: u64) -> u32 {
    u32::try_from(episodes).unwrap_or(u32::MAX)
}

impl Drop for Session {
    /// Asks all trainings of this process to stop before the first run is dropped, which waits for its training.
    fn drop(&mut self) {
        for run in self.runs.all.iter_mut().filter(|run| run.is_active()) {
            // Fails only if the training has just ended.
            let _ = run.send(Control::Stop { reason: "the program ended".to_owned() });
        }
    }
}
