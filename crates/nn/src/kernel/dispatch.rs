//! The choice of the instruction set.

use std::sync::OnceLock;

use super::simd::{self, Portable, Simd};

/// Floats in a cache line. Row lengths in a [`Buffer`](super::buffer::Buffer) are multiples of it.
pub(crate) const LINE: usize = 16;

/// `columns` rounded up to whole lines.
pub(crate) fn padded(columns: usize) -> usize {
    columns.next_multiple_of(LINE)
}

/// Work written once and compiled for every instruction set.
pub(crate) trait Kernel: Sized {
    type Output;

    /// Does the work with the instructions `S`. Implementations are `#[inline(always)]`, so that
    /// they are compiled for the instruction set of the caller.
    ///
    /// # Safety
    /// The processor must have the instruction set `S`.
    unsafe fn run<S: Simd>(self) -> Self::Output;

    /// Does the work with the best instructions of this processor.
    fn execute(self) -> Self::Output {
        self.execute_at(Level::best())
    }

    /// Does the work with the instructions of `level`.
    fn execute_at(self, level: Level) -> Self::Output {
        assert!(level.is_available(), "{level:?} on this processor");
        match level {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                // SAFETY: the processor has the instruction set, as asserted.
                unsafe { run_avx512(self) }
            }
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => {
                // SAFETY: as above.
                unsafe { run_avx2(self) }
            }
            _ => {
                // SAFETY: plain Rust needs no instruction set.
                unsafe { self.run::<Portable>() }
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
unsafe fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: the caller has checked for the instruction set.
    unsafe { kernel.run::<simd::Avx512>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: the caller has checked for the instruction set.
    unsafe { kernel.run::<simd::Avx2>() }
}

/// An instruction set the kernels are compiled for, the best last; the names are recorded with results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Portable,
    Avx2,
    Avx512,
}

mge_base::names!(Level { Portable = "portable", Avx2 = "avx2", Avx512 = "avx512" });

impl Level {
    /// The best level of this processor.
    #[inline]
    pub(crate) fn best() -> Level {
        static BEST: OnceLock<Level> = OnceLock::new();
        *BEST.get_or_init(|| {
            let available = Level::ALL.into_iter().rfind(|level| level.is_available());
            available.unwrap_or(Level::Portable)
        })
    }

    /// Whether this processor supports it.
    #[inline]
    pub(crate) fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        let has = |level| match level {
            Level::Portable => true,
            Level::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            Level::Avx512 => is_x86_feature_detected!("avx512f"),
        };
        #[cfg(not(target_arch = "x86_64"))]
        let has = |level| level == Level::Portable;
        has(self) && (self != Level::Avx512 || has(Level::Avx2))
    }
}
