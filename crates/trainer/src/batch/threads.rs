//! The thread pool of the whole process.

use std::thread;

use rayon::ThreadPoolBuilder;

use super::runner::default_threads;

/// Starts rayon's global pool with as many threads as rayon would use; if the system cannot start that many, with
/// one, or else on the calling thread. Without this, rayon starts the pool at its first use and panics if threads are
/// missing.
pub fn start_global_pool() {
    let wanted = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok());
    let wanted = wanted.filter(|&threads| threads > 0).unwrap_or_else(default_threads);
    // `build_global` can be called only once, even if it fails, so the threads are tried first.
    let builder = match [wanted, 1].into_iter().find(|&threads| can_start(threads)) {
        Some(threads) => ThreadPoolBuilder::new().num_threads(threads),
        None => ThreadPoolBuilder::new().num_threads(1).use_current_thread(),
    };
    // A pool that already exists will do.
    let _ = builder.build_global();
}

/// Whether this many threads can exist at the same time.
fn can_start(threads: usize) -> bool {
    let (hold, held) = crossbeam_channel::bounded::<()>(0);
    thread::scope(|scope| {
        // Blocks until the other end of the channel is dropped.
        let wait = || {
            let _ = held.recv();
        };
        let all = (0..threads).all(|_| thread::Builder::new().spawn_scoped(scope, wait).is_ok());
        drop(hold);
        all
    })
}
