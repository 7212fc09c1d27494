//! In every order in which two threads may run and see each other's writes, whoever sees a request to stop also sees
//! what was sent before it.

use loom::sync::Arc;
use loom::sync::atomic::AtomicUsize;
use loom::sync::atomic::Ordering::Relaxed;

mod atomic {
    pub(super) use loom::sync::atomic::{AtomicBool, Ordering};
}

#[path = "../src/stop/flag.rs"]
#[allow(dead_code, reason = "the flag alone is tested here")]
mod flag;

#[test]
fn a_request_is_not_seen_before_what_was_sent_before_it() {
    loom::model(|| {
        let (sent, stop) = (Arc::new(AtomicUsize::new(0)), flag::Stop::default());
        let (sender, asked) = (sent.clone(), stop.clone());
        let thread = loom::thread::spawn(move || {
            sender.store(1, Relaxed);
            asked.request();
        });
        if stop.is_requested() {
            assert_eq!(sent.load(Relaxed), 1, "stopped without what was sent before");
        }
        thread.join().unwrap();
    });
}
