//! Normalisation of a layer's outputs, row by row.

use super::dispatch::{Kernel, LINE};
use super::simd::{Simd, mul_add};

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
            let mean = dot::<S>(y, y) / self.columns as f32;
            *factor = 1.0 / (mean + MIN_MEAN_SQUARE).sqrt();
            y.iter_mut().for_each(|y| *y *= *factor);
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
        for ((g, y), factor) in rows.zip(self.factors) {
            let mean = dot::<S>(g, y) / self.columns as f32;
            g.iter_mut().zip(y).for_each(|(g, y)| *g = mul_add::<S>(-*y, mean, *g) * factor);
        }
    }
}

fn row_length(floats: usize, rows: usize) -> usize {
    let row = floats / rows.max(1);
    assert!(row.is_multiple_of(LINE) && row * rows == floats, "{floats} floats in {rows} rows");
    row.max(LINE)
}

/// Σ a b over rows of the same length, a multiple of [`LINE`], of which every [`LINE`]th product is in one sum.
#[inline(always)]
pub(super) fn dot<S: Simd>(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; LINE];
    for (a, b) in a.as_chunks::<LINE>().0.iter().zip(b.as_chunks::<LINE>().0) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum = mul_add::<S>(*a, *b, *sum);
        }
    }
    sums.iter().sum()
}
