//! The contents of the selected run's folder, read in the background.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use mge_run::RunDirectory;
use mge_workbench::Job;

/// Maximum number of log lines shown.
const LINES: usize = 60;
/// Time between two reads of the same run.
const REFRESH_INTERVAL: Duration = Duration::from_secs(2);

/// The contents of a run's folder.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDetails {
    /// The folder.
    pub path: PathBuf,
    /// Names of files and folders, with the sizes of files in bytes.
    pub files: Vec<(String, Option<u64>)>,
    /// The last lines of its log, or the reason why they cannot be read.
    pub log: Vec<String>,
}

impl RunDetails {
    fn read(path: &Path) -> Self {
        let directory = RunDirectory::open(path);
        let files = directory.as_ref().ok().and_then(|directory| directory.contents().ok()).unwrap_or_default();
        let log = directory.and_then(|directory| directory.log_tail(LINES));
        Self { path: path.to_owned(), files, log: log.unwrap_or_else(|error| vec![error.to_string()]) }
    }
}

/// Reads the details of the selected run.
#[derive(Default)]
pub struct Details {
    known: Option<Arc<RunDetails>>,
    looked: Option<Instant>,
    reading: Option<Job<RunDetails>>,
}

impl Details {
    /// Requests the details of the run in a folder.
    pub fn want(&mut self, run: &Path) {
        let is_known = self.known.as_ref().is_some_and(|known| known.path == run);
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= REFRESH_INTERVAL);
        if self.reading.is_some() || (is_known && !is_due) {
            return;
        }
        self.looked = Some(Instant::now());
        let path = run.to_owned();
        // If no thread can be started, a later request tries again.
        self.reading = Job::spawn(move |_| Ok(RunDetails::read(&path))).ok();
    }

    /// The latest details.
    pub fn known(&self) -> Option<&Arc<RunDetails>> {
        self.known.as_ref()
    }

    /// Takes over finished details. True if they are new.
    pub fn collect(&mut self) -> bool {
        let Some(read) = self.reading.take_if(|job| job.is_finished()).and_then(|job| job.result().ok()) else {
            return false;
        };
        let is_new = self.known.as_deref() != Some(&read);
        self.known = Some(Arc::new(read));
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_run_is_read_without_delay() {
        let mut details = Details::default();
        for run in ["nowhere/a", "nowhere/b"] {
            details.want(Path::new(run));
            while details.reading.as_ref().is_some_and(|job| !job.is_finished()) {
                std::thread::yield_now();
            }
            assert!(details.collect(), "{run} is new");
            assert!(details.known().unwrap().path.ends_with(run) && !details.known().unwrap().log.is_empty());
        }
        for (looked, is_read) in [(Some(Instant::now()), false), (None, true)] {
            details.looked = looked;
            details.want(Path::new("nowhere/b"));
            assert_eq!(details.reading.is_some(), is_read, "the same run is read after a pause");
        }
    }
}
