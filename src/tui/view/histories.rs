//! The curves of runs that are viewed without being opened, read on a background thread: in full the
//! first time, then incrementally.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use super::Curves;
use mge_run::{Event, EventReader, Practised, RunDirectory, RunHistory};

/// Time between two reads of the same runs.
const REFRESH_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum number of runs whose curves are kept.
const MAX_KEPT: usize = 300;

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
    /// The latest need for exploration of each stage.
    pub needs: Vec<f32>,
}

/// The histories of viewed runs, as far as they have been read.
pub struct Histories {
    known: HashMap<PathBuf, History>,
    wanted: Vec<PathBuf>,
    looked: Option<Instant>,
    /// Sends the runs to read.
    requests: Sender<Vec<PathBuf>>,
    /// What was read of a run; None once the reader has dropped it.
    reports: Receiver<(PathBuf, Option<History>)>,
}

impl Histories {
    /// An empty set of histories and its reader thread.
    pub fn new() -> Self {
        let (requests, wanted) = channel();
        let (sender, reports) = channel();
        let work = move || Reader::default().work(&wanted, &sender);
        // If the thread cannot be started, nothing is read.
        let _ = std::thread::Builder::new().name("mge-histories".to_owned()).spawn(work);
        Self { known: HashMap::new(), wanted: Vec::new(), looked: None, requests, reports }
    }

    /// Requests the histories of the runs now in view.
    pub fn want(&mut self, mut runs: Vec<PathBuf>) {
        runs.truncate(MAX_KEPT);
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= REFRESH_INTERVAL);
        if runs == self.wanted && !is_due {
            return;
        }
        self.looked = Some(Instant::now());
        if !runs.is_empty() {
            // Sending fails only without the thread; then nothing more is read.
            let _ = self.requests.send(runs.clone());
        }
        self.wanted = runs;
    }

    /// Takes over what was read and dropped. True if there is anything.
    pub fn collect(&mut self) -> bool {
        let mut news = false;
        for (path, history) in self.reports.try_iter() {
            match history {
                Some(history) => _ = self.known.insert(path, history),
                None => _ = self.known.remove(&path),
            }
            news = true;
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
    fn work(mut self, wanted: &Receiver<Vec<PathBuf>>, reports: &Sender<(PathBuf, Option<History>)>) {
        while let Ok(mut runs) = wanted.recv() {
            // Only the latest of several pending requests counts.
            while let Ok(later) = wanted.try_recv() {
                runs = later;
            }
            if self.followed.len() > MAX_KEPT {
                for (path, _) in self.followed.extract_if(|path, _| !runs.contains(path)) {
                    if reports.send((path, None)).is_err() {
                        return;
                    }
                }
            }
            for path in runs {
                if self.read(&path).is_some_and(|history| reports.send((path, Some(history))).is_err()) {
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
            news.events.iter().for_each(|logged| history.add(&logged.event));
            if !news.more {
                break;
            }
        }
        if !is_new {
            return None;
        }
        Arc::make_mut(curves).follow(&history.records);
        let evaluations = history.evaluations.iter().map(|e| (e.episode, e.success as f32)).collect();
        Some(History {
            curves: curves.clone(),
            evaluations,
            interventions: history.interventions.clone(),
            practised: history.practised.clone(),
            needs: history.needs.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::{EpisodeRecord, Event, Metric, RunWriter};
    use mge_trainer::RunConfig;

    #[test]
    fn a_log_is_read_in_full_once_and_then_incrementally() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
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

    #[test]
    fn the_same_runs_are_requested_again_after_a_pause() {
        let (requests, requested) = channel();
        let (_sender, reports) = channel();
        let mut histories = Histories { requests, reports, ..Histories::new() };
        let mut count = |looked: Option<Instant>| {
            histories.looked = looked;
            histories.want(vec![PathBuf::from("a")]);
            requested.try_iter().count()
        };
        assert_eq!([None, Some(Instant::now()), None].map(&mut count), [1, 0, 1]);
    }

    #[test]
    fn runs_in_view_have_their_curves_however_many_were_in_view_before() {
        fn wait(histories: &mut Histories, is_done: impl Fn(&Histories) -> bool) {
            let since = Instant::now();
            while !is_done(histories) {
                assert!(since.elapsed() < Duration::from_secs(20));
                histories.collect();
                std::thread::yield_now();
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let run = RunDirectory::create(folder.path().join("run"), &config).unwrap();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        writer.record(&Event::EpisodeFinished(EpisodeRecord { episode: 1, ..EpisodeRecord::default() })).unwrap();
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
        let mut histories = Histories::new();
        for viewed in [many, last, many] {
            histories.want(viewed.to_vec());
            wait(&mut histories, |histories| viewed.iter().all(|run| histories.of(run).is_some()));
        }
        // The run out of view is one too many.
        wait(&mut histories, |histories| histories.of(&last[0]).is_none());
    }
}
