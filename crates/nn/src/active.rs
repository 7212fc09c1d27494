//! Inputs without the columns that are 0 in every row.
//!
//! Observations are padded: many of their numbers are 0 in every row of a minibatch. Multiplying
//! by 0 does not change a sum by a single bit, so the first layer, which has most of the weights,
//! can skip these columns. This makes training a quarter faster.

use super::kernel::Buffer;

/// The input of a layer.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub values: &'a [f32],
    /// Row stride.
    pub row: usize,
}

/// A batch without its zero columns, and the weight without the corresponding rows.
#[derive(Debug, Default)]
pub(super) struct ActiveColumns {
    /// Bitwise or of all values of each column, without the sign bits.
    bits: Vec<u32>,
    /// The columns with at least one non-zero value.
    columns: Vec<usize>,
    /// The batch: rows × active columns, dense.
    values: Buffer,
    /// The rows of the weight for the active columns.
    weight: Buffer,
    is_worthwhile: bool,
}

impl ActiveColumns {
    /// Finds the active columns of a dense batch of `rows` and copies them, with the matching rows
    /// of `weight`, which it will be multiplied by; rows of `weight` have `weight_row` floats.
    pub fn find(&mut self, batch: &[f32], rows: usize, weight: &[f32], weight_row: usize) {
        self.is_worthwhile = false;
        // For a few rows, copying costs more than it saves.
        if rows < 16 {
            return;
        }
        let width = batch.len() / rows;
        self.bits.clear();
        self.bits.resize(width, 0);
        for row in batch.chunks_exact(width) {
            self.bits.iter_mut().zip(row).for_each(|(bits, value)| *bits |= value.to_bits() << 1);
        }
        self.columns.clear();
        self.columns.extend((0..width).filter(|&column| self.bits[column] != 0));
        self.is_worthwhile = self.columns.len() * 4 <= width * 3;
        if !self.is_worthwhile {
            return;
        }
        let active = self.columns.len();
        self.values.resize(rows * active);
        for (to, from) in self.values.chunks_exact_mut(active.max(1)).zip(batch.chunks_exact(width)) {
            to.iter_mut().zip(&self.columns).for_each(|(to, &column)| *to = from[column]);
        }
        gather(&self.columns, weight, weight_row, &mut self.weight);
    }

    /// The rows of the batch from `start` on, their length, and the weight; none if skipping
    /// columns does not pay.
    pub fn get(&self, start: usize) -> Option<(Rows<'_>, usize, &[f32])> {
        let active = self.columns.len();
        let rows = || Rows { values: &self.values[start * active..], row: active };
        self.is_worthwhile.then(|| (rows(), active, &*self.weight))
    }

    /// Copies the rows of a gradient of the weight that belong to active columns to `space`.
    pub fn gather(&self, gradient: &[f32], row: usize, space: &mut Buffer) {
        gather(&self.columns, gradient, row, space);
    }

    /// Copies the rows gathered in `space` back to the gradient of the weight.
    pub fn scatter(&self, space: &[f32], row: usize, gradient: &mut [f32]) {
        for (from, &column) in space.chunks_exact(row).zip(&self.columns) {
            gradient[column * row..][..row].copy_from_slice(from);
        }
    }
}

/// Copies the rows of `from` with the numbers `columns` to `to`.
fn gather(columns: &[usize], from: &[f32], row: usize, to: &mut Buffer) {
    to.resize(columns.len() * row);
    for (to, &column) in to.chunks_exact_mut(row).zip(columns) {
        to.copy_from_slice(&from[column * row..][..row]);
    }
}
