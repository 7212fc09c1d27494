//! Background jobs: computations with progress, cancellation and a result.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::{fmt, io};

use mge_base::stop::Stop;
use mge_base::sync::lock;
use mge_trainer::panic_message;

/// The error of a computation that ended because it was cancelled.
pub(super) const CANCELLED: &str = "the computation was cancelled: the same command starts it again";

/// A computation on its own thread.
pub struct Job<T> {
    reporter: Arc<Reporter>,
    /// An error if the thread could not be spawned.
    thread: io::Result<JoinHandle<Result<T, String>>>,
}

/// How much of a computation is done; unknown while `total` is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Number of parts done.
    pub done: usize,
    /// Number of parts in total.
    pub total: usize,
}

impl Progress {
    /// The fraction done, from 0 to 1; None if unknown.
    pub fn share(self) -> Option<f32> {
        (self.total > 0).then(|| self.done as f32 / self.total as f32)
    }
}

/// The computation's side of a job.
#[derive(Debug, Default)]
pub struct Reporter {
    progress: Mutex<Progress>,
    /// The stop request, for code that polls it itself.
    pub stop: Stop,
}

impl Reporter {
    /// Reports how much is done; false if the computation should end.
    pub fn progress(&self, done: usize, total: usize) -> bool {
        *lock(&self.progress) = Progress { done, total };
        !self.stop.is_requested()
    }
}

/// Runs a computation and turns a panic into an error.
pub(super) fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(format!("the computation panicked: {}", panic_message(&*panic))))
}

impl<T> fmt::Debug for Job<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Job").field("reporter", &self.reporter).finish_non_exhaustive()
    }
}

impl<T: Send + 'static> Job<T> {
    /// Starts a job. If no thread can be spawned, that error is its result.
    pub fn spawn(work: impl FnOnce(&Reporter) -> Result<T, String> + Send + 'static) -> Self {
        let reporter: Arc<Reporter> = Arc::default();
        let own = reporter.clone();
        let body = move || caught(|| work(&own));
        Self { reporter, thread: std::thread::Builder::new().name("mge-job".to_owned()).spawn(body) }
    }

    /// How much is done.
    pub fn progress(&self) -> Progress {
        *lock(&self.reporter.progress)
    }

    /// Whether the result is available.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().map_or(true, JoinHandle::is_finished)
    }

    /// The result; blocks until it is available.
    ///
    /// # Errors
    /// The error or panic that ended the computation, or the failure to spawn its thread.
    pub fn result(self) -> Result<T, String> {
        match self.thread {
            // The computation's own panics are caught in `spawn`.
            Ok(thread) => thread.join().unwrap_or_else(|_| Err("the computation failed".to_owned())),
            Err(error) => Err(format!("cannot start a thread: {error}")),
        }
    }

    /// Requests cancellation: the computation ends when it next polls the request or reports progress.
    pub fn cancel(&self) {
        self.reporter.stop.request();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_an_error_and_a_panic_are_all_outcomes() {
        assert_eq!(Job::spawn(|_| Ok(7)).result(), Ok(7));
        assert_eq!(Job::<()>::spawn(|_| Err("no".to_owned())).result(), Err("no".to_owned()));
        let panicked = Job::<()>::spawn(|_| panic!("on purpose")).result();
        assert_eq!(panicked, Err("the computation panicked: on purpose".to_owned()));
    }

    #[test]
    fn a_cancelled_job_ends_at_its_next_report() {
        let job = Job::<()>::spawn(|reporter| {
            let mut done = 0;
            while reporter.progress(done, 9) {
                done = 1;
                std::thread::yield_now();
            }
            Err("cancelled".to_owned())
        });
        while job.progress().done != 1 {
            std::thread::yield_now();
        }
        assert!(!job.is_finished() && job.progress().share() == Some(1.0 / 9.0));
        job.cancel();
        assert_eq!(job.result(), Err("cancelled".to_owned()));
    }
}
