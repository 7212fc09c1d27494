//! The runs in a folder: all of them are read once, then only those that may have changed, because a folder may hold
//! thousands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::RunSummary;
use mge_base::paths::entries;
use mge_results::is_listed_run;
use mge_run::{RunDirectory, RunError, RunState, Stamp};
use mge_trainer::RunConfig;

/// Where a sweep's folder has its runs.
pub(crate) const OF_SWEEP: &str = "runs";

/// Whether a run belongs to a folder of runs, or of a sweep.
pub(super) fn is_in(run: &Path, folder: &Path) -> bool {
    run.parent().is_some_and(|parent| parent == folder || parent == folder.join(OF_SWEEP))
}

/// A folder as a scan has found it.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    path: PathBuf,
    known: BTreeMap<PathBuf, Known>,
    /// Something that is shown has changed since the scan before.
    pub is_new: bool,
    /// Number of entries that have not been read yet.
    pub unread: usize,
}

/// What is known of an entry since it was last read.
#[derive(Debug, Clone, Default)]
struct Known {
    /// None if it was never read.
    stamp: Option<Stamp>,
    /// None if it is not a run, or why it cannot be read, if it is a damaged one.
    run: Option<Result<Arc<RunSummary>, String>>,
}

impl Folder {
    /// The folder `path` now, given how a scan `before` has found it or another one, and some runs `elsewhere`. Reads
    /// what may have changed, for about `slice`; what is left is read by the next scan.
    ///
    /// # Errors
    /// When the folder exists, but cannot be listed.
    pub fn scan(before: Option<&Self>, path: &Path, elsewhere: &[PathBuf], slice: Duration) -> Result<Self, RunError> {
        let known = before.filter(|before| before.path == path).cloned();
        let mut folder = known.unwrap_or_else(|| Self { path: path.to_owned(), ..Self::default() });
        let begun = Instant::now();
        folder.is_new = before.is_none_or(|before| before.path != path) | folder.list(elsewhere)?;
        let mut due: Vec<PathBuf> = folder.known.keys().cloned().collect();
        due.sort_by_key(|path| folder.known[path].stamp.is_some());
        for (place, path) in due.into_iter().enumerate() {
            // A run that was read before takes no time unless it has changed.
            if place == 0 || begun.elapsed() < slice || folder.known[&path].stamp.is_some() {
                folder.is_new |= folder.read(&path);
            }
        }
        let unread = folder.known.values().filter(|known| known.stamp.is_none()).count();
        // The last part is news: nothing is left to read.
        folder.is_new |= unread != folder.unread;
        folder.unread = unread;
        Ok(folder)
    }

    /// What is known of the entries of the folder itself.
    fn entries(&self) -> impl Iterator<Item = &Known> {
        self.known.iter().filter(|(path, _)| is_in(path, &self.path)).map(|(_, known)| known)
    }

    /// Its runs, by path.
    pub fn runs(&self) -> impl Iterator<Item = &Arc<RunSummary>> {
        self.entries().filter_map(|known| known.run.as_ref()?.as_ref().ok())
    }

    /// The run at a path, also one elsewhere.
    pub fn run(&self, path: &Path) -> Option<&Arc<RunSummary>> {
        self.known.get(path)?.run.as_ref()?.as_ref().ok()
    }

    /// Whether a path is one of its entries, or of those elsewhere.
    pub fn has(&self, path: &Path) -> bool {
        self.known.contains_key(path)
    }

    /// Whether a path was read, and there is no run, not even a damaged one.
    pub fn is_gone(&self, path: &Path) -> bool {
        self.known.get(path).is_some_and(|known| known.stamp.is_some() && known.run.is_none())
    }

    /// Why each damaged run cannot be read.
    pub fn damaged(&self) -> impl Iterator<Item = &String> {
        self.entries().filter_map(|known| known.run.as_ref()?.as_ref().err())
    }

    /// Lists the folder: adds new entries and drops deleted ones. True if there are any.
    fn list(&mut self, elsewhere: &[PathBuf]) -> Result<bool, RunError> {
        let read = |path: &Path| entries(path).map_err(RunError::io("read", path));
        let (mut entries, inner) = (read(&self.path)?, self.path.join(OF_SWEEP));
        if inner.is_dir() {
            entries.extend(read(&inner)?);
        }
        let mut before = std::mem::take(&mut self.known);
        let mut is_new = false;
        for path in entries.into_iter().chain(elsewhere.iter().cloned()) {
            let known = before.remove(&path);
            is_new |= known.is_none() && !self.known.contains_key(&path);
            self.known.entry(path).or_insert_with(|| known.unwrap_or_default());
        }
        Ok(is_new || !before.is_empty())
    }

    /// Reads a run if it may have changed. True if it has.
    fn read(&mut self, path: &Path) -> bool {
        let Some(known) = self.known.get_mut(path) else { return false };
        let stamp = Some(Stamp::of(path));
        let is_going = |run: &RunSummary| matches!(run.state, RunState::Running | RunState::Paused);
        if known.stamp == stamp && !matches!(&known.run, Some(Ok(run)) if is_going(run)) {
            return false;
        }
        let run = read_run(path).map_err(|error| error.to_string()).map(|run| run.map(Arc::new)).transpose();
        let changed = match (&run, &known.run) {
            (Some(Ok(new)), Some(Ok(old))) => {
                let shown = |run: &RunSummary| (run.done, run.state.clone(), run.name.clone(), run.note.clone());
                shown(new) != shown(old) || new.config != old.config
            }
            (new, old) => new.as_ref().map(|new| new.as_ref().err()) != old.as_ref().map(|old| old.as_ref().err()),
        };
        *known = Known { stamp, run };
        changed
    }
}

/// A summary of a run without reading its whole log. None if the folder is not a run of an agent.
///
/// # Errors
/// When the run is damaged.
pub fn read_run(path: &Path) -> Result<Option<RunSummary>, RunError> {
    if !is_listed_run(path) {
        return Ok(None);
    }
    let directory = RunDirectory::open(path)?;
    if directory.is_of_model()? {
        return Ok(None);
    }
    let config = RunConfig::of(&directory)?;
    let status = directory.status()?;
    let is_prepared = status.state == RunState::Running && status.last_episode.is_none();
    Ok(Some(RunSummary {
        name: directory.name(),
        // Its log does not say in which phase it is.
        preparing: is_prepared.then(|| "model, clusters or practice, in another program".to_owned()),
        made: path.metadata().and_then(|folder| folder.created()).ok(),
        // Unreadable notes count as none here; writing new ones reports the error.
        note: directory.notes().unwrap_or_default().note,
        done: status.last_episode.as_ref().map_or(0, |record| record.episode),
        success: status.last_episode.map(|record| record.rolling_success),
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

    /// Scans a folder again; the names and episodes of its runs if something is new.
    fn scan(folder: &mut Folder, path: &Path) -> Option<Vec<(String, u64)>> {
        *folder = Folder::scan(Some(folder), path, &[], Duration::MAX).unwrap();
        assert_eq!(folder.unread, 0);
        folder.is_new.then(|| folder.runs().map(|run| (run.name.clone(), run.done)).collect())
    }

    #[test]
    fn new_deleted_and_changed_runs_are_noticed_and_others_are_not_read_again() {
        let directory = tempfile::tempdir().unwrap();
        let mut folder = Folder::default();
        let first = make(directory.path(), "a");
        std::fs::create_dir(directory.path().join("no run")).unwrap();
        let broken = directory.path().join("broken");
        std::fs::create_dir(&broken).unwrap();
        std::fs::write(broken.join("config.json"), "{").unwrap();
        // As while a fork is being copied.
        let unfinished = directory.path().join(".writing-x");
        std::fs::create_dir(&unfinished).unwrap();
        std::fs::write(unfinished.join("events.jsonl"), "").unwrap();
        let named = |name: &str, done| (name.to_owned(), done);
        assert_eq!(scan(&mut folder, directory.path()), Some(vec![named("a", 0)]));
        assert_eq!(folder.damaged().count(), 1, "only the broken one");
        assert_eq!(scan(&mut folder, directory.path()), None, "nothing has changed");
        for path in [first.path(), broken.as_path()] {
            let file = std::fs::File::options().write(true).open(path.join("config.json")).unwrap();
            file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
            assert_eq!(scan(&mut folder, directory.path()), None, "nothing that is shown has changed");
        }
        finish(&first, 7);
        assert_eq!(scan(&mut folder, directory.path()), Some(vec![named("a", 7)]));
        first.change_notes(|notes| notes.note = "paper".to_owned()).unwrap();
        assert!(scan(&mut folder, directory.path()).is_some(), "a note is news");
        first.replace_config(&RunConfig::of(&first).unwrap().extended(3000)).unwrap();
        assert!(scan(&mut folder, directory.path()).is_some(), "so is another number of episodes");
        finish(&make(directory.path(), "b"), 3);
        assert_eq!(scan(&mut folder, directory.path()), Some(vec![named("a", 7), named("b", 3)]));
        std::fs::remove_dir_all(directory.path().join("a")).unwrap();
        assert_eq!(scan(&mut folder, directory.path()), Some(vec![named("b", 3)]));
        let elsewhere = tempfile::tempdir().unwrap();
        assert_eq!(scan(&mut folder, elsewhere.path()), Some(Vec::new()));
    }

    #[test]
    fn the_epsilon_of_a_run_is_the_one_that_was_set_last() {
        let directory = tempfile::tempdir().unwrap();
        let run = make(directory.path(), "a");
        finish(&run, 1);
        let read = || read_run(run.path()).unwrap().unwrap().with_whole_log();
        let configured = read();
        assert_eq!(configured.config.epsilon, run.config::<RunConfig>().unwrap().epsilon);
        let mut writer = RunWriter::open(&run, 0).unwrap();
        for schedule in ["0.3", "0.125"] {
            writer.record(&Event::ScheduleChanged { episode: 1, schedule: schedule.into() }).unwrap();
        }
        assert_eq!(read().config.epsilon.to_string(), "0.125");
        assert!(read().label.contains("epsilon 0.125") && !configured.label.contains("0.125"), "{}", read().label);
    }

    #[test]
    fn a_run_that_another_process_prepares_says_so() {
        let directory = tempfile::tempdir().unwrap();
        let run = make(directory.path(), "run");
        let mut writer = RunWriter::open(&run, 0).unwrap();
        let is_prepared = || read_run(run.path()).unwrap().unwrap().preparing.is_some();
        writer.record(&Event::Resumed { episode: 0 }).unwrap();
        assert!(is_prepared());
        writer.record(&Event::EpisodeFinished(EpisodeRecord { episode: 1, ..EpisodeRecord::default() })).unwrap();
        assert!(!is_prepared());
    }

    #[test]
    fn the_death_of_the_process_that_trains_a_run_is_noticed() {
        for (event, working) in
            [(Event::Resumed { episode: 1 }, RunState::Running), (Event::Paused { episode: 1 }, RunState::Paused)]
        {
            let directory = tempfile::tempdir().unwrap();
            let mut folder = Folder::default();
            let run = make(directory.path(), "run");
            let mut writer = RunWriter::open(&run, 0).unwrap();
            let record = EpisodeRecord { episode: 1, ..EpisodeRecord::default() };
            writer.record(&Event::EpisodeFinished(record)).unwrap();
            writer.record(&event).unwrap();
            assert!(scan(&mut folder, directory.path()).is_some());
            assert_eq!(folder.run(run.path()).unwrap().state, working);
            assert_eq!(scan(&mut folder, directory.path()), None, "it is still being trained");
            // The log stays as it is.
            drop(writer);
            assert!(scan(&mut folder, directory.path()).is_some(), "{working:?}");
            assert_eq!(folder.run(run.path()).unwrap().state, RunState::Interrupted);
        }
    }

    #[test]
    fn a_run_created_without_a_change_of_the_folders_time_is_found() {
        let directory = tempfile::tempdir().unwrap();
        let mut folder = Folder::default();
        let now = std::time::SystemTime::now();
        for (name, count) in [("a", 1), ("b", 2)] {
            make(directory.path(), name);
            std::fs::File::open(directory.path()).unwrap().set_modified(now).unwrap();
            assert_eq!(scan(&mut folder, directory.path()).map(|runs| runs.len()), Some(count));
        }
    }

    #[test]
    fn what_takes_long_is_read_in_parts_and_the_last_one_is_news() {
        let directory = tempfile::tempdir().unwrap();
        make(directory.path(), "a");
        for name in ["b", "c"] {
            std::fs::create_dir(directory.path().join(name)).unwrap();
        }
        let mut folder = Folder::default();
        let mut parts = || {
            folder = Folder::scan(Some(&folder), directory.path(), &[], Duration::ZERO).unwrap();
            (folder.runs().count(), folder.unread, folder.is_new)
        };
        assert_eq!([parts(), parts(), parts(), parts()], [(1, 2, true), (1, 1, true), (1, 0, true), (1, 0, false)]);
    }

    #[test]
    fn a_folder_that_cannot_be_listed_is_not_an_empty_one() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("runs");
        assert_eq!(Folder::scan(None, &path, &[], Duration::MAX).unwrap().runs().count(), 0);
        std::fs::write(&path, "").unwrap();
        let error = Folder::scan(None, &path, &[], Duration::MAX).unwrap_err().to_string();
        assert!(error.contains("runs"), "{error}");
    }

    #[test]
    fn runs_elsewhere_are_known_but_not_listed() {
        let directory = tempfile::tempdir().unwrap();
        let other = make(directory.path(), "other").path().to_owned();
        let runs = directory.path().join("runs");
        make(&runs, "a");
        let scan = |before, elsewhere: &[PathBuf]| Folder::scan(before, &runs, elsewhere, Duration::MAX).unwrap();
        let folder = scan(None, &[other.clone(), runs.join("a")]);
        assert_eq!(folder.runs().map(|run| &*run.name).collect::<Vec<_>>(), ["a"]);
        assert!(folder.run(&other).is_some());
        let of_sweep = Folder::scan(None, directory.path(), &[], Duration::MAX).unwrap();
        assert_eq!(of_sweep.runs().map(|run| &*run.name).collect::<Vec<_>>(), ["other", "a"]);
        let without = scan(Some(&folder), &[]);
        assert_eq!(scan(Some(&without), &[other]).runs().count(), 1);
    }
}
