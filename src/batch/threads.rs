//! The thread pool of the whole process.

use rayon::ThreadPoolBuilder;

/// Starts rayon's global pool, which otherwise starts at its first use and panics where the system
/// has too few threads left: with one thread for each processor, or else with one, or else on the
/// calling thread.
pub fn start_global_pool() {
    // The global pool can be started only once, even if that fails: another one is tried first.
    let threads = [0, 1].into_iter().find(|&threads| ThreadPoolBuilder::new().num_threads(threads).build().is_ok());
    let builder = match threads {
        Some(threads) => ThreadPoolBuilder::new().num_threads(threads),
        None => ThreadPoolBuilder::new().num_threads(1).use_current_thread(),
    };
    // One that has been started before is as good.
    let _ = builder.build_global();
}
