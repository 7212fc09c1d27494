//! The runner of a batch: threads, progress, failures, interruption.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use educe::Educe;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{Control, Watch, panic_message};
use mge_base::stop::Stop;
use mge_base::sync::lock;

/// Longest time between two progress reports, and the pause before retrying a job that another process is working on.
const REPORT_EVERY: Duration = Duration::from_millis(200);

/// An independent piece of work.
pub struct Job<'a, T, E> {
    /// Its name in messages.
    pub name: String,
    /// Its amount of work, in a unit common to all jobs of the batch, such as episodes.
    pub size: u64,
    work: Box<Work<'a, T, E>>,
}

type Work<'a, T, E> = dyn Fn(&JobHandle) -> Result<Option<T>, E> + Send + Sync + 'a;

impl<'a, T, E> Job<'a, T, E> {
    /// A job that runs `work`, which may be called again after [`JobError::is_in_use`]. `work` returns None, or
    /// [`JobError::is_stopped`], if it stopped early because of [`JobHandle::is_stopped`].
    pub fn new(
        name: impl Into<String>,
        size: u64,
        work: impl Fn(&JobHandle) -> Result<Option<T>, E> + Send + Sync + 'a,
    ) -> Self {
        Self { name: name.into(), size, work: Box::new(work) }
    }
}

/// An error of a job.
pub trait JobError: std::error::Error + Send {
    /// Whether the error means that another process is working on the job.
    fn is_in_use(&self) -> bool {
        false
    }

    /// Whether the error means that the work noticed a stop request.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// The result of a job.
pub type Outcome<T, E> = Result<T, JobFailure<E>>;

/// Why a job has no result.
#[derive(Debug, thiserror::Error)]
pub enum JobFailure<E: JobError> {
    /// Its error.
    #[error(transparent)]
    Error(E),
    /// A bug in the program.
    #[error("it panicked: {0}")]
    Panic(String),
    /// The batch was interrupted before the job's end.
    #[error("it was interrupted")]
    Interrupted,
}

/// A batch cannot be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start a thread: {0}: raise the limit on processes (`ulimit -u`) or end other programs")]
pub struct BatchError(String);

/// The progress of a batch.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BatchProgress<'a> {
    /// Work done, in the unit of [`Job::size`](Job).
    pub done: u64,
    /// Total work.
    pub total: u64,
    /// Jobs that have ended.
    pub ended: usize,
    /// Ended jobs that failed.
    pub failed: usize,
    /// Total number of jobs.
    pub jobs: usize,
    /// The latest message of any job; empty if there is none.
    pub message: &'a str,
    /// Name of a job that has just failed, and the reason.
    pub failure: Option<(&'a str, &'a str)>,
}

/// Connects a running job to its batch: it reports progress and receives the stop request.
#[derive(Debug, Educe)]
#[educe(Default)]
pub struct JobHandle {
    done: AtomicU64,
    message: Mutex<Option<String>>,
    /// The view of the job's training; its episodes count as work done.
    pub watch: Watch,
    #[educe(Default = unbounded())]
    pub(super) controls: (Sender<Control>, Receiver<Control>),
}

impl JobHandle {
    /// Sets how much of the job is done, of its [`Job::size`](Job).
    pub fn set_done(&self, done: u64) {
        self.done.store(done, Ordering::Release);
    }

    /// Reports what the job is doing.
    pub fn report(&self, message: String) {
        *lock(&self.message) = Some(message);
    }

    /// Whether the job should save its state and return.
    pub fn is_stopped(&self) -> bool {
        self.stop().is_requested()
    }

    /// The stop request behind [`is_stopped`](Self::is_stopped), for code that polls it directly.
    pub fn stop(&self) -> &Stop {
        &self.watch.stop
    }

    fn ask_to_stop(&self) {
        if !self.is_stopped() {
            // The receiver lives as long as the handle.
            let _ = self.controls.0.send(Control::Stop { reason: "interrupted".to_owned() });
            self.watch.stop.request();
        }
    }

    /// How much of the job is done.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Acquire).max(self.watch.episode())
    }
}

/// Settings of a batch.
pub struct Batch<'a> {
    /// Number of jobs that run at the same time. Each has its own thread pool: parallel jobs use cores better than
    /// one job on several cores. If there are more threads than jobs, the jobs share them equally.
    pub threads: usize,
    /// Interrupts the batch.
    pub interrupt: &'a Stop,
    /// Called with the progress, on the thread that runs the batch.
    pub on_progress: &'a mut dyn FnMut(&BatchProgress<'_>),
}

impl Batch<'_> {
    /// Runs all jobs and returns their outcomes in the order of the jobs. If the system cannot start all the threads
    /// asked for, runs on fewer.
    ///
    /// # Errors
    /// When no thread can be started; then no job has run.
    pub fn run<T: Send, E: JobError>(&mut self, jobs: &[Job<'_, T, E>]) -> Result<Vec<Outcome<T, E>>, BatchError> {
        let interrupt = self.interrupt;
        let workers = self.threads.clamp(1, jobs.len().max(1));
        let share = (self.threads / workers).max(1);
        let state =
            State { jobs, handles: jobs.iter().map(|_| JobHandle::default()).collect(), queue: Queue::default() };
        let (sender, ended) = unbounded();
        thread::scope(|scope| {
            for started in 0..workers {
                let (state, sender) = (&state, sender.clone());
                let spawned = pool(share).or_else(|_| pool(1)).and_then(|pool| {
                    let work = move || state.work(interrupt, &pool, &sender);
                    let thread = thread::Builder::new().name("mge-worker".to_owned()).spawn_scoped(scope, work);
                    thread.map_err(|error| error.to_string())
                });
                match spawned {
                    Err(reason) if started == 0 => return Err(BatchError(reason)),
                    Err(_) => break,
                    Ok(_) => {}
                }
            }
            drop(sender);
            Ok(self.collect(&state, &ended))
        })
    }

    /// Collects outcomes and reports progress on the calling thread until all jobs have ended.
    fn collect<T: Send, E: JobError>(
        &mut self,
        state: &State<'_, T, E>,
        ended: &Receiver<(usize, Outcome<T, E>)>,
    ) -> Vec<Outcome<T, E>> {
        let mut outcomes: Vec<Option<Outcome<T, E>>> = state.jobs.iter().map(|_| None).collect();
        let (mut count, mut failed, mut message) = (0, 0, String::new());
        loop {
            let mut failure = None;
            match ended.recv_timeout(REPORT_EVERY) {
                Ok((index, outcome)) => {
                    if let Err(JobFailure::Error(_) | JobFailure::Panic(_)) = &outcome {
                        failed += 1;
                        failure =
                            outcome.as_ref().err().map(|error| (state.jobs[index].name.clone(), error.to_string()));
                    }
                    count += 1;
                    outcomes[index] = Some(outcome);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if self.interrupt.is_requested() {
                state.handles.iter().for_each(JobHandle::ask_to_stop);
            }
            if let Some(latest) = state.handles.iter().rev().find_map(|handle| lock(&handle.message).take()) {
                message = latest;
            }
            (self.on_progress)(&BatchProgress {
                done: state.handles.iter().map(JobHandle::done).sum(),
                total: state.jobs.iter().map(|job| job.size).sum(),
                ended: count,
                failed,
                jobs: state.jobs.len(),
                message: &message,
                failure: failure.as_ref().map(|(name, reason)| (name.as_str(), reason.as_str())),
            });
        }
        outcomes.into_iter().map(|outcome| outcome.unwrap_or(Err(JobFailure::Interrupted))).collect()
    }
}

fn pool(threads: usize) -> Result<ThreadPool, String> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())
}

/// The jobs still to be run.
#[derive(Debug, Default)]
struct Queue {
    /// The next job not yet tried.
    next: AtomicUsize,
    /// Jobs deferred because another process was working on them.
    deferred: Mutex<VecDeque<usize>>,
}

struct State<'a, T, E> {
    jobs: &'a [Job<'a, T, E>],
    handles: Vec<JobHandle>,
    queue: Queue,
}

impl<T: Send, E: JobError> State<'_, T, E> {
    /// Works on jobs until none is left.
    fn work(&self, interrupt: &Stop, pool: &ThreadPool, ended: &Sender<(usize, Outcome<T, E>)>) {
        while !interrupt.is_requested() {
            let Some(index) = self.next() else { return };
            let outcome = pool.install(|| self.attempt(index));
            if let Err(JobFailure::Error(error)) = &outcome
                && error.is_in_use()
            {
                lock(&self.queue.deferred).push_back(index);
                continue;
            }
            if !matches!(outcome, Err(JobFailure::Interrupted)) {
                // Failed or already finished before: either way no work remains.
                self.handles[index].set_done(self.jobs[index].size);
            }
            // The receiver lives until all workers have ended.
            let _ = ended.send((index, outcome));
        }
    }

    /// The next job to try: first those not yet tried, then the deferred ones.
    fn next(&self) -> Option<usize> {
        let next = self.queue.next.fetch_add(1, Ordering::AcqRel);
        if next < self.jobs.len() {
            return Some(next);
        }
        let deferred = lock(&self.queue.deferred).pop_front()?;
        thread::sleep(REPORT_EVERY);
        Some(deferred)
    }

    fn attempt(&self, index: usize) -> Outcome<T, E> {
        match catch_unwind(AssertUnwindSafe(|| (self.jobs[index].work)(&self.handles[index]))) {
            Ok(Ok(Some(output))) => Ok(output),
            Ok(Ok(None)) => Err(JobFailure::Interrupted),
            Ok(Err(error)) if error.is_stopped() => Err(JobFailure::Interrupted),
            Ok(Err(error)) => Err(JobFailure::Error(error)),
            Err(panic) => Err(JobFailure::Panic(panic_message(&*panic).to_owned())),
        }
    }
}
