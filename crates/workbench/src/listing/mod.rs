//! What is known of the runs of a session and of its folder: their summaries, curves and groups, read in the background.

mod cost;
mod curves;
pub(crate) mod folder;
mod groups;
mod histories;
mod models;
mod summary;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

pub use cost::{comparable, cost_of_an_episode};
pub use curves::{Curves, XAxis};
pub use folder::read_run;
pub use groups::{GroupCurves, Grouping, RunGroup, scores_of};
pub use models::{ModelSummary, named_tasks};
pub use summary::RunSummary;

use crate::{Loader, RunView, Session};
use folder::{Folder, is_in};
use groups::Grouper;
use histories::Histories;
use mge_run::RunState;
use mge_trainer::Phase;

/// Time between two scans of the folder, in which other processes may train runs.
const SCAN: Duration = Duration::from_secs(2);
/// Maximum time of one scan, so that the runs of a large folder appear while others are read.
const SLICE: Duration = Duration::from_millis(200);

/// The runs of a session and of its folder.
#[derive(Debug, Default)]
pub struct Listing {
    /// All runs: those of the folder by path, then new ones of the session.
    pub runs: Vec<Arc<RunSummary>>,
    folder: Loader<PathBuf, Arc<Folder>>,
    /// The folder has to be scanned at once.
    pub is_due: bool,
    histories: Histories,
    grouper: Grouper,
}

impl Listing {
    /// The latest grouping of the runs.
    pub fn groups(&self) -> &Arc<Grouping> {
        &self.grouper.known
    }

    /// Number of runs in the session's folder that have not been read yet; at least 1 before they have been counted.
    pub fn unread(&self, session: &Session) -> usize {
        self.scanned(session).map_or(1, |scanned| scanned.as_ref().map_or(0, |folder| folder.unread))
    }

    /// Why each damaged run of the session's folder, or the folder itself, cannot be read.
    pub fn damaged(&self, session: &Session) -> Vec<String> {
        match self.scanned(session) {
            Some(Ok(folder)) => folder.damaged().cloned().collect(),
            Some(Err(reason)) => vec![reason.clone()],
            None => Vec::new(),
        }
    }

    /// The latest scan of the session's folder, if there was one, or why it failed.
    fn scanned(&self, session: &Session) -> Option<&Result<Arc<Folder>, String>> {
        Some(self.folder.latest(|path| path == session.folder())?.1)
    }

    fn folder_of(&self, session: &Session) -> Option<&Arc<Folder>> {
        self.scanned(session)?.as_ref().ok()
    }

    /// Requests the curves of the runs in these folders.
    pub fn request_curves(&mut self, runs: Vec<PathBuf>, session: &Session) {
        let is_opened = |path: &PathBuf| session.runs().iter().any(|run| run.directory().path() == path);
        let others = self.runs.iter().filter(|run| run.state == RunState::Running).flat_map(|run| self.others(run));
        let wanted = runs.into_iter().chain(others.map(|run| run.path.clone()));
        self.histories.request(wanted.filter(|path| !is_opened(path)).collect());
    }

    /// Takes over what was read, and reads on. True if something is new.
    pub fn poll(&mut self, session: &Session) -> bool {
        let is_new = [
            self.folder.poll() && self.folder_of(session).is_none_or(|folder| folder.is_new),
            self.histories.poll(),
            self.grouper.poll(&self.runs),
        ];
        self.scan(session);
        is_new.contains(&true)
    }

    /// Scans the folder in the background if it is time to.
    fn scan(&mut self, session: &Session) {
        if self.folder.is_loading() {
            return;
        }
        let opened: Vec<PathBuf> = session.runs().iter().map(|run| run.directory().path().to_owned()).collect();
        let before = self.folder_of(session).cloned();
        let is_complete = |folder: &Arc<Folder>| folder.unread == 0 && opened.iter().all(|run| folder.has(run));
        let is_complete = self.scanned(session).is_some_and(|scanned| scanned.as_ref().map_or(true, is_complete));
        let age = if self.is_due || !is_complete { Duration::ZERO } else { SCAN };
        self.is_due = false;
        let path = session.folder().to_owned();
        let scan = move |_: &_| {
            let scanned = Folder::scan(before.as_deref(), &path, &opened, SLICE);
            scanned.map(Arc::new).map_err(|error| error.to_string())
        };
        self.folder.request(session.folder().to_owned(), age, scan);
    }

    /// Updates the runs from the session and from what was read.
    pub fn refresh(&mut self, session: &Session) {
        let before = std::mem::take(&mut self.runs).into_iter().filter(|run| run.opened);
        let mut before: HashMap<PathBuf, Arc<RunSummary>> = before.map(|run| (run.path.clone(), run)).collect();
        let folder = self.folder_of(session).cloned();
        // Another process may have deleted or moved a run, which its training tells itself.
        let is_gone = |path: &Path| folder.as_ref().is_some_and(|folder| folder.is_gone(path));
        let mut opened: HashMap<&Path, Arc<RunSummary>> = session
            .runs()
            .iter()
            .filter(|run| run.is_active() || run.is_queued() || !is_gone(run.directory().path()))
            .map(|run| {
                let path = run.directory().path();
                let curves = before.remove(path).map(|known| known.curves.clone()).unwrap_or_default();
                (path, Arc::new(self.opened(run, curves, session)))
            })
            .collect();
        let on_disk = folder.iter().flat_map(|folder| folder.runs());
        self.runs = on_disk.map(|run| opened.remove(&*run.path).unwrap_or_else(|| self.with_history(run))).collect();
        self.runs.extend(session.runs().iter().filter_map(|run| opened.remove(run.directory().path())));
        // Those that are not found in the folder yet are the latest ones.
        self.runs.sort_by_key(|run| (run.made.is_none(), run.made));
        self.expect();
        self.grouper.stale = true;
    }

    /// The runs that tell how long a run will take.
    fn others(&self, run: &RunSummary) -> Vec<&RunSummary> {
        comparable(&self.runs, &run.config.task.name, run.config.method, run.episodes())
    }

    /// Sets what the other runs tell of the speed of those being trained.
    fn expect(&mut self) {
        for index in 0..self.runs.len() {
            let run = &self.runs[index];
            if run.state == RunState::Running {
                let expected = cost::rest(run, &self.others(run));
                Arc::make_mut(&mut self.runs[index]).expected = expected;
            }
        }
    }

    /// The summary of a run with its curves, as far as they have been read.
    fn with_history(&self, run: &Arc<RunSummary>) -> Arc<RunSummary> {
        let Some(history) = self.histories.of(&run.path) else { return run.clone() };
        Arc::new(RunSummary::clone(run).with_log(&history.log, history.curves.clone()))
    }

    /// The summary of a run of the session; it continues its `curves`.
    fn opened(&self, run: &RunView, mut curves: Arc<Curves>, session: &Session) -> RunSummary {
        let path = run.directory().path();
        let on_disk = self.folder_of(session).and_then(|folder| folder.run(path));
        let read = || on_disk.map(|known| RunSummary::clone(known)).or_else(|| read_run(path).ok()?);
        if let Some(known) = run.unread.then(read).flatten() {
            return RunSummary { opened: true, ..known };
        }
        let records = &run.history().records;
        if !curves.is_of(records) {
            curves = Arc::new(Curves::of(records, &run.history().times));
        }
        let state = run.last_state().or(on_disk.map(|known| known.state.clone())).unwrap_or(RunState::Interrupted);
        let summary = RunSummary {
            name: run.name.clone(),
            opened: true,
            elsewhere: !is_in(path, session.folder()),
            made: on_disk.and_then(|known| known.made),
            active: run.is_active(),
            queued: run.is_queued(),
            damaged: run.is_damaged(),
            preparing: run.phase().as_ref().and_then(Phase::preparation),
            done: run.episodes(),
            success: records.last().map(|record| record.rolling_success),
            note: on_disk.map(|known| known.note.clone()).unwrap_or_default(),
            ..RunSummary::new(path, run.config().clone(), state)
        };
        summary.with_log(run.history(), curves)
    }
}
