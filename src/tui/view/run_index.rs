//! The runs in a folder, read on a background thread: all of them once, then only those that may have
//! changed, because a folder may hold thousands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant, SystemTime};

use super::RunSummary;
use mge_results::is_listed_run;
use mge_run::{Notes, RunDirectory, RunError, RunState, Stamp};
use mge_trainer::RunConfig;

/// Minimum time between two reports while many runs are read.
const REPORT: Duration = Duration::from_millis(200);
/// The coarsest resolution of modification times among file systems.
const MTIME_RESOLUTION: Duration = Duration::from_secs(2);
/// Number of runs at rest checked in one look; the others are checked in later ones.
const CHECKED_PER_LOOK: usize = 500;

/// The runs in a folder, as far as they are known.
pub struct RunIndex {
    runs: Vec<Arc<RunSummary>>,
    damaged: Vec<String>,
    unread: usize,
    /// The folder last looked at.
    folder: PathBuf,
    /// Sends the folder to look at.
    looks: Sender<PathBuf>,
    reports: Receiver<Report>,
}

struct Report {
    folder: PathBuf,
    runs: Vec<Arc<RunSummary>>,
    damaged: Vec<String>,
    unread: usize,
}

impl RunIndex {
    /// An empty index and its reader thread.
    pub fn new() -> Self {
        let (looks, folders) = channel();
        let (sender, reports) = channel();
        let work = move || Reader::new(sender, REPORT).work(&folders);
        // If the thread cannot be started, nothing is read.
        let _ = std::thread::Builder::new().name("mge-runs".to_owned()).spawn(work);
        Self { runs: Vec::new(), damaged: Vec::new(), unread: 0, folder: PathBuf::new(), looks, reports }
    }

    /// Looks at a folder, in the background.
    pub fn look(&mut self, folder: &Path) {
        if self.folder != folder {
            // At least 1 until its runs have been counted.
            (self.folder, self.unread) = (folder.to_owned(), 1);
            self.runs.clear();
            self.damaged.clear();
        }
        // Sending fails only without the thread; then nothing more is read.
        let _ = self.looks.send(folder.to_owned());
    }

    /// Takes over the latest report. True if there is one.
    pub fn collect(&mut self) -> bool {
        // A report of the folder before may still arrive.
        let latest = self.reports.try_iter().filter(|report| report.folder == self.folder).last();
        let news = latest.is_some();
        if let Some(report) = latest {
            (self.runs, self.damaged, self.unread) = (report.runs, report.damaged, report.unread);
        }
        news
    }

    /// The runs, ordered by path.
    pub fn runs(&self) -> &[Arc<RunSummary>] {
        &self.runs
    }

    /// Why each damaged run cannot be read.
    pub fn damaged(&self) -> &[String] {
        &self.damaged
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
    /// None if it is not a run, or a damaged one.
    run: Option<Arc<RunSummary>>,
    /// Why it cannot be read, if it is a damaged run.
    damage: Option<String>,
}

/// Reads folders on the background thread.
struct Reader {
    folder: PathBuf,
    modified: Option<SystemTime>,
    known: BTreeMap<PathBuf, Known>,
    /// Where the next look at runs at rest begins.
    turn: usize,
    /// The latest report lacks something.
    is_stale: bool,
    reports: Sender<Report>,
    /// Minimum time between two reports in one look.
    interval: Duration,
}

impl Reader {
    fn new(reports: Sender<Report>, interval: Duration) -> Self {
        let (folder, known) = (PathBuf::new(), BTreeMap::new());
        Self { folder, modified: None, known, turn: 0, is_stale: true, reports, interval }
    }

    /// Looks at folders until the index is dropped.
    fn work(mut self, folders: &Receiver<PathBuf>) {
        while let Ok(folder) = folders.recv() {
            self.enter(folder);
            // Only the latest of several pending requests is carried out.
            folders.try_iter().for_each(|later| self.enter(later));
            if !self.look() {
                return;
            }
        }
    }

    /// Forgets what is known if the folder is another one.
    fn enter(&mut self, folder: PathBuf) {
        if self.folder != folder {
            *self = Self { folder, ..Self::new(self.reports.clone(), self.interval) };
        }
    }

    /// Reads what may have changed. False once the index has been dropped.
    fn look(&mut self) -> bool {
        self.is_stale |= self.list();
        let due = self.due();
        let mut reported = Instant::now();
        for (index, path) in due.iter().enumerate() {
            self.is_stale |= self.read(path);
            if self.is_stale && reported.elapsed() >= self.interval {
                if !self.report(due.len() - index - 1) {
                    return false;
                }
                reported = Instant::now();
            }
        }
        !self.is_stale || self.report(0)
    }

    /// Lists the folder: adds new entries and drops deleted ones. True if there are any.
    fn list(&mut self) -> bool {
        let modified = std::fs::metadata(&self.folder).and_then(|data| data.modified()).ok();
        if modified.is_some() && modified == self.modified {
            return false;
        }
        // A folder changed just now may change again without a change of its modification time.
        self.modified = modified.filter(|at| at.elapsed().is_ok_and(|age| age >= MTIME_RESOLUTION));
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
        let (run, damage) = match glance(path) {
            Ok(run) => (run.map(Arc::new), None),
            Err(error) => (None, Some(error.to_string())),
        };
        let changed = match (&run, &known.run) {
            (Some(new), Some(old)) => {
                (new.done, &new.state, &new.tags, &new.note) != (old.done, &old.state, &old.tags, &old.note)
            }
            (None, None) => damage != known.damage,
            _ => true,
        };
        *known = Known { stamp, run, damage };
        changed
    }

    fn report(&mut self, unread: usize) -> bool {
        // After a partial report, a final one states that nothing is left to read.
        self.is_stale = unread > 0;
        let runs = self.known.values().filter_map(|known| known.run.clone()).collect();
        let damaged = self.known.values().filter_map(|known| known.damage.clone()).collect();
        self.reports.send(Report { folder: self.folder.clone(), runs, damaged, unread }).is_ok()
    }
}

/// A summary of a run without reading its whole log. None if the folder is not a run of an agent.
///
/// # Errors
/// When the run is damaged.
fn glance(path: &Path) -> Result<Option<RunSummary>, RunError> {
    if !is_listed_run(path) {
        return Ok(None);
    }
    let directory = RunDirectory::open(path)?;
    if directory.is_of_model()? {
        return Ok(None);
    }
    let config = RunConfig::of(&directory)?;
    let status = directory.status()?;
    // Unreadable notes count as none here; writing new ones reports the error.
    let Notes { tags, note, .. } = directory.notes().unwrap_or_default();
    Ok(Some(RunSummary {
        tags,
        note,
        done: status.last_episode.as_ref().map_or(0, |record| record.episode),
        success: status.last_episode.map(|record| record.rolling_success as f32),
        ..RunSummary::new(path, Arc::new(config), status.state)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::{EpisodeRecord, Event, RunWriter};

    fn make(folder: &Path, name: &str) -> RunDirectory {
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        RunDirectory::create(folder.join(name), &config).unwrap()
    }

    fn finish(directory: &RunDirectory, episode: u64) {
        let mut writer = RunWriter::open(directory, 0).unwrap();
        writer.record(&Event::EpisodeFinished(EpisodeRecord { episode, ..EpisodeRecord::default() })).unwrap();
        writer.record(&Event::Finished { episode }).unwrap();
    }

    /// The latest report after a look.
    fn look(reader: &mut Reader, reports: &Receiver<Report>, folder: &Path) -> Option<Vec<(String, u64)>> {
        reader.enter(folder.to_owned());
        assert!(reader.look());
        let report = reports.try_iter().last()?;
        assert_eq!(report.unread, 0);
        Some(report.runs.iter().map(|run| (run.name.clone(), run.done)).collect())
    }

    #[test]
    fn new_deleted_and_changed_runs_are_noticed_and_others_are_not_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let (sender, reports) = channel();
        let mut reader = Reader::new(sender, REPORT);
        let first = make(folder.path(), "a");
        std::fs::create_dir(folder.path().join("no run")).unwrap();
        let broken = folder.path().join("broken");
        std::fs::create_dir(&broken).unwrap();
        std::fs::write(broken.join("config.json"), "{").unwrap();
        // As while a fork is being copied.
        let unfinished = folder.path().join(".writing-x");
        std::fs::create_dir(&unfinished).unwrap();
        std::fs::write(unfinished.join("events.jsonl"), "").unwrap();
        let named = |name: &str, done| (name.to_owned(), done);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 0)]));
        assert_eq!(reader.known.values().filter(|known| known.damage.is_some()).count(), 1, "only the broken one");
        assert_eq!(look(&mut reader, &reports, folder.path()), None, "nothing has changed");
        for path in [first.path(), broken.as_path()] {
            let file = std::fs::File::options().write(true).open(path.join("config.json")).unwrap();
            file.set_modified(SystemTime::UNIX_EPOCH).unwrap();
            assert_eq!(look(&mut reader, &reports, folder.path()), None, "nothing that is shown has changed");
        }
        finish(&first, 7);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 7)]));
        first.change_notes(|notes| notes.tags.push("paper".to_owned())).unwrap();
        assert!(look(&mut reader, &reports, folder.path()).is_some(), "a tag is news");
        finish(&make(folder.path(), "b"), 3);
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("a", 7), named("b", 3)]));
        std::fs::remove_dir_all(folder.path().join("a")).unwrap();
        assert_eq!(look(&mut reader, &reports, folder.path()), Some(vec![named("b", 3)]));
        let elsewhere = tempfile::tempdir().unwrap();
        assert_eq!(look(&mut reader, &reports, elsewhere.path()), Some(Vec::new()));
    }

    #[test]
    fn the_death_of_the_process_that_trains_a_run_is_noticed() {
        for (event, working) in
            [(Event::Resumed { episode: 1 }, RunState::Running), (Event::Paused { episode: 1 }, RunState::Paused)]
        {
            let folder = tempfile::tempdir().unwrap();
            let (sender, reports) = channel();
            let mut reader = Reader::new(sender, REPORT);
            let run = make(folder.path(), "run");
            let mut writer = RunWriter::open(&run, 0).unwrap();
            let record = EpisodeRecord { episode: 1, ..EpisodeRecord::default() };
            writer.record(&Event::EpisodeFinished(record)).unwrap();
            writer.record(&event).unwrap();
            let state = |reader: &Reader| reader.known[run.path()].run.as_ref().unwrap().state.clone();
            assert!(look(&mut reader, &reports, folder.path()).is_some());
            assert_eq!(state(&reader), working);
            assert_eq!(look(&mut reader, &reports, folder.path()), None, "it is still being trained");
            // The log stays as it is.
            drop(writer);
            assert!(look(&mut reader, &reports, folder.path()).is_some(), "{working:?}");
            assert_eq!(state(&reader), RunState::Interrupted);
        }
    }

    #[test]
    fn runs_at_rest_are_checked_in_turns() {
        let (sender, _reports) = channel();
        let mut reader = Reader::new(sender, REPORT);
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
        reader.known.extend((0..600).map(|name| (PathBuf::from(format!("new {name}")), Known::default())));
        assert_eq!(reader.due().len(), CHECKED_PER_LOOK + 600, "folders that were never read come first");
    }

    #[test]
    fn a_run_created_without_a_change_of_the_folders_time_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let (sender, reports) = channel();
        let mut reader = Reader::new(sender, REPORT);
        let now = SystemTime::now();
        for (name, count) in [("a", 1), ("b", 2)] {
            make(folder.path(), name);
            std::fs::File::open(folder.path()).unwrap().set_modified(now).unwrap();
            assert_eq!(look(&mut reader, &reports, folder.path()).map(|runs| runs.len()), Some(count));
        }
    }

    #[test]
    fn a_partial_report_is_followed_by_a_final_one() {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path(), "a");
        for name in ["b", "c"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        for (interval, unread) in [(Duration::ZERO, vec![2, 1, 0]), (Duration::MAX, vec![0])] {
            let (sender, reports) = channel();
            let mut reader = Reader::new(sender, interval);
            reader.enter(folder.path().to_owned());
            assert!(reader.look());
            let reports: Vec<Report> = reports.try_iter().collect();
            assert!(reports.iter().all(|report| report.runs.len() == 1 && report.runs[0].name == "a"));
            assert_eq!(reports.iter().map(|report| report.unread).collect::<Vec<_>>(), unread);
        }
    }

    #[test]
    fn a_late_report_of_the_folder_before_is_ignored() {
        let (sender, reports) = channel();
        let mut index = RunIndex { reports, ..RunIndex::new() };
        index.look(Path::new("new"));
        let runs = vec![Arc::new(crate::tui::testing::run_summary("run"))];
        sender.send(Report { folder: "old".into(), runs, damaged: Vec::new(), unread: 0 }).unwrap();
        assert!(!index.collect());
        assert!(index.runs().is_empty() && index.unread() == 1);
    }

    #[test]
    fn another_folder_is_unknown_until_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path(), "a");
        let mut index = RunIndex::new();
        let elsewhere = folder.path().join("elsewhere");
        for (looked, count) in [(folder.path(), 1), (elsewhere.as_path(), 0), (folder.path(), 1)] {
            index.look(looked);
            assert!(index.runs().is_empty() && index.unread() == 1);
            let since = Instant::now();
            while index.unread() > 0 {
                assert!(since.elapsed() < Duration::from_secs(20));
                index.collect();
                std::thread::yield_now();
            }
            assert_eq!(index.runs().len(), count);
        }
    }
}
