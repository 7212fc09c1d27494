//! The stop request that all long-running work polls, and the signals that make one.

mod flag;

use std::panic::resume_unwind;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{RecvTimeoutError, bounded};
use educe::Educe;
use rayon::ThreadPoolBuilder;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU};

pub use flag::{Stop, Stopped};

/// Atomics of the flag: those of loom in `tests/loom.rs`.
mod atomic {
    pub(super) use std::sync::atomic::{AtomicBool, Ordering};
}

/// The signals that ask a program to save its work and end: those of users and systems, and the warnings of batch
/// systems before a time limit.
pub const ENDING_SIGNALS: [i32; 5] = [SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU];
/// Further signals within this time count as the first one: a terminal, a shell and a batch system may all send theirs
/// to the program for one and the same event.
pub const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// Work in pieces of about the same length, such as episodes. A stop ends a piece that takes long.
#[derive(Debug, Educe)]
#[educe(Default)]
pub struct Pieces {
    /// The next piece may take long.
    #[educe(Default = true)]
    pub is_slow: bool,
}

/// After a piece that takes longer than this, the next one is run such that a stop can abandon it. The copy
/// and the thread needed for that take a small fraction of this time.
const SLOW_PIECE: Duration = Duration::from_millis(100);
/// Time for a piece to react to a stop by itself. Afterwards, for example during an update of large
/// networks, its thread is abandoned.
const STOP_TIMEOUT: Duration = Duration::from_millis(100);

impl Pieces {
    /// Does a piece of work on `state`. `work` returns None once the stop given to it is requested; then, and if the
    /// piece has to be abandoned, `state` is unchanged and the result is None.
    pub fn run<S: Clone + Send + 'static, T: Send + 'static>(
        &mut self,
        state: &mut S,
        stop: &Stop,
        work: impl FnOnce(&mut S, &Stop) -> Option<T> + Send + 'static,
    ) -> Option<T> {
        let started = Instant::now();
        let done = if self.is_slow {
            let (mut copy, on) = (state.clone(), stop.clone());
            let work = move || work(&mut copy, &on).map(|done| (done, copy));
            let (done, after) = run_abandonable(|| stop.is_requested(), STOP_TIMEOUT, work).flatten()?;
            *state = after;
            Some(done)
        } else {
            work(state, &Stop::default())
        };
        self.is_slow = started.elapsed() > SLOW_PIECE;
        done
    }
}

/// Interval between two checks of `is_stopped`.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Runs `work`, which may not poll a stop request while it computes, on a separate thread, with as many threads for
/// its parts as the caller has. Returns None if it is still running `patience` after `is_stopped` first returned true:
/// the thread is then abandoned and its result lost.
pub fn run_abandonable<T: Send + 'static>(
    is_stopped: impl Fn() -> bool,
    patience: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (sender, receiver) = bounded(1);
    // A pool's own threads cannot be used: one of them waits here.
    let threads = rayon::current_thread_index().map(|_| rayon::current_num_threads());
    let body = move || {
        let pool = threads.and_then(|threads| ThreadPoolBuilder::new().num_threads(threads).build().ok());
        // The receiver may have given up waiting.
        let _ = sender.send(match pool {
            Some(pool) => pool.install(work),
            None => work(),
        });
    };
    let worker = thread::Builder::new().name("mge-work".to_owned()).spawn(body).expect("a thread can be started");
    let mut asked = None;
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(done) => return Some(done),
            Err(RecvTimeoutError::Disconnected) => resume_unwind(worker.join().expect_err("it ended without a result")),
            Err(_) if !is_stopped() => {}
            Err(_) if asked.get_or_insert_with(Instant::now).elapsed() < patience => {}
            Err(_) => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn work_is_awaited_until_it_is_asked_to_stop_and_then_abandoned() {
        let stop = Stop::default();
        let result = run_abandonable(|| stop.is_requested(), Duration::ZERO, || 7);
        assert_eq!(result, Some(7));
        let (end, ended) = bounded::<()>(0);
        let asked = stop.clone();
        let endless = move || {
            asked.request();
            // Blocks until the test is over.
            let _ = ended.recv();
        };
        assert!(run_abandonable(|| stop.is_requested(), Duration::from_millis(20), endless).is_none());
        drop(end);
        let soon = || thread::sleep(Duration::from_millis(20));
        assert!(run_abandonable(|| stop.is_requested(), Duration::from_secs(600), soon).is_some());
    }

    #[test]
    fn work_has_as_many_threads_as_its_caller() {
        for threads in [1, 3] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let counted = || run_abandonable(|| false, Duration::ZERO, rayon::current_num_threads);
            assert_eq!(pool.install(counted), Some(threads));
        }
    }

    #[test]
    fn a_panic_of_the_work_reaches_the_caller() {
        let work = || -> () { panic!("on purpose") };
        let panic = catch_unwind(|| run_abandonable(|| false, Duration::ZERO, work)).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    }
}
