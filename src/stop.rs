//! The stop request that all long-running work polls.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::bounded;

use crate::sync::lock;

/// A flag that asks work to stop. Clones share the flag.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks all work that polls this flag to stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the work should stop.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Interval between two checks of `is_stopped`.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Runs `work`, which may not poll a stop request while it computes, on a separate thread. Returns None if it is
/// still running `patience` after `is_stopped` first returned true: the thread is then abandoned and its result lost.
pub fn run_abandonable<T: Send + 'static>(
    is_stopped: impl Fn() -> bool,
    patience: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (sender, receiver) = bounded(1);
    let work = Arc::new(Mutex::new(Some(work)));
    let shared = work.clone();
    let body = move || {
        // Nothing panics while the lock is held.
        let work = lock(&shared).take();
        // The receiver may have given up waiting.
        let _ = work.map(|work| sender.send(catch_unwind(AssertUnwindSafe(work))));
    };
    if thread::Builder::new().name("mge-work".to_owned()).spawn(body).is_err() {
        // No thread could be started: run the work here, to completion.
        let work = lock(&work).take();
        return work.map(|work| work());
    }
    let mut asked = None;
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(outcome) => return Some(outcome.unwrap_or_else(|panic| resume_unwind(panic))),
            Err(_) if !is_stopped() => {}
            Err(_) if asked.get_or_insert_with(Instant::now).elapsed() < patience => {}
            Err(_) => return None,
        }
    }
}

#[cfg(test)]
mod tests {
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
    fn a_panic_of_the_work_reaches_the_caller() {
        let work = || -> () { panic!("on purpose") };
        let panic = catch_unwind(|| run_abandonable(|| false, Duration::ZERO, work)).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    }
}
