//! The log of a run, read at once or in the background.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mge_guidance::ActionPrior;
use mge_run::{EventReader, Poll, RunDirectory, RunHistory};
use mge_task::Task;
use mge_trainer::{RunConfig, saved_prior};

use super::job::Job;

/// Maximum number of episodes, and of evaluations, kept of a run; those of longer runs are thinned evenly.
pub const MAX_KEPT: NonZeroUsize = NonZeroUsize::new(16_384).unwrap();
/// Time between two reads in the background of the log of a run in training, and of any other.
const READ_EVERY: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(1)];

/// The log of a run as far as it has been read.
#[derive(Debug)]
pub struct RunLog {
    run: RunDirectory,
    reader: EventReader,
    /// What its events say.
    pub history: RunHistory,
    most: NonZeroUsize,
    /// Time of the latest event.
    pub latest: f64,
    /// The part that is read in the background.
    pub reading: Option<Job<Part>>,
    /// When the latest read in the background began.
    read_at: Instant,
}

/// A part of a log, and what another process may have changed in the folder of the run until it was read.
#[derive(Debug)]
pub struct Part {
    /// The part, or why it cannot be read.
    pub news: Result<Poll, String>,
    /// The reader after it.
    reader: EventReader,
    /// The training had ended before it was read.
    pub has_ended: bool,
    /// The name of the run.
    pub name: String,
    /// Its configuration, unless that cannot be read.
    pub config: Option<RunConfig>,
}

impl RunLog {
    /// The log in a folder, of which nothing has been read; `most` episodes of it are kept, and as many evaluations.
    pub fn new(directory: &RunDirectory, most: NonZeroUsize) -> Self {
        Self {
            run: directory.clone(),
            reader: directory.events(),
            history: RunHistory::bounded(most),
            most,
            latest: f64::NEG_INFINITY,
            reading: None,
            read_at: Instant::now(),
        }
    }

    /// Reads the next part, however long that takes.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn read(&mut self) -> Result<Poll, String> {
        // What is being read in the background is then out of date.
        self.reading = None;
        let news = self.reader.poll().map_err(|error| error.to_string())?;
        self.follow(&news);
        Ok(news)
    }

    /// The part that was read in the background, if there is one. Begins to read the next part if it is time to: often if
    /// the run `is_active`, and at once if its training `has_ended`.
    pub fn poll(&mut self, is_active: bool, has_ended: bool) -> Option<Part> {
        let finished = self.reading.take_if(|job| job.is_finished());
        let found = finished.and_then(|job| job.result().ok());
        if let Some(Part { news, reader, .. }) = &found {
            self.reader = reader.clone();
            if let Ok(news) = news {
                self.follow(news);
            }
        }
        let more = matches!(&found, Some(Part { news: Ok(news), .. }) if news.more);
        let is_last = !more && matches!(&found, Some(Part { has_ended: true, .. }));
        let is_due = more || (has_ended && !is_last) || self.read_at.elapsed() >= READ_EVERY[usize::from(!is_active)];
        if is_due && self.reading.is_none() {
            let (mut reader, run) = (self.reader.clone(), self.run.clone());
            self.read_at = Instant::now();
            self.reading = Some(Job::spawn(move |_| {
                let news = reader.poll().map_err(|error| error.to_string());
                Ok(Part { news, reader, has_ended, name: run.name(), config: RunConfig::of(&run).ok() })
            }));
        }
        found
    }

    fn follow(&mut self, news: &Poll) {
        if news.restarted {
            self.history = RunHistory::bounded(self.most);
        }
        news.events.iter().for_each(|logged| self.history.add(logged.time, &logged.event));
    }
}

/// The saved prior of a run on a task, if it has one.
///
/// # Errors
/// Why it cannot be used.
pub fn read_prior(directory: &RunDirectory, task: &Task) -> Result<Option<Arc<ActionPrior>>, String> {
    let prior = saved_prior(directory, task).map_err(|error| error.to_string())?;
    Ok(prior.map(Arc::new))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use mge_run::{EpisodeRecord, Event, RunWriter};

    fn make(folder: &Path) -> RunDirectory {
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        RunDirectory::create(folder.join("run"), &config).unwrap()
    }

    /// Begins a read that is due.
    fn poll(log: &mut RunLog) -> Option<Poll> {
        log.read_at -= Duration::from_secs(1);
        log.poll(false, false).map(|part| part.news.unwrap())
    }

    #[test]
    fn a_log_read_in_the_background_has_the_same_events() {
        let folder = tempfile::tempdir().unwrap();
        let directory = make(folder.path());
        let mut writer = RunWriter::open(&directory, 0).unwrap();
        let mut finish = |episode| {
            writer.record(&Event::EpisodeFinished(EpisodeRecord { episode, ..EpisodeRecord::default() })).unwrap();
        };
        let [mut waiting, mut other] = [(); 2].map(|()| RunLog::new(&directory, MAX_KEPT));
        for episodes in [1..=3, 4..=9] {
            episodes.for_each(&mut finish);
            let expected = waiting.read().unwrap().events;
            let mut events = Vec::new();
            while events.len() < expected.len() {
                events.extend(poll(&mut other).into_iter().flat_map(|news| news.events));
                std::thread::yield_now();
            }
            assert_eq!(events, expected);
            assert_eq!(other.history.records.len(), waiting.history.records.len());
        }
        // What was begun before a read is out of date after it.
        poll(&mut other);
        finish(10);
        assert_eq!(other.read().unwrap().events.len(), 1);
        assert!(other.reading.is_none() && other.poll(false, false).is_none());
        assert_eq!(other.history.records.len(), 10);
    }

    #[test]
    #[cfg(unix)]
    fn a_log_that_cannot_be_read_now_holds_up_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let directory = make(folder.path());
        // To open a pipe takes until there is a writer.
        let path = directory.path().join("events.jsonl");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let mut log = RunLog::new(&directory, MAX_KEPT);
        let since = Instant::now();
        for _ in 0..1000 {
            log.read_at -= Duration::from_secs(1);
            log.poll(true, true);
        }
        assert!(since.elapsed() < Duration::from_secs(5) && log.history.records.is_empty());
    }
}
