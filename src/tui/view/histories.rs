//! The curves of runs that are looked at without being opened, read on a thread of their own: whole the
//! first time, and then what is new.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use super::Curves;
use crate::run::{Event, EventReader, Practised, RunDirectory, RunHistory};

/// Time between two looks at the same runs.
const LOOK: Duration = Duration::from_secs(1);
/// Runs whose curves are kept at most.
const KEPT: usize = 300;

/// Episodes of each that are kept at most.
const EPISODES: NonZeroUsize = NonZeroUsize::new(2048).unwrap();

/// What is drawn of a run.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// Its curves; of many episodes, evenly spread ones.
    pub curves: Arc<Curves>,
    /// Greedy evaluations: episodes finished, share of successes.
    pub evaluations: Vec<(u64, f32)>,
    /// What people and processes did to it.
    pub interventions: Vec<Event>,
    /// What came of the practice before its first episode.
    pub practised: Option<Practised>,
}

/// The histories of the runs that are looked at, as far as they were read.
pub struct Histories {
    known: HashMap<PathBuf, History>,
    wanted: Vec<PathBuf>,
    looked: Option<Instant>,
    /// The runs to read; None if the thread could not be started.
    wishes: Option<Sender<Vec<PathBuf>>>,
    reports: Receiver<(PathBuf, History)>,
}

impl Histories {
    /// Histories of nothing yet.
    pub fn new() -> Self {
        let (wishes, wanted) = channel();
        let (sender, reports) = channel();
        let work = move || Reader::default().work(&wanted, &sender);
        let thread = std::thread::Builder::new().name("mge-histories".to_owned()).spawn(work);
        Self {
            known: HashMap::new(),
            wanted: Vec::new(),
            looked: None,
            wishes: thread.is_ok().then_some(wishes),
            reports,
        }
    }

    /// Asks for the histories of runs, which are looked at from now on.
    pub fn want(&mut self, mut runs: Vec<PathBuf>) {
        runs.truncate(KEPT);
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= LOOK);
        if runs == self.wanted && !is_due {
            return;
        }
        self.looked = Some(Instant::now());
        if let Some(wishes) = self.wishes.as_ref().filter(|_| !runs.is_empty()) {
            // Without the thread there is nobody to read.
            let _ = wishes.send(runs.clone());
        }
        self.wanted = runs;
    }

    /// Takes in what was read; true if there is something new.
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

    /// The history of the run in a folder, as far as it was read.
    pub fn of(&self, run: &Path) -> Option<&History> {
        self.known.get(run)
    }
}

/// A run whose log is read on.
struct Followed {
    reader: EventReader,
    history: RunHistory,
    curves: Arc<Curves>,
}

/// Reads logs on its thread.
#[derive(Default)]
struct Reader {
    followed: HashMap<PathBuf, Followed>,
}

impl Reader {
    fn work(mut self, wanted: &Receiver<Vec<PathBuf>>, reports: &Sender<(PathBuf, History)>) {
        while let Ok(mut runs) = wanted.recv() {
            // Several wishes that came meanwhile are one.
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

    /// The history of a run if there is more of it than before.
    fn read(&mut self, path: &Path) -> Option<History> {
        if !self.followed.contains_key(path) {
            let reader = RunDirectory::open(path).ok()?.events();
            let history = RunHistory::bounded(EPISODES);
            self.followed.insert(path.to_owned(), Followed { reader, history, curves: Arc::default() });
        }
        let Followed { reader, history, curves } = self.followed.get_mut(path)?;
        // A run that is gone, or cannot be read, has no curves; the list says what is wrong with it.
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
    fn a_log_is_read_once_and_then_what_is_new() {
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
        // Another wish is heard at once.
        histories.want(vec![folder.path().join("nothing")]);
        histories.want(vec![run.path().to_owned()]);
        while !histories.collect() {
            std::thread::yield_now();
        }
        assert_eq!(histories.of(run.path()).unwrap().curves.last_episode(), 3);
    }
}
