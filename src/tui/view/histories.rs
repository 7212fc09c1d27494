//! The curves of runs that are viewed without being opened, read on a background thread: in full the
//! first time, then incrementally.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use super::Curves;
use crate::run::{Event, EventReader, Practised, RunDirectory, RunHistory};

/// Time between two reads of the same runs.
const LOOK: Duration = Duration::from_secs(1);
/// Maximum number of runs whose curves are kept.
const KEPT: usize = 300;

/// Maximum number of episodes kept per run.
const EPISODES: NonZeroUsize = NonZeroUsize::new(2048).unwrap();

/// The data of a run that is drawn.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// Its curves, thinned evenly if there are many episodes.
    pub curves: Arc<Curves>,
    /// Greedy evaluations: episodes finished by then, share of successes.
    pub evaluations: Vec<(u64, f32)>,
    /// Interventions by people and other processes.
    pub interventions: Vec<Event>,
    /// Results of the practice before its first episode.
    pub practised: Option<Practised>,
}

/// The histories of viewed runs, as far as they have been read.
pub struct Histories {
    known: HashMap<PathBuf, History>,
    wanted: Vec<PathBuf>,
    looked: Option<Instant>,
    /// Sends the runs to read; None if the thread could not be started.
    requests: Option<Sender<Vec<PathBuf>>>,
    reports: Receiver<(PathBuf, History)>,
}

impl Histories {
    /// An empty set of histories and its reader thread.
    pub fn new() -> Self {
        let (requests, wanted) = channel();
        let (sender, reports) = channel();
        let work = move || Reader::default().work(&wanted, &sender);
        let thread = std::thread::Builder::new().name("mge-histories".to_owned()).spawn(work);
        Self {
            known: HashMap::new(),
            wanted: Vec::new(),
            looked: None,
            requests: thread.is_ok().then_some(requests),
            reports,
        }
    }

    /// Requests the histories of the runs now in view.
    pub fn want(&mut self, mut runs: Vec<PathBuf>) {
        runs.truncate(KEPT);
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= LOOK);
        if runs == self.wanted && !is_due {
            return;
        }
        self.looked = Some(Instant::now());
        if let Some(requests) = self.requests.as_ref().filter(|_| !runs.is_empty()) {
            // Sending fails only if the thread has ended; then nothing more is read.
            let _ = requests.send(runs.clone());
        }
        self.wanted = runs;
    }

    /// Takes over the histories that were read. True if there are any.
    pub fn collect(&mut self) -> bool {
        let before = self.known.len();
        let mut news = false;
        for (path, history) in self.reports.try_iter() {
            self.known.insert(path, history);
            news = true;
        }
        if self.known.len() > KEPT && self.known.len() > before {
            let wanted = &self.wanted;
            self.known.retain(|path, _| wanted.contains(path));
        }
        news
    }

    /// The history of the run in a folder, as far as it has been read.
    pub fn of(&self, run: &Path) -> Option<&History> {
        self.known.get(run)
    }
}

/// A run whose log is read incrementally.
struct Followed {
    reader: EventReader,
    history: RunHistory,
    curves: Arc<Curves>,
}

/// Reads logs on the background thread.
#[derive(Default)]
struct Reader {
    followed: HashMap<PathBuf, Followed>,
}

impl Reader {
    fn work(mut self, wanted: &Receiver<Vec<PathBuf>>, reports: &Sender<(PathBuf, History)>) {
        while let Ok(mut runs) = wanted.recv() {
            // Only the latest of several pending requests counts.
            while let Ok(later) = wanted.try_recv() {
                runs = later;
            }
            if self.followed.len() > KEPT {
                self.followed.retain(|path, _| runs.contains(path));
            }
            for path in runs {
                if self.read(&path).is_some_and(|history| reports.send((path, history)).is_err()) {
                    return;
                }
            }
        }
    }

    /// The history of a run, if it has changed since it was last read.
    fn read(&mut self, path: &Path) -> Option<History> {
        if !self.followed.contains_key(path) {
            let reader = RunDirectory::open(path).ok()?.events();
            let history = RunHistory::bounded(EPISODES);
            self.followed.insert(path.to_owned(), Followed { reader, history, curves: Arc::default() });
        }
        let Followed { reader, history, curves } = self.followed.get_mut(path)?;
        // A run that cannot be read has no curves; the list of runs shows the error.
        let mut is_new = false;
        loop {
            let news = reader.poll().ok()?;
            is_new |= news.restarted || !news.events.is_empty();
            if news.restarted {
                *history = RunHistory::bounded(EPISODES);
            }
            news.events.iter().for_each(|logged| history.note(&logged.event));
            if !news.more {
                break;
            }
        }
        if !is_new {
            return None;
        }
        Arc::make_mut(curves).follow(&history.records);
        let evaluations = history.evaluations.iter().map(|e| (e.episode, e.success as f32)).collect();
        let RunHistory { interventions, practised, .. } = history;
        let (interventions, practised) = (interventions.clone(), practised.clone());
        Some(History { curves: curves.clone(), evaluations, interventions, practised })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{EpisodeRecord, Event, Metric, RunWriter};
    use crate::trainer::RunConfig;

    #[test]
    fn a_log_is_read_in_full_once_and_then_incrementally() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
        let run = RunDirectory::create(folder.path().join("a"), &config).unwrap();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        let mut finish = |episode| {
            let record = EpisodeRecord { episode, return_: episode as f32, ..EpisodeRecord::default() };
            writer.record(&Event::EpisodeFinished(record)).unwrap();
        };
        let mut reader = Reader::default();
        let mut returns = || Some(reader.read(run.path())?.curves.get(Metric::Return).to_vec());
        finish(1);
        finish(2);
        assert_eq!(returns(), Some(vec![1.0, 2.0]));
        assert_eq!(returns(), None);
        finish(3);
        assert_eq!(returns(), Some(vec![1.0, 2.0, 3.0]));
        assert!(reader.read(&folder.path().join("nothing")).is_none());
        let mut histories = Histories::new();
        // A different request is sent without delay.
        histories.want(vec![folder.path().join("nothing")]);
        histories.want(vec![run.path().to_owned()]);
        while !histories.collect() {
            std::thread::yield_now();
        }
        assert_eq!(histories.of(run.path()).unwrap().curves.last_episode(), 3);
    }
}
