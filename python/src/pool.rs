//! Thread pools for work requested by Python.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The pools by number of threads.
static POOLS: Mutex<Vec<(usize, Arc<ThreadPool>)>> = Mutex::new(Vec::new());
/// The process that created them.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// The shared pool with this number of threads; by default `RAYON_NUM_THREADS` or the number of cores.
/// Sharing keeps many environments from creating many threads.
///
/// A forked process inherits its parent's pools without their threads and would wait for them forever, so it
/// gets its own pools.
pub fn pool(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let threads = threads.unwrap_or(0);
    let process = std::process::id();
    let mut pools = match POOLS.try_lock() {
        Ok(pools) => pools,
        Err(TryLockError::Poisoned(error)) => error.into_inner(),
        // A process forked while another thread held the lock inherits it locked for ever.
        Err(TryLockError::WouldBlock) if OWNER.load(Ordering::Relaxed) != process => return build(threads),
        Err(TryLockError::WouldBlock) => POOLS.lock().unwrap_or_else(PoisonError::into_inner),
    };
    if OWNER.swap(process, Ordering::Relaxed) != process {
        std::mem::forget(std::mem::take(&mut *pools));
    }
    if let Some((_, pool)) = pools.iter().find(|(of, _)| *of == threads) {
        return Ok(pool.clone());
    }
    let pool = build(threads)?;
    pools.push((threads, pool.clone()));
    Ok(pool)
}

fn build(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let built = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("mge-{index}")).build();
    built.map(Arc::new).map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))
}

/// Runs `work` on the default pool without holding the GIL.
pub fn work<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool(None)?;
    Ok(py.detach(|| pool.install(work)))
}
