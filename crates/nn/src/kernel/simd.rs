//! Vectors of the instruction sets, for the product. All other kernels are plain loops, which the compiler vectorises
//! for the instruction set that they are compiled for.

/// A set of vector instructions on `LANES` 32-bit floats.
///
/// # Safety
/// Functions may be called only on a processor that has the instruction set, from code compiled
/// for it (`#[target_feature]`); pointers must be valid for `LANES` floats.
pub(crate) trait Simd {
    type V: Copy;
    /// Floats in a vector; divides [`LINE`](super::dispatch::LINE).
    const LANES: usize;
    /// Width of the widest register tile, in vectors.
    const TILE_VECTORS: usize;
    /// Whether a multiplication and an addition are one instruction, which rounds once.
    const FUSED: bool;

    unsafe fn load(from: *const f32) -> Self::V;
    unsafe fn store(to: *mut f32, v: Self::V);
    unsafe fn splat(x: f32) -> Self::V;
    /// `a * b + c`, as [`mul_add`] of every lane.
    unsafe fn mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V;
}

/// `a * b + c`; rounded once if the instruction set is [fused](Simd::FUSED).
#[inline(always)]
pub(super) fn mul_add<S: Simd>(a: f32, b: f32, c: f32) -> f32 {
    // Without such an instruction, `f32::mul_add` is a slow library call.
    if S::FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Plain Rust on arrays of four floats, for every processor.
pub(super) struct Portable;

impl Simd for Portable {
    type V = [f32; 4];
    const LANES: usize = 4;
    const TILE_VECTORS: usize = 2;
    const FUSED: bool = cfg!(target_arch = "aarch64");

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self::V {
        // SAFETY: valid for LANES floats by the trait's contract.
        unsafe { from.cast::<[f32; 4]>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, v: Self::V) {
        // SAFETY: as for `load`.
        unsafe { to.cast::<[f32; 4]>().write_unaligned(v) }
    }
    #[inline(always)]
    unsafe fn splat(x: f32) -> Self::V {
        [x; 4]
    }
    #[inline(always)]
    unsafe fn mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        std::array::from_fn(|i| mul_add::<Self>(a[i], b[i], c[i]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Simd;

    /// An instruction set whose functions are one instruction each.
    macro_rules! instruction_set {
        ($(#[$doc:meta])* $set:ident: $lanes:literal lanes of $vector:ty, tiles of $tile:literal,
            $load:ident, $store:ident, $splat:ident, $mul_add:ident) => {
            $(#[$doc])*
            pub(in crate::kernel) struct $set;

            // SAFETY of the calls: the trait's contract provides the instruction set and valid pointers.
            #[allow(clippy::undocumented_unsafe_blocks, reason = "documented above for all")]
            impl Simd for $set {
                type V = $vector;
                const LANES: usize = $lanes;
                const TILE_VECTORS: usize = $tile;
                const FUSED: bool = true;

                #[inline(always)]
                unsafe fn load(from: *const f32) -> $vector {
                    unsafe { $load(from) }
                }
                #[inline(always)]
                unsafe fn store(to: *mut f32, v: $vector) {
                    unsafe { $store(to, v) }
                }
                #[inline(always)]
                unsafe fn splat(x: f32) -> $vector {
                    unsafe { $splat(x) }
                }
                #[inline(always)]
                unsafe fn mul_add(a: $vector, b: $vector, c: $vector) -> $vector {
                    unsafe { $mul_add(a, b, c) }
                }
            }
        };
    }

    instruction_set! {
        /// AVX2 with FMA: sixteen registers.
        Avx2: 8 lanes of __m256, tiles of 2, _mm256_loadu_ps, _mm256_storeu_ps, _mm256_set1_ps, _mm256_fmadd_ps
    }
    instruction_set! {
        /// AVX-512: thirty-two registers.
        Avx512: 16 lanes of __m512, tiles of 4, _mm512_loadu_ps, _mm512_storeu_ps, _mm512_set1_ps, _mm512_fmadd_ps
    }
}
