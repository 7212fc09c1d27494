//! Normalisation of a layer's outputs, row by row.

use super::dispatch::{Kernel, LINE};
use super::simd::Simd;

/// Added to the mean square, so that a row of zeros stays a row of zeros.
const MIN_MEAN_SQUARE: f32 = 1e-6;

/// Divides every row of `y` by the root mean square of its columns and stores the reciprocals in
/// `factors`, one per row. Rows are whole lines; padding must be 0.
pub(crate) struct Normalise<'a> {
    pub y: &'a mut [f32],
    /// Columns without the padding.
    pub columns: usize,
    pub factors: &'a mut [f32],
}

impl Kernel for Normalise<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        let row = row_length(self.y.len(), self.factors.len());
        for (y, factor) in self.y.chunks_exact_mut(row).zip(self.factors) {
            // SAFETY: rows are whole lines, a line whole vectors.
            unsafe {
                let mean = dot::<S>(y, y) / self.columns as f32;
                *factor = 1.0 / (mean + MIN_MEAN_SQUARE).sqrt();
                for i in (0..row).step_by(S::LANES) {
                    let y = y.as_mut_ptr().add(i);
                    S::store(y, S::mul(S::load(y), S::splat(*factor)));
                }
            }
        }
    }
}

/// dL/du from dL/dy where `y` is a row of `u` after [`Normalise`]: `(g - y mean(g y)) · factor`.
pub(crate) struct NormaliseGradient<'a> {
    pub y: &'a [f32],
    pub gradient: &'a mut [f32],
    /// Columns without the padding.
    pub columns: usize,
    pub factors: &'a [f32],
}

impl Kernel for NormaliseGradient<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        assert_eq!(self.y.len(), self.gradient.len());
        let row = row_length(self.y.len(), self.factors.len());
        let rows = self.gradient.chunks_exact_mut(row).zip(self.y.chunks_exact(row));
        for ((g, y), &factor) in rows.zip(self.factors) {
            // SAFETY: rows are whole lines, a line whole vectors.
            unsafe {
                let mean = S::splat(dot::<S>(g, y) / self.columns as f32);
                for i in (0..row).step_by(S::LANES) {
                    let (g, y) = (g.as_mut_ptr().add(i), S::load(y.as_ptr().add(i)));
                    S::store(g, S::mul(S::neg_mul_add(y, mean, S::load(g)), S::splat(factor)));
                }
            }
        }
    }
}

fn row_length(floats: usize, rows: usize) -> usize {
    let row = floats / rows.max(1);
    assert!(row.is_multiple_of(LINE) && row * rows == floats, "{floats} floats in {rows} rows");
    row.max(LINE)
}

/// Σ a b over a row of whole lines.
///
/// # Safety
/// As for [`Simd`]; both slices have the same length, a multiple of [`LINE`].
#[inline(always)]
pub(super) unsafe fn dot<S: Simd>(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0f32; LINE];
    // SAFETY: by this function's contract.
    unsafe {
        for offset in (0..LINE).step_by(S::LANES) {
            let mut sum = S::splat(0.0);
            for i in (offset..a.len()).step_by(LINE) {
                sum = S::mul_add(S::load(a.as_ptr().add(i)), S::load(b.as_ptr().add(i)), sum);
            }
            S::store(lanes.as_mut_ptr().add(offset), sum);
        }
    }
    lanes.iter().sum()
}
