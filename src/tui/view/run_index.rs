//! The runs in a folder, read on a background thread: all of them once, then only those that may have
//! changed, because a folder may hold thousands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant, SystemTime};

use super::RunSummary;
use crate::run::{Notes, RunDirectory, RunState, Stamp};
use crate::trainer::RunConfig;

/// Minimum time between two reports while many runs are read.
const REPORT: Duration = Duration::from_millis(200);
/// The coarsest resolution of modification times among file systems.
const TICK: Duration = Duration::from_secs(2);
/// Number of runs at rest checked in one look; the others are checked in later ones.
const CHECKED_PER_LOOK: usize = 500;

/// The runs in a folder, as far as they are known.
pub struct RunIndex {
    runs: Vec<Arc<RunSummary>>,
    unread: usize,
    /// The folder last looked at.
    folder: PathBuf,
    /// Sends the folder to look at; None if the thread could not be started.
    looks: Option<Sender<PathBuf>>,
    reports: Receiver<Report>,
}

struct Report {
    runs: Vec<Arc<RunSummary>>,
    unread: usize,
}

impl RunIndex {
    /// An empty index and its reader thread.
    pub fn new() -> Self {
        let (looks, folders) = channel();
        let (sender, reports) = channel();
        let work = move || Reader::new(sender).work(&folders);
        let thread = std::thread::Builder::new().name("mge-runs".to_owned()).spawn(work);
        Self { runs: Vec::new(), unread: 0, folder: PathBuf::new(), looks: thread.is_ok().then_some(looks), reports }
    }

    /// Looks at a folder, in the background.
    pub fn look(&mut self, folder: &Path) {
        if self.folder != folder {
            // At least 1 until its runs have been counted.
            (self.folder, self.unread) = (folder.to_owned(), 1);
            self.runs.clear();
        }
        if let Some(looks) = &self.looks {
            // Sending fails only if the thread has ended; then nothing more is read.
            let _ = looks.send(folder.to_owned());
        }
    }

    /// Takes over the latest report. True if there is one.
    pub fn collect(&mut self) -> bool {
        let latest = self.reports.try_iter().last();
        let news = latest.is_some();
        if let Some(report) = latest {
            (self.runs, self.unread) = (report.runs, report.unread);
        }
        news
    }

    /// The runs, ordered by path.
    pub fn runs(&self) -> &[Arc<RunSummary>] {
        &self.runs
    }

    /// Number of folders not read yet.
    pub fn unread(&self) -> usize {
        self.unread
    }
}

/// What is known of a folder since it was last read.
#[derive(Default)]
struct Known {
    stamp: Stamp,
    /// None if it is not a run.
    run: Option<Arc<RunSummary>>,
}

/// Reads folders on the background thread.
struct Reader {
    folder: PathBuf,
    modified: Option<SystemTime>,
    known: BTreeMap<PathBuf, Known>,
    /// Where the next look at runs at rest begins.
    turn: usize,
    reports: Sender<Report>,
}

impl Reader {
    fn new(reports: Sender<Report>) -> Self {
        Self { folder: PathBuf::new(), modified: None, known: BTreeMap::new(), turn: 0, reports }
    }

    /// Looks at folders until the index is dropped.
    fn work(mut self, folders: &Receiver<PathBuf>) {
        while let Ok(mut folder) = folders.recv() {
            // Only the latest of several pending requests counts.
            while let Ok(later) = folders.try_recv() {
                folder = later;
            }
            if !self.look(&folder) {
                return;
            }
        }
    }

    /// Reads what may have changed. False once the index has been dropped.
    fn look(&mut self, folder: &Path) -> bool {
        let first = self.folder != folder;
        if first {
            *self = Self { folder: folder.to_owned(), ..Self::new(self.reports.clone()) };
        }
        let mut changed = self.list() || first;
        let due = self.due();
        let mut reported = Instant::now();
        for (index, path) in due.iter().enumerate() {
            changed |= self.read(path);
            if changed && reported.elapsed() >= REPORT {
                if !self.report(due.len() - index - 1) {
                    return false;
                }
                reported = Instant::now();
                changed = false;
            }
        }
        // After a partial report, a final one states that nothing is left to read.
        !(changed || due.len() > CHECKED_PER_LOOK) || self.report(0)
    }

    /// Lists the folder: adds new entries and drops deleted ones. True if there are any.
    fn list(&mut self) -> bool {
        let modified = std::fs::metadata(&self.folder).and_then(|data| data.modified()).ok();
        if modified.is_some() && modified == self.modified {
            return false;
        }
        // A folder changed just now may change again without a change of its modification time.
        self.modified = modified.filter(|at| at.elapsed().is_ok_and(|age| age >= TICK));
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut listed: BTreeMap<PathBuf, Known> = BTreeMap::new();
        let mut changed = false;
        for path in entries.map(|entry| entry.path()) {
            let known = self.known.remove(&path);
            changed |= known.is_none();
            listed.insert(path, known.unwrap_or_default());
        }
        changed |= !self.known.is_empty();
        self.known = listed;
        changed
    }

    /// Folders to check now: those never read, runs that are running, paused or not started, and some of the
    /// others in turn.
    fn due(&mut self) -> Vec<PathBuf> {
        let is_urgent = |known: &Known| match &known.run {
            Some(run) => matches!(run.state, RunState::Running | RunState::Paused | RunState::NotStarted),
            None => known.stamp == Stamp::default(),
        };
        let (urgent, at_rest): (Vec<_>, Vec<_>) = self.known.iter().partition(|(_, known)| is_urgent(known));
        let start = if self.turn < at_rest.len() { self.turn } else { 0 };
        let others = at_rest.iter().cycle().skip(start).take(CHECKED_PER_LOOK.min(at_rest.len()));
        self.turn = start + CHECKED_PER_LOOK;
        urgent.iter().chain(others).map(|(path, _)| (*path).clone()).collect()
    }

    /// Reads a run if it may have changed. True if it has.
    fn read(&mut self, path: &Path) -> bool {
        let Some(known) = self.known.get_mut(path) else { return false };
        let stamp = Stamp::of(path);
        let is_worked_on =
            known.run.as_ref().is_some_and(|run| matches!(run.state, RunState::Running | RunState::Paused));
        if stamp == known.stamp && !is_worked_on {
            return false;
        }
        let run = glance(path).map(Arc::new);
        let changed = match (&run, &known.run) {
            (Some(new), Some(old)) => {
                (new.done, &new.state, &new.tags, &new.note) != (old.done, &old.state, &old.tags, &old.note)
            }
            (None, None) => false,
            _ => true,
        };
        *known = Known { stamp, run };
        changed
    }

    fn report(&self, unread: usize) -> bool {
        let runs = self.known.values().filter_map(|known| known.run.clone()).collect();
        self.reports.send(Report { runs, unread }).is_ok()
    }
}

/// A summary of a run without reading its whole log. None if the folder is not a run.
fn glance(path: &Path) -> Option<RunSummary> {
    let directory = RunDirectory::open(path).ok()?;
    let config: RunConfig = directory.config().ok()?;
    let status = directory.status().ok()?;
    // Unreadable notes count as none here; writing new ones reports the error.
    let Notes { tags, note, .. } = directory.notes().unwrap_or_default();
    Some(RunSummary {
        tags,
        note,
        done: status.last_episode.as_ref().map_or(0, |record| record.episode),
        success: status.last_episode.map(|record| record.rolling_success as f32),
        ..RunSummary::new(path, Arc::new(config), status.state)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{EpisodeRecord, Event, RunWriter};

    fn make(folder: &Path, name: &str) -> RunDirectory {
        let config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
        RunDirectory::create(folder.join(name), &config).unwrap()
    }

    fn finish(directory: &RunDirectory, episode: u64) {
        let mut writer = RunWriter::open(directory, 0).unwrap();
        writer.record(&Event::EpisodeFinished(EpisodeRecord { episode, ..EpisodeRecord::default() })).unwrap();
        writer.record(&Event::Finished { episode }).unwrap();
    }

    /// The latest report after a look.
    fn look(reader: &mut Reader, reports: &Receiver<Report>, folder: &Path) -> Option<Vec<(String, u64)>> {
        assert!(reader.look(folder));
        let report = reports.try_iter().last()?;
        assert_eq!(report.unread, 0);
        Some(report.runs.iter().map(|run| (run.name.clone(), run.done)).collect())
    }

    #[test]
    fn new_deleted_and_changed_runs_are_noticed_and_others_are_not_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let (sender, reports) = channel();
        let mut reader = Reader::new(sender);
        let first = make(folder.path(), "a");
        std::fs::create_dir(folder.path().join("no run")).unwrap();
        let named = |name: &str, done| (name.to_owned(), done);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 0)]));
        assert_eq!(look(&mut reader, &reports, folder.path()), None, "nothing has changed");
        finish(&first, 7);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 7)]));
        let mut notes = first.notes().unwrap();
        notes.tags.push("paper".to_owned());
        first.write_notes(&notes).unwrap();
        assert!(look(&mut reader, &reports, folder.path()).is_some(), "a tag is news");
        finish(&make(folder.path(), "b"), 3);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 7), named("b", 3)]));
        std::fs::remove_dir_all(folder.path().join("a")).unwrap();
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("b", 3)]));
        let elsewhere = tempfile::tempdir().unwrap();
        assert_eq!(look(&mut reader, &reports, elsewhere.path()), Some(Vec::new()));
    }

    #[test]
    fn runs_at_rest_are_checked_in_turns() {
        let (sender, _reports) = channel();
        let mut reader = Reader::new(sender);
        let at_rest = |name: usize| {
            let run = RunSummary { state: RunState::Finished, ..crate::tui::testing::run_summary("run") };
            (PathBuf::from(format!("{name:05}")), Known { run: Some(Arc::new(run)), ..Known::default() })
        };
        reader.known = (0..1200).map(at_rest).collect();
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..3 {
            let due = reader.due();
            assert_eq!(due.len(), CHECKED_PER_LOOK);
            seen.extend(due);
        }
        assert_eq!(seen.len(), 1200);
    }

    #[test]
    fn another_folder_is_unknown_until_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path(), "a");
        let mut index = RunIndex::new();
        index.look(folder.path());
        assert_eq!(index.unread(), 1);
        while index.unread() > 0 {
            index.collect();
            std::thread::yield_now();
        }
        assert_eq!(index.runs().len(), 1);
        index.look(&folder.path().join("elsewhere"));
        assert!(index.runs().is_empty() && index.unread() > 0);
    }
}
