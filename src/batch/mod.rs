//! Batches: independent jobs on several threads.
//!
//! [`Batch::run`] is the one way to do many trainings, models or counts at once. Its contract:
//!
//! 1. Jobs start in their order, each on a thread of its own; outcomes are returned in the order of
//!    the jobs, whatever the threads.
//! 2. A job that fails, or panics, does not stop the others; its failure is its outcome.
//! 3. A job that another process works on is put off until all others have started, and tried
//!    again until the other process has finished it or left it.
//! 4. When an interruption is requested, no further job starts, and running jobs are asked to stop;
//!    trainings then save a checkpoint.
//! 5. Progress is reported on the calling thread, at each job's end and at least every 200 ms.

mod runner;
#[cfg(test)]
mod tests;
mod threads;
mod training;

pub use runner::{Batch, BatchError, BatchProgress, Job, JobError, JobFailure, JobHandle, all, default_threads};
pub use threads::start_global_pool;
pub use training::train_to_end;
