//! Batches: independent jobs on several threads.
//!
//! Everything that runs many trainings, models or counts uses [`Batch::run`]. Its contract:
//!
//! 1. Jobs start in order, each on its own thread; outcomes are returned in job order, independent of the
//!    number of threads.
//! 2. A job that fails or panics does not stop the others; the failure is its outcome.
//! 3. A job that another process is working on is deferred until all others have started, then retried until
//!    the other process has finished or released it.
//! 4. When an interruption is requested, no further job starts, and running jobs are asked to stop;
//!    trainings then save a checkpoint.
//! 5. Progress is reported on the calling thread, at each job's end and at least every 200 ms.

mod runner;
#[cfg(test)]
mod tests;
mod training;

pub use runner::{Batch, BatchError, BatchProgress, Job, JobError, JobFailure, JobHandle};
pub use training::train_to_end;

/// Starts the global pool of threads, on as many as there are cores or `RAYON_NUM_THREADS` says.
pub fn start_global_pool() {
    // A pool that already exists will do.
    let _ = rayon::ThreadPoolBuilder::new().build_global();
}
