//! Differentiable operations on the rows of matrices, as one tape entry each.

use std::sync::Arc;

use dfdx::prelude::*;

use super::Matrix;

/// `a` and `b` side by side: the rows of `a`, each followed by the same row of `b`.
///
/// # Panics
/// If the numbers of rows differ.
pub fn concat_columns<T, R>(a: Matrix<T>, b: Matrix<R>) -> Matrix<T>
where
    T: Tape<f32, Cpu> + Merge<R>,
    R: Tape<f32, Cpu>,
{
    let (a, tape) = a.split_tape();
    let (b, other) = b.split_tape();
    let mut tape = tape.merge(other);
    let ((rows, left), (rows_b, right)) = (*a.shape(), *b.shape());
    assert_eq!(rows, rows_b, "rows of the concatenated matrices");
    let mut joined = Vec::with_capacity(rows * (left + right));
    let (av, bv) = (a.as_vec(), b.as_vec());
    for r in 0..rows {
        joined.extend_from_slice(&av[r * left..(r + 1) * left]);
        joined.extend_from_slice(&bv[r * right..(r + 1) * right]);
    }
    let out = a.device().tensor_from_vec(joined, (rows, left + right));
    let ghost = out.clone();
    tape.add_backward_op(move |grads| {
        let g = grads.get_or_alloc_mut(&ghost)?.to_vec();
        let da = grads.get_or_alloc_mut(&a)?;
        for (r, row) in da.chunks_exact_mut(left).enumerate() {
            let from = &g[r * (left + right)..][..left];
            row.iter_mut().zip(from).for_each(|(d, g)| *d += g);
        }
        let db = grads.get_or_alloc_mut(&b)?;
        for (r, row) in db.chunks_exact_mut(right).enumerate() {
            let from = &g[r * (left + right) + left..][..right];
            row.iter_mut().zip(from).for_each(|(d, g)| *d += g);
        }
        Ok(())
    });
    out.put_tape(tape)
}

/// A matrix of `rows` rows in which row `target[i]` has received row `i` of `x`; rows that share
/// a target are summed in order, rows without one are 0. This is how messages reach their
/// receivers.
///
/// # Panics
/// If `target` has not one entry a row of `x`, or an entry is not below `rows`.
pub fn scatter_sum<T: Tape<f32, Cpu>>(x: Matrix<T>, target: Arc<[usize]>, rows: usize) -> Matrix<T> {
    let (x, mut tape) = x.split_tape();
    let (count, columns) = *x.shape();
    assert_eq!(count, target.len(), "one target a row");
    assert!(target.iter().all(|&t| t < rows), "targets below {rows}");
    let values = x.as_vec();
    let mut sums = vec![0.0; rows * columns];
    for (row, &t) in values.chunks_exact(columns).zip(target.iter()) {
        let sum = &mut sums[t * columns..][..columns];
        sum.iter_mut().zip(row).for_each(|(s, v)| *s += v);
    }
    let out = x.device().tensor_from_vec(sums, (rows, columns));
    let ghost = out.clone();
    tape.add_backward_op(move |grads| {
        let g = grads.get_or_alloc_mut(&ghost)?.to_vec();
        let dx = grads.get_or_alloc_mut(&x)?;
        for (row, &t) in dx.chunks_exact_mut(columns).zip(target.iter()) {
            let from = &g[t * columns..][..columns];
            row.iter_mut().zip(from).for_each(|(d, g)| *d += g);
        }
        Ok(())
    });
    out.put_tape(tape)
}
