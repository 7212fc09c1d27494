//! The session's runs: starting, queueing, controlling, stopping and deleting them.
//!
//! As many runs are trained at the same time as there are cores; the others are queued in the
//! order of their requests. A paused run frees its core.

mod list;
#[cfg(test)]
mod tests;

pub(super) use list::Runs;
pub use list::{OF_RUN, free_name};

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::SessionError;
use super::command::{Command, Continue, Delete, Evaluate, Open, Restore, Seed, Stop, Train, Watch};
use super::job::Reporter;
use super::run::RunView;
use super::session::{Session, episode_number, no_such_run};
use super::setup::{Setup, nothing_to};
use mge_base::paths::entries;
use mge_base::text::counted;
use mge_run::{CheckpointName, RunDirectory, RunState, deletions, empty_trash, restore, trashed};
use mge_trainer::{Control, RunConfig, check_continuation, non_default_settings};

/// The name of the folder for a run with these settings, unless it is taken.
pub fn usual_name(config: &RunConfig) -> String {
    format!("{}-{}-seed{}", config.task.name, config.method, config.seed)
}

/// The folder of the run with a seed, when several are trained in `folder`: one beside it, so that lists of the folder
/// for runs have it.
pub(super) fn folder_of_seed(folder: &Path, seed: u64) -> PathBuf {
    let mut name = folder.components().as_path().as_os_str().to_owned();
    name.push(format!("-seed{seed}"));
    name.into()
}

impl Session {
    pub(super) fn train(&mut self, folder: Option<&Path>, until: Option<u32>) -> Result<String, SessionError> {
        self.setup.check()?;
        let free = || self.setup.free_folder(&usual_name(&self.setup.config));
        let path = folder.map_or_else(free, |folder| self.setup.place(folder));
        let directory = self.setup.config.create_run(&path)?;
        let Setup { config, set, .. } = self.setup.clone();
        self.warn(&config, &set);
        let number = self.runs.add(RunView::new(directory)?, false);
        Ok(self.start_run(number, until, "training in")? + &self.with_settings())
    }

    /// Starts or queues a run for each of `seeds` consecutive seeds, beginning with the one set. Each run is
    /// recorded as if it had been started on its own.
    pub(super) fn train_seeds(
        &mut self,
        seeds: u32,
        folder: Option<&Path>,
        until: Option<u32>,
    ) -> Result<String, SessionError> {
        let first = self.config().seed;
        let last = first.saturating_add(u64::from(seeds).saturating_sub(1));
        let before = self.runs().len();
        let mut report = String::new();
        let outcome = (first..=last).try_for_each(|seed| {
            self.apply(Seed(seed))?;
            let folder = folder.map(|folder| folder_of_seed(folder, seed));
            report = self.apply(Train { folder, seeds: None, until })?;
            Ok::<_, SessionError>(())
        });
        self.apply(Seed(first))?;
        outcome?;
        // The first is trained first: those that wait for a core show nothing yet.
        if let Some(run) = self.runs().get(before).filter(|_| first < last).map(|run| run.number) {
            self.apply(Watch(run))?;
        }
        let seeds = || format!("training with seeds {first} to {last}{}", self.with_settings());
        Ok(if first == last { report } else { seeds() })
    }

    /// The settings of the next run that are not the defaults of its method, which may be left over from earlier runs.
    pub(super) fn with_settings(&self) -> String {
        let mut set = non_default_settings(&self.setup.config);
        set.retain(|(key, _)| !["method", "seed"].contains(&&**key));
        let word = |key: String| if key == "prior" { "model".to_owned() } else { key };
        let set: Vec<String> = set.into_iter().map(|(key, value)| format!("{} {value}", word(key))).collect();
        if set.is_empty() { String::new() } else { format!(", with {}", set.join(", ")) }
    }

    /// Continues a run: the current one, or the one in a folder.
    pub(super) fn continue_run(&mut self, command: &Continue) -> Result<String, SessionError> {
        let folder = match &command.folder {
            Some(folder) => folder.clone(),
            None => self.run().ok_or(SessionError::NoRun)?.directory().path().to_owned(),
        };
        self.runs.refuse_if_busy(&folder)?;
        let directory = RunDirectory::open(&folder)?;
        let done = directory.status()?.last_episode.map_or(0, |record| record.episode);
        let saved = directory.checkpoints().episodes()?.into_iter().map(|(episode, _)| episode).max().unwrap_or(0);
        let again = format!("the last checkpoint is of episode {saved} of {done}: ");
        let again = if saved < done { again } else { String::new() };
        let report = match self.extend(&directory)? {
            Some(extended) => format!("{again}{extended}, continuing"),
            None => again + "continuing",
        };
        let number = self.known_or_read(&folder, command.clone().into())?;
        self.start_run(number, command.until, &report)
    }

    /// The number of episodes to which continuing extends a run that has fewer; None unless `episodes` set it.
    pub fn extends_to(&self) -> Option<u32> {
        self.setup.extends_to
    }

    /// Lets a run play the number of episodes set in the session, if that was set explicitly and the run ends before;
    /// says so then. Otherwise refuses a run of which no episode is left.
    fn extend(&mut self, directory: &RunDirectory) -> Result<Option<String>, SessionError> {
        directory.check_free()?;
        let config = RunConfig::of(directory)?;
        let status = directory.status()?;
        let is_finished = status.state == RunState::Finished;
        let run = directory.name();
        if is_finished && directory.checkpoints().names()?.is_empty() {
            return Err(format!("{run} is finished and has no checkpoint to continue from").into());
        }
        let Some(episodes) = self.extends_to().filter(|episodes| config.extends_to(*episodes)) else {
            // A run that was extended before, but not started, has episodes left.
            let done = status.last_episode.map_or(0, |record| record.episode);
            if !is_finished || config.has_more(done) {
                return Ok(None);
            }
            let by = format!(" of {}, by its `stop.success`, which ends if it goes on", config.episodes);
            let by = if done < config.episodes.into() { by } else { String::new() };
            return Err(SessionError::Finished { run, episodes: done, by });
        };
        let rule = if config.stop.success.is_some() { " whatever its success (`stop.success` ends)" } else { "" };
        let config = config.extended(episodes);
        check_continuation(directory, &config).map_err(|error| format!("{}: {error}", directory.path().display()))?;
        directory.replace_config(&config)?;
        if let Some(run) = self.runs.all.iter_mut().find(|run| run.directory() == directory) {
            run.saved.config = Arc::new(config);
            // What is being read may have the earlier one.
            run.log.reading = None;
        }
        Ok(Some(format!("extended to {episodes} episodes{rule}")))
    }

    /// The number of the run in a folder. A run new to the session is added, and its log is read in
    /// the background.
    fn known_or_read(&mut self, folder: &Path, command: Command) -> Result<usize, SessionError> {
        if let Some(number) = self.runs.number_of(folder) {
            return Ok(number);
        }
        let mut run = RunView::open(folder)?;
        let read = RunView::open(folder)?;
        run.unread = true;
        let number = self.runs.add(run, matches!(command, Command::Restore(_)));
        let report = format!("opened {}", folder.display());
        let work = move |reporter: &Reporter| Ok(read.with_whole_log(&reporter.stop)?);
        self.start_job(command, work, move |session, read| {
            // The run may have been deleted meanwhile.
            let Some(run) = session.run_numbered_mut(number) else { return Ok(report) };
            Ok(run.take_over(read).map(|()| report)?)
        });
        Ok(number)
    }

    /// Queues a run, and starts it if a core is free.
    pub(super) fn start_run(
        &mut self,
        number: usize,
        until: Option<u32>,
        report: &str,
    ) -> Result<String, SessionError> {
        self.runs.current = Some(number);
        self.runs.turns += 1;
        let turn = self.runs.turns;
        let Some(run) = self.run_mut() else { return Err(SessionError::NoRun) };
        run.enqueue(turn, until);
        self.runs.start_queued();
        let Some(run) = self.run() else { return Err(SessionError::NoRun) };
        let path = run.directory().path().display();
        match run.failure() {
            Some(reason) => Err(reason.to_owned().into()),
            None if run.is_queued() && !run.unread => Ok(format!("{path} waits for a free core")),
            None => Ok(format!("{report} {path}")),
        }
    }

    pub(super) fn stop(&mut self) -> Result<String, SessionError> {
        if let Some(run) = self.run_mut()
            && run.unqueue()
        {
            // No event follows. The replay does not queue runs: it stops this one before its next episode.
            let (number, episode, name) = (run.number, episode_number(run.episodes()), run.name.clone());
            self.journal.note_at(Stop.into(), None, vec![(number, episode)]);
            return Ok(format!("{name} is taken out of the queue"));
        }
        self.send(Control::Stop { reason: "on request".to_owned() }, "stopping {run} after this episode")
    }

    /// Sends a control to the current run; `{run}` in the report stands for its name.
    pub(super) fn send(&mut self, control: Control, report: &str) -> Result<String, SessionError> {
        let run = self.run_mut().ok_or(SessionError::NoRun)?;
        run.send(control)?;
        Ok(report.replace("{run}", &run.name))
    }

    /// Opens the run in a folder and makes it the current one.
    pub(super) fn open(&mut self, command: &Open) -> Result<String, SessionError> {
        let number = self.known_or_read(&command.0, command.clone().into())?;
        self.runs.current = Some(number);
        Ok(format!("opened {}", command.0.display()))
    }

    pub(super) fn watch(&mut self, number: usize) -> Result<String, SessionError> {
        let run = self.run_numbered(number).ok_or_else(|| no_such_run(number))?;
        let report = format!("run {} is {}", number + 1, run.name);
        self.runs.current = Some(number);
        Ok(report)
    }

    /// Moves runs to the trash beside them, unless this or another process is training one of them.
    pub(super) fn delete(&mut self, command: &Delete) -> Result<String, SessionError> {
        // By the names that the session knows them by.
        let known = |folder: &Path| self.runs.folder_of(self.runs.number_of(folder)?);
        let folders: Vec<PathBuf> = command.0.iter().map(|folder| known(folder).unwrap_or(folder).to_owned()).collect();
        folders.iter().try_for_each(|folder| self.runs.refuse_if_busy(folder))?;
        self.runs.deleted.push(Vec::new());
        let mut last = None;
        let reports: Result<Vec<String>, _> =
            folders.into_iter().map(|folder| self.delete_one(folder, &mut last)).collect();
        self.runs.deleted.retain(|together| !together.is_empty());
        match reports?.as_slice() {
            [report] => Ok(report.clone()),
            reports => Ok(format!("moved {} runs to the trash: `restore` brings them back", reports.len())),
        }
    }

    /// Moves a run to the trash, together with the `last` one that was moved there, which it becomes.
    fn delete_one(&mut self, folder: PathBuf, last: &mut Option<PathBuf>) -> Result<String, SessionError> {
        let (number, name) = (self.runs.number_of(&folder), folder.display().to_string());
        if number.is_some() && !folder.exists() {
            self.runs.remove(number);
            return Ok(format!("{name} is no longer listed: its folder is gone"));
        }
        let is_valid = |run: &RunDirectory| match run.is_of_model()? {
            true => Ok(()),
            false => run.config::<RunConfig>().map(drop),
        };
        *last = Some(RunDirectory::deletable(&folder, is_valid)?.discard(last.as_deref())?);
        self.runs.forget_deleted(number, folder);
        Ok(format!("moved {name} to the trash: `restore` brings it back"))
    }

    /// Gives the run in a folder another name, or that of its folder if it is empty. Says if a run beside it has that
    /// name, too.
    pub(super) fn rename(&mut self, folder: &Path, name: &str) -> Result<String, SessionError> {
        let directory = RunDirectory::open(folder)?;
        let before = directory.name();
        directory.change_notes(|notes| name.clone_into(&mut notes.name))?;
        if let Some(run) = self.runs.number_of(folder).and_then(|number| self.run_numbered_mut(number)) {
            run.name = directory.name();
            // What is being read may have the earlier one.
            run.log.reading = None;
        }
        let now = directory.name();
        let mut beside = folder.parent().and_then(|parent| entries(parent).ok()).into_iter().flatten();
        let has_it = |path: &PathBuf| path != folder && path.is_dir() && RunDirectory::at(path).name() == now;
        let too = beside.find(has_it).map(|other| format!(", a name that {} has, too", other.display()));
        Ok(format!("{before} is {now} now{}", too.unwrap_or_default()))
    }

    pub(super) fn choose_checkpoint(&mut self, choice: CheckpointName) -> Result<String, SessionError> {
        let run = self.run_mut().ok_or(SessionError::NoRun)?;
        let name = run.directory().checkpoints().chosen(choice)?;
        run.saved.checkpoint = choice;
        Ok(format!("the agent of checkpoint {name} plays"))
    }

    /// Brings back the run deleted from a folder, or else those that this session deleted last, or else those deleted
    /// last from the session's folder, as far as they are still in the trash.
    pub(super) fn restore(&mut self, folder: Option<&Path>) -> Result<String, SessionError> {
        self.runs.forget_trashed(|deleted| trashed(deleted).is_err());
        let folders = match (folder, self.runs.deleted.last()) {
            (Some(folder), _) => vec![folder.to_owned()],
            (None, Some(together)) => together.clone(),
            (None, None) => deletions(&self.setup.folder)?.into_iter().next().ok_or_else(|| nothing_to("restore"))?,
        };
        for folder in &folders {
            restore(folder)?;
            self.runs.forget_trashed(|deleted| deleted == folder);
            if self.runs.number_ever_of(folder).is_some() {
                self.known_or_read(folder, Restore(Some(folder.clone())).into())?;
            }
        }
        match folders.as_slice() {
            [folder] => Ok(format!("restored {}", folder.display())),
            folders => Ok(format!("restored {} runs", folders.len())),
        }
    }

    /// Removes the runs in the trash of a folder of runs, or else of the session's, for good.
    pub(super) fn empty_trash(&mut self, folder: Option<&Path>) -> Result<String, SessionError> {
        let folder = folder.unwrap_or(&self.setup.folder).to_owned();
        let count = empty_trash(&folder)?;
        self.runs.forget_trashed(|deleted| deleted.parent() == Some(&folder));
        Ok(format!("removed {} for good", counted(count, "deleted run")))
    }

    /// Starts playing an episode of the greedy policy of the current run.
    pub(super) fn evaluate(&mut self) -> Result<String, SessionError> {
        let run = self.run().ok_or(SessionError::NoRun)?;
        let (saved, seed, name, number) = (run.saved.clone(), self.setup.config.seed, run.name.clone(), run.number);
        let work = move |_: &Reporter| Ok(saved.player(None)?.episode(seed));
        let report = format!("playing the greedy policy of {name}");
        self.start_job(Evaluate, work, move |session, trace| {
            let trace = trace?;
            let outcome = if trace.reached_goal() { "reaches the goal" } else { "does not reach the goal" };
            let (actions, total) = (trace.steps.len(), trace.total_reward());
            if let Some(run) = session.run_numbered_mut(number) {
                run.greedy = Some(Arc::new(trace));
            }
            Ok(format!("the greedy policy of {name} {outcome} in {actions} actions, return {total:.2}"))
        });
        Ok(report)
    }
}
