//! The matrix product used by the forward pass, the input gradient and the weight gradient.

use super::dispatch::{Kernel, LINE};
use super::elementwise::{activate, derivative};
use super::simd::Simd;
use crate::Activation;

/// Initial value of the sums.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a> {
    Zero,
    /// Every row starts with these values.
    Row(&'a [f32]),
    /// The sums are added to the present content of the result.
    Accumulate,
}

/// What happens to each finished row while it is in the cache.
#[derive(Clone, Copy)]
pub(crate) enum Epilogue<'a> {
    None,
    /// `c = f(c)`
    Activate(Activation),
    /// `c = c * f'(z)` where the matrix holds `f(z)`, with the row stride of `c`.
    Derivative(Activation, &'a [f32]),
}

/// `c = epilogue(start + a b)` with `a` of `rows` × `depth` and `b` of `depth` × `columns`.
///
/// Element (i, p) of `a` is `a[i * a_row + p * a_depth]`, so `a` may be a transpose; rows of `b`
/// are `b_row` apart, those of `c` `c_row`. `columns` is a multiple of [`LINE`]. Every element is
/// summed over `p` in order, so the result does not depend on how rows are grouped, and
/// `Accumulate` continues a sum exactly where an earlier product ended.
pub(crate) struct Product<'a> {
    pub rows: usize,
    pub depth: usize,
    pub columns: usize,
    pub a: &'a [f32],
    pub a_row: usize,
    pub a_depth: usize,
    pub b: &'a [f32],
    pub b_row: usize,
    pub start: Start<'a>,
    pub c: &'a mut [f32],
    pub c_row: usize,
    pub epilogue: Epilogue<'a>,
}

/// Rows of `b` that are used at a time, so that they stay in the first-level cache.
const DEPTH_BLOCK: usize = 96;

/// A range of the inner dimension.
#[derive(Clone, Copy)]
struct Part {
    first: usize,
    depth: usize,
    is_start: bool,
    is_end: bool,
}

impl Product<'_> {
    /// Panics unless the slices hold every element that the sizes and strides reach.
    fn check(&self) {
        assert_eq!(self.columns % LINE, 0);
        let r = self.rows - 1;
        if let Some(d) = self.depth.checked_sub(1) {
            assert!(r * self.a_row + d * self.a_depth < self.a.len());
            assert!(d * self.b_row + self.columns <= self.b.len());
        }
        let c_end = r * self.c_row + self.columns;
        assert!(c_end <= self.c.len());
        match self.start {
            Start::Row(row) => assert!(self.columns <= row.len()),
            Start::Zero | Start::Accumulate => {}
        }
        match self.epilogue {
            Epilogue::Derivative(_, y) => assert!(c_end <= y.len()),
            Epilogue::None | Epilogue::Activate(_) => {}
        }
    }

    /// Computes all rows of the `NV` vectors of columns from `column` on.
    ///
    /// # Safety
    /// As for [`Kernel::run`], and `column + NV * LANES <= columns`.
    #[inline(always)]
    unsafe fn panel<S: Simd, const NV: usize>(&mut self, column: usize) {
        let blocks = self.depth.div_ceil(DEPTH_BLOCK).max(1);
        for block in 0..blocks {
            let (first, end) = (self.depth * block / blocks, self.depth * (block + 1) / blocks);
            let part = Part { first, depth: end - first, is_start: block == 0, is_end: end == self.depth };
            // SAFETY: as for this function.
            unsafe { self.block::<S, NV>(column, part) }
        }
    }

    /// Computes one part of the sums of a panel.
    ///
    /// # Safety
    /// As for [`panel`](Self::panel); `part` lies within the depth.
    #[inline(always)]
    unsafe fn block<S: Simd, const NV: usize>(&mut self, column: usize, part: Part) {
        let mut row = 0;
        // SAFETY: the tiles cover the rows from 0 to `rows` and the caller's columns.
        unsafe {
            while row + 6 <= self.rows {
                self.tile::<S, 6, NV>(row, column, part);
                row += 6;
            }
            if row + 4 <= self.rows {
                self.tile::<S, 4, NV>(row, column, part);
                row += 4;
            }
            if row + 2 <= self.rows {
                self.tile::<S, 2, NV>(row, column, part);
                row += 2;
            }
            if row < self.rows {
                self.tile::<S, 1, NV>(row, column, part);
            }
        }
    }

    /// Computes `MR` rows by `NV` vectors of the result, summed in registers.
    ///
    /// # Safety
    /// As for [`Kernel::run`]; the tile lies inside the result.
    #[inline(always)]
    unsafe fn tile<S: Simd, const MR: usize, const NV: usize>(&mut self, row: usize, column: usize, part: Part) {
        // SAFETY: `check` has proven that all elements of the operands are inside their slices;
        // the tile's rows and columns are inside the result.
        unsafe {
            let c = self.c.as_mut_ptr().add(row * self.c_row + column);
            let mut sums = [[S::splat(0.0); NV]; MR];
            let start = if part.is_start { self.start } else { Start::Accumulate };
            match start {
                Start::Zero => {}
                Start::Row(start) => {
                    for v in 0..NV {
                        let start = S::load(start.as_ptr().add(column + v * S::LANES));
                        for sum in &mut sums {
                            sum[v] = start;
                        }
                    }
                }
                Start::Accumulate => {
                    for (r, sum) in sums.iter_mut().enumerate() {
                        for (v, sum) in sum.iter_mut().enumerate() {
                            *sum = S::load(c.add(r * self.c_row + v * S::LANES));
                        }
                    }
                }
            }
            let mut a = self.a.as_ptr().wrapping_add(row * self.a_row + part.first * self.a_depth);
            let mut b = self.b.as_ptr().wrapping_add(column + part.first * self.b_row);
            for _ in 0..part.depth {
                let mut b_vectors = [S::splat(0.0); NV];
                for (v, vector) in b_vectors.iter_mut().enumerate() {
                    *vector = S::load(b.add(v * S::LANES));
                }
                for (r, sum) in sums.iter_mut().enumerate() {
                    let a = S::splat(*a.add(r * self.a_row));
                    for (sum, &b) in sum.iter_mut().zip(&b_vectors) {
                        *sum = S::mul_add(a, b, *sum);
                    }
                }
                a = a.wrapping_add(self.a_depth);
                b = b.wrapping_add(self.b_row);
            }
            for (r, sum) in sums.iter().enumerate() {
                for (v, &sum) in sum.iter().enumerate() {
                    S::store(c.add(r * self.c_row + v * S::LANES), sum);
                }
            }
            if !part.is_end {
                return;
            }
            // A separate pass over the finished rows, still in the cache: inlined into the loops
            // above, the activations would make up most of every tile's code.
            for r in 0..MR {
                self.finish::<S>((row + r) * self.c_row + column, NV * S::LANES);
            }
        }
    }

    /// Applies the epilogue to `n` floats of the result from `at` on.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, at: usize, n: usize) {
        let c = &mut self.c[at..at + n];
        match self.epilogue {
            Epilogue::None => {}
            Epilogue::Activate(f) => activate::<S>(f, c),
            Epilogue::Derivative(f, y) => derivative::<S>(f, &y[at..at + n], c),
        }
    }
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(mut self) {
        if self.rows == 0 {
            return;
        }
        self.check();
        let mut column = 0;
        // SAFETY: the panels cover the columns from 0 to `columns`, a multiple of a line; a line
        // is 1, 2 or 4 vectors.
        unsafe {
            if S::TILE_VECTORS == 4 {
                while column + 4 * S::LANES <= self.columns {
                    self.panel::<S, 4>(column);
                    column += 4 * S::LANES;
                }
            }
            while column + 2 * S::LANES <= self.columns {
                self.panel::<S, 2>(column);
                column += 2 * S::LANES;
            }
            if column < self.columns {
                self.panel::<S, 1>(column);
            }
        }
    }
}
