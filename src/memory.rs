//! Memory that is not needed any more goes back to the system.
//!
//! The C library of most Linux systems keeps what a thread has freed for the next thread. A session that
//! begins many computations, each on a thread of its own, would so come to hold what the largest of
//! them needed, many times.

/// Gives all free memory of the process back to the system. Takes milliseconds: for the end of a
/// computation, not for loops.
#[allow(unsafe_code, reason = "a call of the C library")]
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function takes no pointer, may be called from any thread, and touches only memory
    // that nobody has allocated.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// From now on all threads share as many heaps as there are cores. For a program that lives long: the C
/// library gives threads up to eight times as many, each with memory of its own that only its threads
/// use again.
#[allow(unsafe_code, reason = "a call of the C library")]
pub(crate) fn share_heaps() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        // SAFETY: the function takes no pointer and may be called from any thread. If it refuses the
        // number, nothing changes.
        unsafe {
            libc::mallopt(libc::M_ARENA_MAX, libc::c_int::try_from(cores.max(2)).unwrap_or(libc::c_int::MAX));
        }
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_in_use_stays_as_it_is() {
        let threads: Vec<_> = (0..4u8)
            .map(|number| {
                super::share_heaps();
                std::thread::spawn(move || {
                    let kept: Vec<Vec<u8>> = (0..2000).map(|size| vec![number; size]).collect();
                    drop(kept.iter().map(Clone::clone).collect::<Vec<_>>());
                    super::give_back();
                    kept
                })
            })
            .collect();
        for (thread, number) in threads.into_iter().zip(0..) {
            let kept = thread.join().unwrap();
            super::give_back();
            assert!(kept.iter().enumerate().all(|(size, bytes)| *bytes == vec![number; size]));
        }
    }
}
