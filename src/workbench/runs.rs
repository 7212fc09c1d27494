//! The session's runs: beginning, queueing, steering, ending and deleting them.
//!
//! As many are trained at the same time as there are cores; the others wait for their
//! turn in the order they were asked for. A paused run leaves its core to the next.

use std::path::{Path, PathBuf};

use super::SessionError;
use super::run::RunView;
use super::session::Session;
use crate::run::RunDirectory;
use crate::trainer::{Control, RunConfig};

impl Session {
    pub(super) fn train(&mut self, folder: Option<&Path>, until: Option<u32>) -> Result<String, SessionError> {
        self.setup.config.validate()?;
        let path = folder.map_or_else(|| self.free_folder(), Path::to_owned);
        let directory = RunDirectory::create(&path, &self.setup.config)?;
        self.begin(RunView::new(directory)?, until, "training in")
    }

    pub(super) fn continue_run(&mut self, folder: Option<&Path>) -> Result<String, SessionError> {
        let path = match folder {
            Some(folder) => folder.to_owned(),
            None => self.run().ok_or(SessionError::NoRun)?.directory().path().to_owned(),
        };
        self.refuse_if_busy(&path)?;
        self.begin(RunView::open(&path)?, None, "going on with")
    }

    /// Adds a run, in the place of the one in its folder if that is known, and starts it
    /// as soon as there is a core for it.
    fn begin(&mut self, view: RunView, until: Option<u32>, report: &str) -> Result<String, SessionError> {
        let path = view.directory().path().to_owned();
        let number = self.add(view);
        self.current = Some(number);
        let Some(run) = self.run_mut() else { return Err(SessionError::NoRun) };
        run.enqueue(until);
        self.start_queued();
        let Some(run) = self.run() else { return Err(SessionError::NoRun) };
        match run.failure() {
            Some(reason) => Err(SessionError::Failed(reason.to_owned())),
            None if run.is_queued() => Ok(format!("{} waits for a free core", path.display())),
            None => Ok(format!("{report} {}", path.display())),
        }
    }

    /// Adds a run to the session, or puts it in the place of the one in its folder, and
    /// returns its number.
    fn add(&mut self, view: RunView) -> usize {
        let path = view.directory().path();
        if let Some(known) = self.runs.iter_mut().find(|run| run.directory().path() == path) {
            let number = known.number();
            *known = view.numbered(number);
            return number;
        }
        let number = self.numbered;
        self.numbered += 1;
        self.runs.push(view.numbered(number));
        number
    }

    /// Starts what waits for a core, as long as there is one; true if anything began.
    pub(super) fn start_queued(&mut self) -> bool {
        let mut began = false;
        loop {
            let working = self.runs.iter().filter(|run| run.is_working()).count();
            let next = self.runs.iter_mut().filter(|run| run.is_queued()).min_by_key(|run| run.number());
            let Some(run) = next.filter(|_| working < self.cores) else { return began };
            // Why it could not begin is kept in the run, where it is shown.
            began |= run.start().is_ok();
        }
    }

    /// Another number of runs that may be trained at the same time; at least one.
    pub fn set_cores(&mut self, cores: usize) {
        self.cores = cores.max(1);
    }

    fn refuse_if_busy(&self, path: &Path) -> Result<(), SessionError> {
        match self.runs.iter().find(|run| run.directory().path() == path && (run.is_active() || run.is_queued())) {
            Some(run) => Err(SessionError::Busy(run.name())),
            None => Ok(()),
        }
    }

    /// A folder for a new run that does not exist yet.
    fn free_folder(&self) -> PathBuf {
        let RunConfig { task, method, seed, .. } = &self.setup.config;
        let base = format!("{}-{method}-seed{seed}", task.name);
        let candidates = std::iter::once(base.clone()).chain((2..).map(|n| format!("{base}-{n}")));
        let mut paths = candidates.map(|name| self.folder.join(name));
        // The second iterator does not end.
        paths.find(|path| !path.exists()).unwrap_or_else(|| self.folder.join(base))
    }

    pub(super) fn stop(&mut self) -> Result<String, SessionError> {
        if self.run_mut().is_some_and(RunView::unqueue) {
            return Ok("taken out of the queue".to_owned());
        }
        self.send(Control::Stop { reason: "asked to".to_owned() }, "stopping after this episode")
    }

    pub(super) fn send(&mut self, control: Control, report: &str) -> Result<String, SessionError> {
        self.run_mut().ok_or(SessionError::NoRun)?.send(control)?;
        Ok(report.to_owned())
    }

    /// The number of the run in a folder, if the session knows it.
    pub(super) fn number_of(&self, folder: &Path) -> Option<usize> {
        self.runs.iter().find(|run| run.directory().path() == folder).map(RunView::number)
    }

    pub(super) fn open(&mut self, folder: &Path) -> Result<String, SessionError> {
        let number = match self.number_of(folder) {
            Some(number) => number,
            None => {
                let view = RunView::read(folder)?;
                self.add(view)
            }
        };
        self.current = Some(number);
        Ok(format!("opened {}", folder.display()))
    }

    pub(super) fn watch(&mut self, number: usize) -> Result<String, SessionError> {
        let run = self.runs.iter().find(|run| run.number() == number).ok_or(SessionError::NoSuchRun(number + 1))?;
        let report = format!("run {} is {}", number + 1, run.name());
        self.current = Some(number);
        Ok(report)
    }

    /// Deletes a run's folder, unless somebody, here or in another process, works on it.
    pub(super) fn delete(&mut self, folder: &Path) -> Result<String, SessionError> {
        self.refuse_if_busy(folder)?;
        let directory = RunDirectory::open(folder)?;
        let lock = directory.lock()?;
        std::fs::remove_dir_all(folder).map_err(|source| SessionError::Delete { path: folder.to_owned(), source })?;
        drop(lock);
        if let Some(number) = self.number_of(folder) {
            self.runs.retain(|run| run.number() != number);
            self.current = self.current.filter(|current| *current != number);
        }
        Ok(format!("deleted {}", folder.display()))
    }

    pub(super) fn evaluate(&mut self) -> Result<String, SessionError> {
        let trace = self.run().ok_or(SessionError::NoRun)?.greedy_episode(self.setup.config.seed)?;
        let outcome = if trace.reached_goal() { "reaches the goal" } else { "does not reach the goal" };
        Ok(format!("the greedy policy {outcome} in {} actions, return {:.2}", trace.steps.len(), trace.total_reward()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::RunState;
    use crate::workbench::Command;

    fn session(folder: &Path, lines: &[&str]) -> Session {
        let mut session = Session::new(crate::task::load("task1").unwrap(), folder.to_owned());
        session.set_cores(1);
        apply(&mut session, &["method ddpg", "episodes 3", "set ddpg.hidden 8"]);
        apply(&mut session, lines);
        session
    }

    fn apply(session: &mut Session, lines: &[&str]) {
        for line in lines {
            session.apply(Command::parse(line).unwrap().unwrap()).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
    }

    fn try_line(session: &mut Session, line: &str) -> Result<String, String> {
        session.apply(Command::parse(line).unwrap().unwrap()).map_err(|error| error.to_string())
    }

    #[test]
    fn runs_beyond_the_cores_wait_for_their_turn_and_are_all_trained() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path(), &["train", "seed 1", "train", "seed 2", "train"]);
        assert_eq!(session.runs().iter().filter(|run| run.is_queued()).count(), 2);
        let error = try_line(&mut session, "pause").unwrap_err();
        assert!(error.contains("waits for a free core"), "{error}");
        assert_eq!(try_line(&mut session, "stop").unwrap(), "taken out of the queue");
        apply(&mut session, &["wait"]);
        let states: Vec<RunState> = session.runs().iter().map(RunView::state).collect();
        assert_eq!(states, [RunState::Finished, RunState::Finished, RunState::NotStarted]);
        apply(&mut session, &["watch 3", "continue", "wait", "expect episodes = 3"]);
    }

    #[test]
    fn a_paused_run_leaves_its_core_and_can_be_acted_on_later() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path(), &["train until 1", "train", "wait", "expect episodes = 3"]);
        apply(&mut session, &["watch 1", "expect episodes = 1", "resume", "wait", "expect episodes = 3"]);
        assert_eq!(try_line(&mut session, "watch 3").unwrap_err(), "the session has no run 3");
    }

    #[test]
    fn a_run_is_deleted_only_when_nobody_works_on_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let shown = shell_words::quote(&path.display().to_string()).into_owned();
        let mut session = session(folder.path(), &[&format!("train {shown} until 1"), "wait"]);
        let error = try_line(&mut session, &format!("delete {shown}")).unwrap_err();
        assert!(error.contains("run is being trained"), "{error}");
        apply(&mut session, &["stop", "wait"]);
        let other = RunDirectory::open(&path).unwrap();
        let lock = other.lock().unwrap();
        assert!(try_line(&mut session, &format!("delete {shown}")).is_err(), "another process works on it");
        drop(lock);
        apply(&mut session, &[&format!("delete {shown}")]);
        assert!(!path.exists() && session.runs().is_empty() && session.run().is_none());
        let error = try_line(&mut session, &format!("delete {shown}")).unwrap_err();
        assert!(!error.is_empty());
    }

    #[test]
    fn a_threshold_without_clusters_says_what_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path(), &["train until 1"]);
        let told = try_line(&mut session, "epsilon 0.5").unwrap();
        assert!(told.contains("no action clusters") && told.contains("`guide`"), "{told}");
        apply(&mut session, &["stop", "wait"]);
    }

    #[test]
    fn a_figure_carries_the_seeds_of_all_it_shows() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path(), &["train", "wait", "seed 7", "train", "wait", "seed 9"]);
        let mut seeds = |kind: &str| {
            let path = folder.path().join(format!("{kind}.png"));
            apply(&mut session, &[&format!("figure {kind} {}", path.display())]);
            crate::figures::Provenance::read(&path).unwrap().seeds
        };
        assert_eq!(seeds("learning"), [0, 7]);
        assert_eq!(seeds("dashboard"), [7]);
        assert_eq!(seeds("scene"), [9]);
    }

    #[test]
    fn planning_has_no_policy_to_play() {
        let folder = tempfile::tempdir().unwrap();
        let lines = ["method planning", "model true", "set planner.rollouts 8", "episodes 1", "train", "wait"];
        let mut session = session(folder.path(), &lines);
        let error = try_line(&mut session, "evaluate").unwrap_err();
        assert!(error.contains("learns no policy"), "{error}");
    }
}
