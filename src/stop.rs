//! The request to end that long work looks at: one kind for all.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::bounded;

/// Set once work is to end. A clone is the same request.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks all that look at it to end.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the work is to end.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Time between two looks at whether work is to be left behind.
const LOOK: Duration = Duration::from_millis(5);

/// Does work that may not look at a request to stop while it computes, on a thread of its own. None if
/// it has not ended `patience` after `is_stopped` first said so: the thread is left behind, what it
/// comes to is lost.
pub fn or_left_behind<T: Send + 'static>(
    is_stopped: impl Fn() -> bool,
    patience: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (sender, receiver) = bounded(1);
    let work = Arc::new(Mutex::new(Some(work)));
    let shared = work.clone();
    let body = move || {
        // Nobody panics while it is locked.
        let work = shared.lock().unwrap_or_else(PoisonError::into_inner).take();
        // Nobody may wait for the result any more.
        let _ = work.map(|work| sender.send(catch_unwind(AssertUnwindSafe(work))));
    };
    if thread::Builder::new().name("mge-work".to_owned()).spawn(body).is_err() {
        // Without a thread it is done here, to its end.
        let work = work.lock().unwrap_or_else(PoisonError::into_inner).take();
        return work.map(|work| work());
    }
    let mut asked = None;
    loop {
        match receiver.recv_timeout(LOOK) {
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
    fn work_is_awaited_until_it_is_asked_to_stop_and_then_left_behind() {
        let stop = Stop::default();
        let result = or_left_behind(|| stop.is_requested(), Duration::ZERO, || 7);
        assert_eq!(result, Some(7));
        let (end, ended) = bounded::<()>(0);
        let asked = stop.clone();
        let endless = move || {
            asked.request();
            // Until the test is over.
            let _ = ended.recv();
        };
        assert!(or_left_behind(|| stop.is_requested(), Duration::from_millis(20), endless).is_none());
        drop(end);
        let soon = || thread::sleep(Duration::from_millis(20));
        assert!(or_left_behind(|| stop.is_requested(), Duration::from_secs(600), soon).is_some());
    }

    #[test]
    fn a_panic_of_the_work_is_one_of_the_caller() {
        let work = || -> () { panic!("on purpose") };
        let panic = catch_unwind(|| or_left_behind(|| false, Duration::ZERO, work)).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    }
}
