//! Activations and other kernels that visit each float once.

use super::dispatch::{Kernel, LINE};
use super::normalise::dot;
use super::simd::Simd;
use crate::Activation;

/// tanh(x) = x P(x²) / Q(x²): a minimax fit of the relative error on [-8, 8] (1.5e-7; with
/// rounding 4e-7 absolute). Outside this range, tanh differs from ±1 by less than 2.3e-7.
const TANH_LIMIT: f32 = 8.0;
const TANH_P: [f32; 4] = [4066349.5, 525602.7, 11999.892, 46.47193];
const TANH_Q: [f32; 4] = [4066350.3, 1881048.0, 96842.37, 970.51184];

/// NaN stays NaN: `min` and `max` return their second operand if either is NaN.
#[inline(always)]
unsafe fn tanh<S: Simd>(x: S::V) -> S::V {
    // SAFETY: by the contract of `Simd`.
    unsafe {
        let x = S::min(S::splat(TANH_LIMIT), x);
        let x = S::max(S::splat(-TANH_LIMIT), x);
        let t = S::mul(x, x);
        let mut p = S::splat(TANH_P[3]);
        let mut q = S::add(t, S::splat(TANH_Q[3]));
        for i in (0..3).rev() {
            p = S::mul_add(p, t, S::splat(TANH_P[i]));
            q = S::mul_add(q, t, S::splat(TANH_Q[i]));
        }
        let y = S::div(S::mul(x, p), q);
        S::max(S::splat(-1.0), S::min(S::splat(1.0), y))
    }
}

/// `c = f(c)` for `n` floats. Leaves out the division of [`Activation::RmsRelu`], which
/// [`Normalise`](super::Normalise) does.
#[inline(always)]
pub(super) unsafe fn activate<S: Simd>(f: Activation, c: *mut f32, n: usize) {
    // SAFETY: the caller's pointer is valid for `n` floats, whole vectors.
    unsafe {
        match f {
            Activation::Identity => {}
            Activation::Relu | Activation::RmsRelu => {
                for i in (0..n).step_by(S::LANES) {
                    let c = c.add(i);
                    S::store(c, S::max(S::splat(0.0), S::load(c)));
                }
            }
            Activation::Tanh => {
                for i in (0..n).step_by(S::LANES) {
                    let c = c.add(i);
                    S::store(c, tanh::<S>(S::load(c)));
                }
            }
        }
    }
}

/// `d = d * f'(z)` for `n` floats, where `y = f(z)`, without the division of [`Activation::RmsRelu`].
#[inline(always)]
pub(super) unsafe fn derivative<S: Simd>(f: Activation, y: *const f32, d: *mut f32, n: usize) {
    // SAFETY: the caller's pointers are valid for `n` floats, whole vectors.
    unsafe {
        match f {
            Activation::Identity => {}
            Activation::Relu | Activation::RmsRelu => {
                for i in (0..n).step_by(S::LANES) {
                    let d = d.add(i);
                    S::store(d, S::where_positive(S::load(y.add(i)), S::load(d)));
                }
            }
            Activation::Tanh => {
                for i in (0..n).step_by(S::LANES) {
                    let (y, g) = (S::load(y.add(i)), S::load(d.add(i)));
                    S::store(d.add(i), S::mul(g, S::neg_mul_add(y, y, S::splat(1.0))));
                }
            }
        }
    }
}

/// `gradient = gradient * f'(z)` where `output = f(z)`; lengths are multiples of [`LINE`].
pub(crate) struct Derivative<'a> {
    pub activation: Activation,
    pub output: &'a [f32],
    pub gradient: &'a mut [f32],
}

impl Kernel for Derivative<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        assert_eq!(self.output.len(), self.gradient.len());
        assert_eq!(self.output.len() % LINE, 0);
        let n = self.output.len();
        // SAFETY: both slices hold `n` floats, whole vectors.
        unsafe {
            let (y, d) = (self.output.as_ptr(), self.gradient.as_mut_ptr());
            derivative::<S>(self.activation, y, d, n);
        }
    }
}

/// `sums += rows of x`, summed in order; rows are as long as `sums`, a multiple of [`LINE`].
pub(crate) struct ColumnSums<'a> {
    pub x: &'a [f32],
    pub sums: &'a mut [f32],
}

impl Kernel for ColumnSums<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        let row = self.sums.len();
        assert_eq!(row % LINE, 0);
        assert_eq!(self.x.len() % row.max(1), 0);
        for column in (0..row).step_by(LINE) {
            // SAFETY: a line starts at every `column` of every row and consists of whole vectors.
            unsafe {
                for at in (column..column + LINE).step_by(S::LANES) {
                    let mut sum = S::load(self.sums.as_ptr().add(at));
                    for i in (at..self.x.len()).step_by(row) {
                        sum = S::add(sum, S::load(self.x.as_ptr().add(i)));
                    }
                    S::store(self.sums.as_mut_ptr().add(at), sum);
                }
            }
        }
    }
}

/// `to` = transpose of `from`; `rows` and `columns` are multiples of [`LINE`].
pub(crate) struct Transpose<'a> {
    pub from: &'a [f32],
    pub rows: usize,
    pub columns: usize,
    pub to: &'a mut [f32],
}

impl Kernel for Transpose<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        let (rows, columns) = (self.rows, self.columns);
        assert!(rows % LINE == 0 && columns % LINE == 0);
        assert!(rows * columns <= self.from.len() && rows * columns <= self.to.len());
        for r in (0..rows).step_by(S::LANES) {
            for c in (0..columns).step_by(S::LANES) {
                // SAFETY: the block of LANES × LANES at (r, c) is inside both matrices.
                unsafe {
                    let from = self.from.as_ptr().add(r * columns + c);
                    S::transpose(from, columns, self.to.as_mut_ptr().add(c * rows + r), rows);
                }
            }
        }
    }
}

/// Σ x².
pub(crate) struct SumOfSquares<'a>(pub &'a [f32]);

impl Kernel for SumOfSquares<'_> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<S: Simd>(self) -> f32 {
        let (lines, rest) = self.0.split_at(self.0.len() / LINE * LINE);
        // SAFETY: `lines` consists of whole lines.
        let of_lines = unsafe { dot::<S>(lines, lines) };
        of_lines + rest.iter().map(|x| x * x).sum::<f32>()
    }
}
