//! Thread pools for work requested by Python.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The process that created the pools, and the pools by number of threads.
static POOLS: Mutex<(u32, Vec<(usize, Arc<ThreadPool>)>)> = Mutex::new((0, Vec::new()));

/// The shared pool with this number of threads; by default `RAYON_NUM_THREADS` or the number of cores.
/// Sharing keeps many environments from creating many threads.
///
/// A forked process inherits its parent's pools without their threads and would wait for them forever, so it
/// gets its own pools.
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

/// Runs `work` on the default pool without holding the GIL.
pub fn work<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool(None)?;
    Ok(py.detach(|| pool.install(work)))
}
