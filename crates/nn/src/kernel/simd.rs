//! The vector operations that the kernels use, implemented for every instruction set.

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

    unsafe fn load(from: *const f32) -> Self::V;
    unsafe fn store(to: *mut f32, v: Self::V);
    unsafe fn splat(x: f32) -> Self::V;
    unsafe fn add(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn sub(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn mul(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn div(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn sqrt(a: Self::V) -> Self::V;
    /// `a * b + c`
    unsafe fn mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `c - a * b`
    unsafe fn neg_mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// The smaller; `b` where either is NaN.
    unsafe fn min(a: Self::V, b: Self::V) -> Self::V;
    /// The larger; `b` where either is NaN.
    unsafe fn max(a: Self::V, b: Self::V) -> Self::V;
    /// `d` where `y > 0`, else 0.
    unsafe fn where_positive(y: Self::V, d: Self::V) -> Self::V;
    /// Transposes a `LANES` × `LANES` block; strides are in floats. Both pointers must be valid for
    /// the whole block.
    unsafe fn transpose(from: *const f32, from_row: usize, to: *mut f32, to_row: usize);
}

/// Plain Rust on arrays of four floats, for every processor.
pub(super) struct Portable;

impl Portable {
    #[inline(always)]
    fn zip(a: [f32; 4], b: [f32; 4], f: impl Fn(f32, f32) -> f32) -> [f32; 4] {
        std::array::from_fn(|i| f(a[i], b[i]))
    }
}

impl Simd for Portable {
    type V = [f32; 4];
    const LANES: usize = 4;
    const TILE_VECTORS: usize = 2;

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
    unsafe fn add(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn div(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    unsafe fn sqrt(a: Self::V) -> Self::V {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    unsafe fn mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        // `f32::mul_add` is a slow library call where the target has no such instruction.
        if cfg!(target_arch = "aarch64") {
            std::array::from_fn(|i| a[i].mul_add(b[i], c[i]))
        } else {
            std::array::from_fn(|i| a[i] * b[i] + c[i])
        }
    }
    #[inline(always)]
    unsafe fn neg_mul_add(a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        // SAFETY: needs no instruction set.
        unsafe { Self::mul_add(a.map(|a| -a), b, c) }
    }
    #[inline(always)]
    unsafe fn min(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    unsafe fn max(a: Self::V, b: Self::V) -> Self::V {
        Self::zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    unsafe fn where_positive(y: Self::V, d: Self::V) -> Self::V {
        Self::zip(y, d, |y, d| if y > 0.0 { d } else { 0.0 })
    }
    #[inline(always)]
    unsafe fn transpose(from: *const f32, from_row: usize, to: *mut f32, to_row: usize) {
        for r in 0..4 {
            for c in 0..4 {
                // SAFETY: the caller's block holds 4 × 4 floats on both sides.
                unsafe { *to.add(c * to_row + r) = *from.add(r * from_row + c) }
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Simd;

    /// Functions of [`Simd`] that are one instruction.
    macro_rules! intrinsics {
        ($($name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)? = $instruction:ident;)*) => {$(
            #[inline(always)]
            unsafe fn $name($($argument: $type),*) $(-> $result)? {
                // SAFETY: the trait's contract provides the instruction set and valid pointers.
                unsafe { $instruction($($argument),*) }
            }
        )*};
    }

    /// AVX2 with FMA: eight lanes, sixteen registers.
    pub(in crate::kernel) struct Avx2;

    impl Simd for Avx2 {
        type V = __m256;
        const LANES: usize = 8;
        const TILE_VECTORS: usize = 2;

        intrinsics! {
            load(from: *const f32) -> __m256 = _mm256_loadu_ps;
            store(to: *mut f32, v: __m256) = _mm256_storeu_ps;
            splat(x: f32) -> __m256 = _mm256_set1_ps;
            add(a: __m256, b: __m256) -> __m256 = _mm256_add_ps;
            sub(a: __m256, b: __m256) -> __m256 = _mm256_sub_ps;
            mul(a: __m256, b: __m256) -> __m256 = _mm256_mul_ps;
            div(a: __m256, b: __m256) -> __m256 = _mm256_div_ps;
            sqrt(a: __m256) -> __m256 = _mm256_sqrt_ps;
            mul_add(a: __m256, b: __m256, c: __m256) -> __m256 = _mm256_fmadd_ps;
            neg_mul_add(a: __m256, b: __m256, c: __m256) -> __m256 = _mm256_fnmadd_ps;
            min(a: __m256, b: __m256) -> __m256 = _mm256_min_ps;
            max(a: __m256, b: __m256) -> __m256 = _mm256_max_ps;
        }

        #[inline(always)]
        unsafe fn where_positive(y: __m256, d: __m256) -> __m256 {
            // SAFETY: the trait's contract provides the instruction set.
            unsafe { _mm256_and_ps(d, _mm256_cmp_ps::<_CMP_GT_OQ>(y, _mm256_setzero_ps())) }
        }
        #[inline(always)]
        unsafe fn transpose(from: *const f32, from_row: usize, to: *mut f32, to_row: usize) {
            // SAFETY: the trait's contract provides the instruction set, and LANES x LANES floats on
            // either side, of which row i begins i strides after the pointer.
            unsafe {
                // Plain loops: a closure would not be compiled for the instruction set.
                let mut pairs = [_mm256_setzero_ps(); 8];
                for i in (0..8).step_by(2) {
                    let a = _mm256_loadu_ps(from.add(i * from_row));
                    let b = _mm256_loadu_ps(from.add((i + 1) * from_row));
                    pairs[i] = _mm256_unpacklo_ps(a, b);
                    pairs[i + 1] = _mm256_unpackhi_ps(a, b);
                }
                // quads[h + c]: rows h..h+4 of columns c, c + 4, ... in one quarter each.
                let mut quads = [_mm256_setzero_ps(); 8];
                for h in (0..8).step_by(4) {
                    for j in 0..2 {
                        let (a, b) = (pairs[h + j], pairs[h + 2 + j]);
                        quads[h + 2 * j] = _mm256_shuffle_ps::<0b01_00_01_00>(a, b);
                        quads[h + 2 * j + 1] = _mm256_shuffle_ps::<0b11_10_11_10>(a, b);
                    }
                }
                for c in 0..4 {
                    let (a, b) = (quads[c], quads[4 + c]);
                    _mm256_storeu_ps(to.add(c * to_row), _mm256_permute2f128_ps::<0x20>(a, b));
                    let high = _mm256_permute2f128_ps::<0x31>(a, b);
                    _mm256_storeu_ps(to.add((c + 4) * to_row), high);
                }
            }
        }
    }

    /// AVX-512: sixteen lanes, thirty-two registers.
    pub(in crate::kernel) struct Avx512;

    impl Simd for Avx512 {
        type V = __m512;
        const LANES: usize = 16;
        const TILE_VECTORS: usize = 4;

        intrinsics! {
            load(from: *const f32) -> __m512 = _mm512_loadu_ps;
            store(to: *mut f32, v: __m512) = _mm512_storeu_ps;
            splat(x: f32) -> __m512 = _mm512_set1_ps;
            add(a: __m512, b: __m512) -> __m512 = _mm512_add_ps;
            sub(a: __m512, b: __m512) -> __m512 = _mm512_sub_ps;
            mul(a: __m512, b: __m512) -> __m512 = _mm512_mul_ps;
            div(a: __m512, b: __m512) -> __m512 = _mm512_div_ps;
            sqrt(a: __m512) -> __m512 = _mm512_sqrt_ps;
            mul_add(a: __m512, b: __m512, c: __m512) -> __m512 = _mm512_fmadd_ps;
            neg_mul_add(a: __m512, b: __m512, c: __m512) -> __m512 = _mm512_fnmadd_ps;
            min(a: __m512, b: __m512) -> __m512 = _mm512_min_ps;
            max(a: __m512, b: __m512) -> __m512 = _mm512_max_ps;
        }

        #[inline(always)]
        unsafe fn where_positive(y: __m512, d: __m512) -> __m512 {
            // SAFETY: the trait's contract provides the instruction set.
            unsafe {
                let positive = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(y, _mm512_setzero_ps());
                _mm512_maskz_mov_ps(positive, d)
            }
        }
        #[inline(always)]
        unsafe fn transpose(from: *const f32, from_row: usize, to: *mut f32, to_row: usize) {
            // SAFETY: the trait's contract provides the instruction set, and LANES x LANES floats on
            // either side, of which row i begins i strides after the pointer.
            unsafe {
                // Plain loops: a closure would not be compiled for the instruction set.
                let mut pairs = [_mm512_setzero_ps(); 16];
                for i in (0..16).step_by(2) {
                    let a = _mm512_loadu_ps(from.add(i * from_row));
                    let b = _mm512_loadu_ps(from.add((i + 1) * from_row));
                    pairs[i] = _mm512_unpacklo_ps(a, b);
                    pairs[i + 1] = _mm512_unpackhi_ps(a, b);
                }
                // quads[h + c]: rows h..h+4 of columns c, c + 4, ... in one quarter each.
                let mut quads = [_mm512_setzero_ps(); 16];
                for h in (0..16).step_by(4) {
                    for j in 0..2 {
                        let (a, b) = (pairs[h + j], pairs[h + 2 + j]);
                        quads[h + 2 * j] = _mm512_shuffle_ps::<0b01_00_01_00>(a, b);
                        quads[h + 2 * j + 1] = _mm512_shuffle_ps::<0b11_10_11_10>(a, b);
                    }
                }
                for c in 0..4 {
                    let (a, b) = (quads[c], quads[4 + c]);
                    let (d, e) = (quads[8 + c], quads[12 + c]);
                    // Quarters 0 and 2, then 1 and 3, of the upper and the lower eight rows.
                    let even = _mm512_shuffle_f32x4::<0b10_00_10_00>(a, b);
                    let odd = _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b);
                    let even_low = _mm512_shuffle_f32x4::<0b10_00_10_00>(d, e);
                    let odd_low = _mm512_shuffle_f32x4::<0b11_01_11_01>(d, e);
                    let columns = [
                        _mm512_shuffle_f32x4::<0b10_00_10_00>(even, even_low),
                        _mm512_shuffle_f32x4::<0b10_00_10_00>(odd, odd_low),
                        _mm512_shuffle_f32x4::<0b11_01_11_01>(even, even_low),
                        _mm512_shuffle_f32x4::<0b11_01_11_01>(odd, odd_low),
                    ];
                    for (q, column) in columns.into_iter().enumerate() {
                        _mm512_storeu_ps(to.add((c + 4 * q) * to_row), column);
                    }
                }
            }
        }
    }
}
