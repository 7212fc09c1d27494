//! Work requested by Python: on threads, without holding the GIL, and ended by signals such as Ctrl-C.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use mge_base::stop::{Stop, run_abandonable};
use mge_env::FEW;

/// The pools by number of threads.
static POOLS: Mutex<Vec<(usize, Arc<ThreadPool>)>> = Mutex::new(Vec::new());
/// The process that created them.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// Time between two looks at Python's signals.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

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
        Err(TryLockError::WouldBlock) if OWNER.load(Ordering::Acquire) != process => return build(threads),
        Err(TryLockError::WouldBlock) => POOLS.lock().unwrap_or_else(PoisonError::into_inner),
    };
    if OWNER.swap(process, Ordering::AcqRel) != process {
        std::mem::forget(std::mem::take(&mut *pools));
    }
    if let Some((_, pool)) = pools.iter().find(|(of, _)| *of == threads) {
        return Ok(pool.clone());
    }
    let pool = build(threads)?;
    pools.push((threads, pool.clone()));
    Ok(pool)
}

/// A new pool.
fn build(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let built = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("mge-{index}")).build();
    built.map(Arc::new).map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))
}

/// The shared pool, or none for work on few things, which ends sooner than it would be handed over.
pub fn pool_for(things: usize, threads: Option<usize>) -> PyResult<Option<Arc<ThreadPool>>> {
    (things >= FEW).then(|| pool(threads)).transpose()
}

/// Runs `work` on a pool without holding the GIL. A signal is raised after it has requested a stop, at which the work
/// should end within a tenth of a second. Without a pool the work, which is then short, runs on the caller's thread.
pub fn work_on<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    work: impl FnOnce(&Stop) -> T + Send,
) -> PyResult<T> {
    let stop = Stop::default();
    let Some(pool) = pool else { return Ok(py.detach(|| work(&stop))) };
    let (working, ended) = channel::<()>();
    let (mut result, mut signals) = (None, Ok(()));
    py.detach(|| {
        let ended = ended;
        pool.in_place_scope(|scope| {
            let (result, stop) = (&mut result, &stop);
            scope.spawn(move |_| {
                // Dropped when the work ends, which ends the loop.
                let _working = working;
                *result = Some(work(stop));
            });
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(CHECK_INTERVAL) {
                if signals.is_ok() {
                    signals = Python::attach(|py| py.check_signals());
                    if signals.is_err() {
                        stop.request();
                    }
                }
            }
        });
    });
    signals?;
    // A panic of the work has already left the scope.
    result.ok_or_else(|| PyRuntimeError::new_err("the work has no result"))
}

/// Like [`work_on`] with the default pool.
pub fn work<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> T + Send) -> PyResult<T> {
    work_on(py, Some(&*pool(None)?), work)
}

/// Runs `work`, which cannot be stopped, on a thread without holding the GIL. A signal is raised at once, and the result
/// of the work is then lost.
pub fn abandonable<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let raised = Mutex::new(None);
    let is_stopped = || {
        let signal = Python::attach(|py| py.check_signals()).err();
        let is_stopped = signal.is_some();
        *raised.lock().unwrap_or_else(PoisonError::into_inner) = signal;
        is_stopped
    };
    let done = py.detach(|| run_abandonable(is_stopped, Duration::ZERO, work));
    let raised = raised.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.ok_or_else(|| raised.unwrap_or_else(|| PyKeyboardInterrupt::new_err(())))
}

/// Like [`abandonable`], for work on several threads. They are its own, so that abandoned work keeps no other waiting.
pub fn abandonable_on_threads<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = build(0)?;
    abandonable(py, move || pool.install(work))
}
