//! Activations and other kernels that visit each float once.

use super::dispatch::{Kernel, LINE};
use super::normalise::dot;
use super::simd::{Simd, mul_add};
use crate::Activation;

/// tanh(x) = x P(x²) / Q(x²): a minimax fit of the relative error on [-8, 8] (1.5e-7; with
/// rounding 4e-7 absolute). Outside this range, tanh differs from ±1 by less than 2.3e-7.
const TANH_LIMIT: f32 = 8.0;
const TANH_P: [f32; 4] = [4066349.5, 525602.7, 11999.892, 46.47193];
const TANH_Q: [f32; 4] = [4066350.3, 1881048.0, 96842.37, 970.51184];

#[inline(always)]
fn tanh<S: Simd>(x: f32) -> f32 {
    let x = clamped(x, TANH_LIMIT);
    let t = x * x;
    let (mut p, mut q) = (TANH_P[3], t + TANH_Q[3]);
    for i in (0..3).rev() {
        p = mul_add::<S>(p, t, TANH_P[i]);
        q = mul_add::<S>(q, t, TANH_Q[i]);
    }
    clamped(x * p / q, 1.0)
}

/// The nearest value to `x` in [-limit, limit]; NaN stays NaN. `f32::clamp` is not vectorised.
#[inline(always)]
fn clamped(x: f32, limit: f32) -> f32 {
    let x = if limit < x { limit } else { x };
    if -limit > x { -limit } else { x }
}

/// `c = f(c)`. Leaves out the division of [`Activation::RmsRelu`], which [`Normalise`](super::Normalise) does.
#[inline(always)]
pub(super) fn activate<S: Simd>(f: Activation, c: &mut [f32]) {
    match f {
        Activation::Identity => {}
        // NaN stays NaN, unlike with `f32::max`.
        Activation::Relu | Activation::RmsRelu => c.iter_mut().for_each(|c| *c = if 0.0 > *c { 0.0 } else { *c }),
        Activation::Tanh => c.iter_mut().for_each(|c| *c = tanh::<S>(*c)),
    }
}

/// `d = d * f'(z)`, where `y = f(z)`, without the division of [`Activation::RmsRelu`].
#[inline(always)]
pub(super) fn derivative<S: Simd>(f: Activation, y: &[f32], d: &mut [f32]) {
    let pairs = d.iter_mut().zip(y);
    match f {
        Activation::Identity => {}
        Activation::Relu | Activation::RmsRelu => pairs.for_each(|(d, y)| *d = if *y > 0.0 { *d } else { 0.0 }),
        Activation::Tanh => pairs.for_each(|(d, y)| *d *= mul_add::<S>(-*y, *y, 1.0)),
    }
}

/// `gradient = gradient * f'(z)` where `output = f(z)`.
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
        derivative::<S>(self.activation, self.output, self.gradient);
    }
}

/// `sums += rows of x`, summed in order; rows are as long as `sums`.
pub(crate) struct ColumnSums<'a> {
    pub x: &'a [f32],
    pub sums: &'a mut [f32],
}

impl Kernel for ColumnSums<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(self) {
        assert_eq!(self.x.len() % self.sums.len().max(1), 0);
        for row in self.x.chunks_exact(self.sums.len().max(1)) {
            self.sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
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
        let Self { from, rows, columns, to } = self;
        assert!(rows % LINE == 0 && columns % LINE == 0);
        for r in (0..rows).step_by(LINE) {
            for c in 0..columns {
                let to = &mut to[c * rows + r..][..LINE];
                to.iter_mut().enumerate().for_each(|(n, to)| *to = from[(r + n) * columns + c]);
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
        dot::<S>(lines, lines) + rest.iter().map(|x| x * x).sum::<f32>()
    }
}
