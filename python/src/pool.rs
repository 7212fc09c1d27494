//! Threads for work that Python asks for.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Pools by their number of threads, and the process that made them.
static POOLS: Mutex<(u32, Vec<(usize, Arc<ThreadPool>)>)> = Mutex::new((0, Vec::new()));

/// The pool of so many threads; without a number as many as there are cores, or as the variable
/// `RAYON_NUM_THREADS` says. One for all who ask, so that many environments do not make many threads.
///
/// A process that was forked has the pools of its parent without their threads, which would be
/// waited for without end. It gets pools of its own.
pub fn pool(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let threads = threads.unwrap_or(0);
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if pools.0 != process {
        std::mem::forget(std::mem::take(&mut pools.1));
        pools.0 = process;
    }
    if let Some((_, pool)) = pools.1.iter().find(|(of, _)| *of == threads) {
        return Ok(pool.clone());
    }
    let built = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("mge-{index}")).build();
    let pool = Arc::new(built.map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))?);
    pools.1.push((threads, pool.clone()));
    Ok(pool)
}

/// Does work on the pool of all cores, while other threads of Python go on.
pub fn work<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool(None)?;
    Ok(py.detach(|| pool.install(work)))
}
