//! A computation in the background: its progress, its cancellation and its result.

use std::fmt;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::stop::Stop;
use crate::trainer::panic_message;

/// A computation, which has a thread of its own once it is begun.
pub(crate) struct Job<T> {
    shared: Arc<Shared>,
    /// What is to be computed, until it is begun.
    work: Option<Work<T>>,
    /// None until it is begun; the error is that the system has no more threads.
    thread: Option<io::Result<JoinHandle<Result<T, String>>>>,
}

type Work<T> = Box<dyn FnOnce(&Reporter) -> Result<T, String> + Send>;

/// What the computation and its owner share.
#[derive(Debug, Default)]
struct Shared {
    done: AtomicUsize,
    total: AtomicUsize,
    curve: Mutex<Vec<f32>>,
    cancelled: Stop,
}

/// How much of a computation is done. Nothing can be said of it as long as `total` is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Parts that are done.
    pub done: usize,
    /// All parts.
    pub total: usize,
}

impl Progress {
    /// The share that is done, from 0 to 1; None if nothing can be said.
    pub fn share(self) -> Option<f32> {
        (self.total > 0).then(|| self.done as f32 / self.total as f32)
    }
}

/// The computation's side of a job.
#[derive(Debug)]
pub(crate) struct Reporter(Arc<Shared>);

impl Reporter {
    /// Reports how much is done; false if the computation is to end.
    pub fn progress(&self, done: usize, total: usize) -> bool {
        self.0.done.store(done, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
        !self.is_cancelled()
    }

    /// Reports the next value of what the computation makes smaller, such as a loss.
    pub fn note(&self, value: f32) {
        self.0.curve.lock().unwrap_or_else(PoisonError::into_inner).push(value);
    }

    /// Whether the computation is to end.
    pub fn is_cancelled(&self) -> bool {
        self.stop().is_requested()
    }

    /// The request to end, for those who look at it themselves.
    pub fn stop(&self) -> &Stop {
        &self.0.cancelled
    }
}

/// The result of a computation, its panic in words.
pub(super) fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(format!("the computation panicked: {}", panic_message(&*panic))))
}

impl<T> fmt::Debug for Job<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Job").field("shared", &self.shared).finish_non_exhaustive()
    }
}

impl<T: Send + 'static> Job<T> {
    /// A computation that is yet to [begin](Self::begin).
    pub fn new(work: impl FnOnce(&Reporter) -> Result<T, String> + Send + 'static) -> Self {
        Self { shared: Arc::default(), work: Some(Box::new(work)), thread: None }
    }

    /// Begins a computation.
    ///
    /// # Errors
    /// When the system has no more threads.
    pub fn spawn(work: impl FnOnce(&Reporter) -> Result<T, String> + Send + 'static) -> io::Result<Self> {
        let mut job = Self::new(work);
        job.begin();
        match job.thread {
            Some(Err(error)) => Err(error),
            thread => Ok(Self { thread, ..job }),
        }
    }

    /// Begins it, unless it was begun. If the system has no more threads, that is its result.
    pub fn begin(&mut self) {
        if let Some(work) = self.work.take() {
            let reporter = Reporter(self.shared.clone());
            let body = move || caught(|| work(&reporter));
            self.thread = Some(std::thread::Builder::new().name("mge-job".to_owned()).spawn(body));
        }
    }

    /// Whether it was begun.
    pub fn is_begun(&self) -> bool {
        self.work.is_none()
    }

    /// How much of it is done.
    pub fn progress(&self) -> Progress {
        let [done, total] = [&self.shared.done, &self.shared.total].map(|count| count.load(Ordering::Relaxed));
        Progress { done, total }
    }

    /// The values that it has reported from the one of this number on.
    pub fn values(&self, from: usize) -> Vec<f32> {
        let values = self.shared.curve.lock().unwrap_or_else(PoisonError::into_inner);
        values.get(from..).unwrap_or_default().to_vec()
    }

    /// Whether the result is there.
    pub fn is_finished(&self) -> bool {
        match &self.thread {
            Some(Ok(thread)) => thread.is_finished(),
            Some(Err(_)) => true,
            None => false,
        }
    }

    /// The result; waits for it if it is not there yet. One that was not begun has none.
    ///
    /// # Errors
    /// The error, or the panic, that ended the computation, or that the system has no more threads.
    pub fn result(self) -> Result<T, String> {
        match self.thread {
            // A panic of the computation is a result.
            Some(Ok(thread)) => thread.join().unwrap_or_else(|_| Err("the computation failed".to_owned())),
            Some(Err(error)) => Err(format!("the system gives no further thread: {error}")),
            None => Err("the computation was not begun".to_owned()),
        }
    }

    /// Cancels it: it ends when it next looks or reports its progress.
    pub fn cancel(&self) {
        self.shared.cancelled.request();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_an_error_and_a_panic_are_all_outcomes() {
        assert_eq!(Job::spawn(|_| Ok(7)).unwrap().result(), Ok(7));
        assert_eq!(Job::<()>::spawn(|_| Err("no".to_owned())).unwrap().result(), Err("no".to_owned()));
        let panicked = Job::<()>::spawn(|_| panic!("on purpose")).unwrap().result();
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
        let job = job.unwrap();
        while job.progress().done != 1 {
            std::thread::yield_now();
        }
        assert!(!job.is_finished() && job.progress().share() == Some(1.0 / 9.0));
        job.cancel();
        assert_eq!(job.result(), Err("cancelled".to_owned()));
    }
}
