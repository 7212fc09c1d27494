//! Arithmetic of the networks on slices, vectorised for the processor found at run time.
//!
//! Matrices are row-major with rows padded to whole [`LINE`]s, so that no kernel needs a
//! remainder. The instruction set (AVX-512, AVX2 with FMA, or plain Rust) is chosen once; results
//! depend on it in the last bits, but never on the number of threads or on how rows are grouped.

mod buffer;
mod elementwise;
mod product;
mod simd;
#[cfg(test)]
mod tests;
mod update;

use std::sync::OnceLock;

pub(super) use buffer::Buffer;
pub(super) use elementwise::{ColumnSums, Derivative, SumOfSquares, Transpose};
pub(super) use product::{Epilogue, Product, Start};
use simd::{Portable, Simd};
pub(super) use update::{Adam, Blend, RmsProp, Sgd, Update};

/// Floats in a cache line: rows of a [`Buffer`] are multiples of it.
pub(super) const LINE: usize = 16;

/// `columns` rounded up to whole lines.
pub(super) fn padded(columns: usize) -> usize {
    columns.next_multiple_of(LINE)
}

/// Work that is written once for every instruction set.
pub(super) trait Kernel: Sized {
    type Output;

    /// Does the work with the instructions `S`. Implementations are `#[inline(always)]`, so that
    /// they are compiled for the instruction set of the caller.
    ///
    /// # Safety
    /// The processor must have the instruction set `S`.
    unsafe fn run<S: Simd>(self) -> Self::Output;

    /// Does the work with the best instructions of this processor.
    fn go(self) -> Self::Output {
        self.go_with(Level::best())
    }

    /// Does the work with the instructions of `level`.
    fn go_with(self, level: Level) -> Self::Output {
        assert!(level.is_available(), "{level:?} on this processor");
        match level {
            // SAFETY: the processor has the instruction set, as asserted.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe { run_avx512(self) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => unsafe { run_avx2(self) },
            // SAFETY: plain Rust needs no instruction set.
            Level::Portable => unsafe { self.run::<Portable>() },
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

/// An instruction set the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// All levels, the best last.
    pub(super) const ALL: &[Level] = &[
        Level::Portable,
        #[cfg(target_arch = "x86_64")]
        Level::Avx2,
        #[cfg(target_arch = "x86_64")]
        Level::Avx512,
    ];

    /// The best level of this processor.
    #[inline]
    pub(super) fn best() -> Level {
        static BEST: OnceLock<Level> = OnceLock::new();
        *BEST.get_or_init(|| {
            let available = Level::ALL.iter().rev().find(|l| l.is_available());
            *available.unwrap_or(&Level::Portable)
        })
    }

    /// Whether this processor can run it.
    #[inline]
    pub(super) fn is_available(self) -> bool {
        match self {
            Level::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => is_x86_feature_detected!("avx512f") && Level::Avx2.is_available(),
        }
    }
}
