//! The runner of a batch: threads, progress, failures, interruption.

use std::collections::VecDeque;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::stop::Stop;
use crate::trainer::{Control, Watch, panic_message};

/// Longest time between two reports of progress, and between two tries of a job that another
/// process works on.
const REPORT_EVERY: Duration = Duration::from_millis(200);

/// One piece of work that depends on no other.
pub struct Job<'a, T, E> {
    /// Its name in messages.
    pub name: String,
    /// How much work it is, in a unit that all jobs of the batch have in common, such as episodes.
    pub size: u64,
    work: Box<Work<'a, T, E>>,
}

type Work<'a, T, E> = dyn Fn(&JobHandle) -> Result<Option<T>, E> + Send + Sync + 'a;

impl<'a, T, E> Job<'a, T, E> {
    /// A job that does `work`, which may be called again after [`JobError::is_in_use`]. It gives None if
    /// it stopped early because [`JobHandle::is_stopped`].
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
    /// Whether it means that another process works on the job.
    fn is_in_use(&self) -> bool;
}

/// What became of a job.
pub type Outcome<T, E> = Result<T, JobFailure<E>>;

/// Why a job has no result.
#[derive(Debug, thiserror::Error)]
pub enum JobFailure<E: JobError> {
    /// Its error.
    #[error(transparent)]
    Error(E),
    /// A mistake of the program.
    #[error("it panicked: {0}")]
    Panic(String),
    /// The batch was interrupted before the job's end.
    #[error("it was interrupted")]
    Interrupted,
}

/// A batch cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// The system has no thread left.
    #[error("cannot start a thread: {0}: raise the limit on processes (`ulimit -u`) or end other programs")]
    Threads(String),
}

/// How far a batch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BatchProgress<'a> {
    /// Work done, in the unit of [`Job::size`](Job).
    pub done: u64,
    /// Work in all.
    pub total: u64,
    /// Jobs that have ended.
    pub ended: usize,
    /// Jobs of those that failed.
    pub failed: usize,
    /// Jobs in all.
    pub jobs: usize,
    /// What a job reported last; empty if none has reported anything.
    pub message: &'a str,
    /// Name of a job that failed just now, and why.
    pub failure: Option<(&'a str, &'a str)>,
}

/// A running job's connection to its batch: progress out, the request to stop in.
#[derive(Debug)]
pub struct JobHandle {
    done: AtomicU64,
    message: Mutex<Option<String>>,
    stop: Stop,
    watch: Watch,
    controls: (Sender<Control>, Receiver<Control>),
}

impl Default for JobHandle {
    fn default() -> Self {
        Self {
            done: AtomicU64::new(0),
            message: Mutex::default(),
            stop: Stop::default(),
            watch: Watch::default(),
            controls: unbounded(),
        }
    }
}

impl JobHandle {
    /// Sets how much of the job is done, of its [`Job::size`](Job).
    pub fn set_done(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
    }

    /// Reports what is being done.
    pub fn report(&self, message: String) {
        *lock(&self.message) = Some(message);
    }

    /// Whether the job should save what it has and return.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_requested()
    }

    /// The request that [`is_stopped`](Self::is_stopped) tells of, for those who look at it themselves.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// The view of the training that the job does; its episodes count as work done.
    pub(super) fn watch(&self) -> &Watch {
        &self.watch
    }

    /// The controls of the training that the job does.
    pub(super) fn controls(&self) -> &Receiver<Control> {
        &self.controls.1
    }

    fn ask_to_stop(&self) {
        if !self.stop.is_requested() {
            self.stop.request();
            // The receiver lives as long as the handle.
            let _ = self.controls.0.send(Control::Stop { reason: "interrupted".to_owned() });
            self.watch.note_stop();
        }
    }

    /// How much of the job is done.
    pub(crate) fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed).max(self.watch.episode())
    }
}

/// How a batch is run.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Jobs at the same time. Each has a thread pool of its own: jobs side by side keep a core
    /// busier than one job on several cores. Threads beyond the jobs are shared out among them.
    pub threads: usize,
    /// Becomes true when the batch is to be interrupted.
    pub interrupt: &'a AtomicBool,
}

/// Threads of a batch for which no number is given: one for each processor.
pub fn default_threads() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

impl Batch<'_> {
    /// Runs all jobs and returns their outcomes in the order of the jobs. If the system has fewer
    /// threads left than asked for, those are used.
    ///
    /// # Errors
    /// When no thread can be started; no job has been started then.
    pub fn run<T: Send, E: JobError>(
        &self,
        jobs: &[Job<'_, T, E>],
        on_progress: &mut dyn FnMut(&BatchProgress<'_>),
    ) -> Result<Vec<Outcome<T, E>>, BatchError> {
        let workers = self.threads.clamp(1, jobs.len().max(1));
        let share = (self.threads / workers).max(1);
        let state =
            State { jobs, handles: jobs.iter().map(|_| JobHandle::default()).collect(), queue: Queue::default() };
        let (sender, ended) = unbounded();
        thread::scope(|scope| {
            for started in 0..workers {
                let (state, sender) = (&state, sender.clone());
                let spawned = pool(share).or_else(|_| pool(1)).and_then(|pool| {
                    let work = move || state.work(self.interrupt, &pool, &sender);
                    let thread = thread::Builder::new().name("mge-worker".to_owned()).spawn_scoped(scope, work);
                    thread.map_err(|error| error.to_string())
                });
                match spawned {
                    Err(reason) if started == 0 => return Err(BatchError::Threads(reason)),
                    Err(_) => break,
                    Ok(_) => {}
                }
            }
            drop(sender);
            Ok(self.collect(&state, &ended, on_progress))
        })
    }

    /// Waits for all jobs on the calling thread.
    fn collect<T: Send, E: JobError>(
        &self,
        state: &State<'_, T, E>,
        ended: &Receiver<(usize, Outcome<T, E>)>,
        on_progress: &mut dyn FnMut(&BatchProgress<'_>),
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
            if self.interrupt.load(Ordering::Relaxed) {
                state.handles.iter().for_each(JobHandle::ask_to_stop);
            }
            if let Some(latest) = state.handles.iter().rev().find_map(|handle| lock(&handle.message).take()) {
                message = latest;
            }
            on_progress(&BatchProgress {
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

/// The outputs of all jobs, if every job has one.
///
/// # Errors
/// The first failure in the order of the jobs; an interruption only if nothing failed.
pub fn all<T, E: JobError>(outcomes: Vec<Result<T, JobFailure<E>>>) -> Result<Vec<T>, JobFailure<E>> {
    let (mut outputs, mut interrupted) = (Vec::new(), false);
    for outcome in outcomes {
        match outcome {
            Ok(output) => outputs.push(output),
            Err(JobFailure::Interrupted) => interrupted = true,
            Err(failure) => return Err(failure),
        }
    }
    if interrupted { Err(JobFailure::Interrupted) } else { Ok(outputs) }
}

fn pool(threads: usize) -> Result<ThreadPool, String> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())
}

/// The jobs that have not ended yet.
#[derive(Debug, Default)]
struct Queue {
    /// The next job that was never tried.
    next: AtomicUsize,
    /// Jobs that other processes worked on.
    put_off: Mutex<VecDeque<usize>>,
}

struct State<'a, T, E> {
    jobs: &'a [Job<'a, T, E>],
    handles: Vec<JobHandle>,
    queue: Queue,
}

impl<T: Send, E: JobError> State<'_, T, E> {
    /// Works on jobs until none is left.
    fn work(&self, interrupt: &AtomicBool, pool: &ThreadPool, ended: &Sender<(usize, Outcome<T, E>)>) {
        while !interrupt.load(Ordering::Relaxed) {
            let Some(index) = self.next() else { return };
            let outcome = pool.install(|| self.attempt(index));
            if let Err(JobFailure::Error(error)) = &outcome
                && error.is_in_use()
            {
                lock(&self.queue.put_off).push_back(index);
                continue;
            }
            if !matches!(outcome, Err(JobFailure::Interrupted)) {
                // Whether it failed or was finished before: nothing of it is left to do.
                self.handles[index].set_done(self.jobs[index].size);
            }
            // The receiver lives until all workers have ended.
            let _ = ended.send((index, outcome));
        }
    }

    /// The next job to be tried.
    fn next(&self) -> Option<usize> {
        let next = self.queue.next.fetch_add(1, Ordering::Relaxed);
        if next < self.jobs.len() {
            return Some(next);
        }
        let put_off = lock(&self.queue.put_off).pop_front()?;
        thread::sleep(REPORT_EVERY);
        Some(put_off)
    }

    fn attempt(&self, index: usize) -> Outcome<T, E> {
        match catch_unwind(AssertUnwindSafe(|| (self.jobs[index].work)(&self.handles[index]))) {
            Ok(Ok(Some(output))) => Ok(output),
            Ok(Ok(None)) => Err(JobFailure::Interrupted),
            Ok(Err(error)) => Err(JobFailure::Error(error)),
            Err(panic) => Err(JobFailure::Panic(panic_message(&*panic).to_owned())),
        }
    }
}

/// The values are replaced whole, so a panic elsewhere leaves them whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
