//! The curves of runs that are viewed without being opened, read in the background: in full the first time, then
//! incrementally.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::Curves;
use crate::Loader;
use crate::run_log::RunLog;
use mge_base::sync::lock;
use mge_run::{RunDirectory, RunHistory};

/// Time between two reads of the same runs.
const REFRESH: Duration = Duration::from_secs(1);
/// Maximum time of one read; what is left is read by the next one.
const SLICE: Duration = Duration::from_millis(200);
/// Maximum number of runs whose curves are kept.
const MAX_KEPT: usize = 300;
/// Maximum number of episodes kept per run.
const EPISODES: NonZeroUsize = NonZeroUsize::new(2048).unwrap();

/// What is known of a run from its log.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// The log, thinned evenly if there are many episodes.
    pub log: Arc<RunHistory>,
    /// Its curves.
    pub curves: Arc<Curves>,
}

/// The histories of viewed runs, as far as they have been read.
#[derive(Debug, Default)]
pub struct Histories {
    wanted: Vec<PathBuf>,
    logs: Arc<Mutex<Logs>>,
    loader: Loader<Vec<PathBuf>, Snapshot>,
}

/// What is known of the viewed runs after a read.
#[derive(Debug)]
struct Snapshot {
    histories: HashMap<PathBuf, History>,
    /// Something was new in this read.
    is_new: bool,
    /// Some runs are still to be read.
    more: bool,
}

impl Histories {
    /// Requests the histories of the runs now in view.
    pub fn request(&mut self, mut runs: Vec<PathBuf>) {
        runs.truncate(MAX_KEPT);
        self.wanted = runs;
    }

    /// Takes over what was read, and reads on. True if something is new.
    pub fn poll(&mut self) -> bool {
        let is_new = self.loader.poll() && self.latest().is_some_and(|latest| latest.is_new);
        if !self.wanted.is_empty() {
            let age = if self.latest().is_some_and(|latest| latest.more) { Duration::ZERO } else { REFRESH };
            let (wanted, logs) = (self.wanted.clone(), self.logs.clone());
            self.loader.request(wanted.clone(), age, move |_| Ok(lock(&logs).read(&wanted, SLICE)));
        }
        is_new
    }

    fn latest(&self) -> Option<&Snapshot> {
        self.loader.latest(|_| true)?.1.as_ref().ok()
    }

    /// The history of the run in a folder, as far as it has been read.
    pub fn of(&self, run: &Path) -> Option<&History> {
        self.latest()?.histories.get(run)
    }
}

/// The logs that are read incrementally, with what is known from each.
#[derive(Debug, Default)]
struct Logs(HashMap<PathBuf, (RunLog, History)>);

impl Logs {
    /// Reads what is new in the logs of these runs, for about `slice`.
    fn read(&mut self, runs: &[PathBuf], slice: Duration) -> Snapshot {
        if self.0.len() > MAX_KEPT {
            self.0.retain(|path, _| runs.contains(path));
        }
        let (begun, mut is_new) = (Instant::now(), false);
        let mut left = runs.iter();
        for run in left.by_ref() {
            // A run that cannot be read has no curves; the list of runs shows the error.
            is_new |= self.read_one(run) == Some(true);
            if begun.elapsed() >= slice {
                break;
            }
        }
        let histories = self.0.iter().map(|(path, (_, history))| (path.clone(), history.clone())).collect();
        Snapshot { histories, is_new, more: left.next().is_some() }
    }

    /// Reads the log of a run to its end. Some(true) if there was something new, None if it cannot be read.
    fn read_one(&mut self, path: &Path) -> Option<bool> {
        if !self.0.contains_key(path) {
            let log = RunLog::new(&RunDirectory::open(path).ok()?, EPISODES);
            self.0.insert(path.to_owned(), (log, History::default()));
        }
        let (log, history) = self.0.get_mut(path)?;
        let mut is_new = false;
        loop {
            let news = log.read().ok()?;
            is_new |= news.restarted || !news.events.is_empty();
            if !news.more {
                break;
            }
        }
        if is_new {
            let curves = Curves::of(&log.history.records, &log.history.times);
            *history = History { log: Arc::new(log.history.clone()), curves: Arc::new(curves) };
        }
        Some(is_new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::{EpisodeRecord, Event, Metric, RunWriter};
    use mge_trainer::RunConfig;

    fn make(path: PathBuf) -> (RunDirectory, RunWriter) {
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let run = RunDirectory::create(path, &config).unwrap();
        let writer = RunWriter::open(&run, 0).unwrap();
        (run, writer)
    }

    fn finish(writer: &mut RunWriter, episode: u64) {
        let record = EpisodeRecord { episode, return_: episode as f32, ..EpisodeRecord::default() };
        writer.record(&Event::EpisodeFinished(record)).unwrap();
    }

    #[test]
    fn a_log_is_read_in_full_once_and_then_incrementally() {
        let folder = tempfile::tempdir().unwrap();
        let (run, mut writer) = make(folder.path().join("a"));
        let runs = [folder.path().join("nothing"), run.path().to_owned()];
        let mut logs = Logs::default();
        let mut returns = || {
            let Snapshot { histories, is_new, more } = logs.read(&runs, SLICE);
            assert!(!more && !histories.contains_key(&runs[0]));
            (histories[&runs[1]].curves.get(Metric::Return).to_vec(), is_new)
        };
        finish(&mut writer, 1);
        finish(&mut writer, 2);
        assert_eq!(returns(), (vec![1.0, 2.0], true));
        assert_eq!(returns(), (vec![1.0, 2.0], false));
        finish(&mut writer, 3);
        assert_eq!(returns(), (vec![1.0, 2.0, 3.0], true));
    }

    #[test]
    fn what_takes_long_is_read_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let runs = ["a", "b", "c"].map(|name| {
            let (run, mut writer) = make(folder.path().join(name));
            finish(&mut writer, 1);
            run.path().to_owned()
        });
        let mut logs = Logs::default();
        let first = logs.read(&runs, Duration::ZERO);
        assert!(first.more && first.is_new && first.histories.len() == 1);
        assert!(!logs.read(&runs, SLICE).more);
        let mut histories = Histories::default();
        histories.request(runs.to_vec());
        let since = Instant::now();
        while runs.iter().any(|run| histories.of(run).is_none()) {
            assert!(since.elapsed() < Duration::from_secs(20));
            histories.poll();
            std::thread::yield_now();
        }
    }

    #[test]
    fn runs_out_of_view_are_dropped_if_there_are_many() {
        let folder = tempfile::tempdir().unwrap();
        let (run, mut writer) = make(folder.path().join("run"));
        finish(&mut writer, 1);
        let copy = |number: usize| {
            let path = folder.path().join(number.to_string());
            std::fs::create_dir(&path).unwrap();
            for file in ["config.json", "events.jsonl"] {
                std::fs::copy(run.path().join(file), path.join(file)).unwrap();
            }
            path
        };
        let runs: Vec<PathBuf> = (0..=MAX_KEPT).map(copy).collect();
        let (many, last) = runs.split_at(MAX_KEPT);
        let mut logs = Logs::default();
        for viewed in [many, last, many] {
            let found = logs.read(viewed, Duration::MAX);
            assert!(viewed.iter().all(|run| found.histories.contains_key(run)));
        }
        assert_eq!(logs.0.len(), MAX_KEPT, "the run out of view is one too many");
    }
}
