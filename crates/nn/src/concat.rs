//! Matrices side by side.

use dfdx::prelude::*;

use super::Matrix;

/// `a` and `b` side by side: each row of `a`, followed by the same row of `b`. No gradient is
/// computed for a matrix without a tape, unlike in dfdx's `concat_along`, which also works element
/// by element.
///
/// # Panics
/// If the numbers of rows differ.
pub fn concat_columns<A, B>(a: Matrix<A>, b: Matrix<B>) -> Matrix<OwnedTape<f32, Cpu>>
where
    A: Tape<f32, Cpu>,
    B: Tape<f32, Cpu>,
    OwnedTape<f32, Cpu>: Merge<A> + Merge<B>,
{
    let ((a, of_a), (b, of_b)) = (a.contiguous().split_tape(), b.contiguous().split_tape());
    let mut tape = OwnedTape::default().merge(of_a).merge(of_b);
    let ((rows, left), (rows_b, right)) = (*a.shape(), *b.shape());
    assert_eq!(rows, rows_b, "rows of the concatenated matrices");
    let joined = join_rows(rows, &values(&a), &values(&b));
    let out = a.device().tensor_from_vec(joined, (rows, left + right));
    let (a, b, ghost) = (a.ghost(), b.ghost(), out.ghost());
    tape.add_backward_op(move |grads| {
        let gradient = grads.get_or_alloc_mut(&ghost)?.to_vec();
        for (part, offset, width, is_data) in [(&a, 0, left, !A::OWNS_TAPE), (&b, left, right, !B::OWNS_TAPE)] {
            if is_data {
                continue;
            }
            let rows = grads.get_or_alloc_mut(part)?.chunks_exact_mut(width);
            for (to, from) in rows.zip(gradient.chunks_exact(left + right)) {
                to.iter_mut().zip(&from[offset..]).for_each(|(sum, value)| *sum += value);
            }
        }
        Ok(())
    });
    out.put_tape(tape)
}

/// Row `i` of `a` followed by row `i` of `b`, for all `rows`.
///
/// # Panics
/// If the values are not `rows` whole rows.
pub fn join_rows(rows: usize, a: &[f32], b: &[f32]) -> Vec<f32> {
    if rows == 0 {
        return Vec::new();
    }
    let (left, right) = (a.len() / rows, b.len() / rows);
    assert_eq!((a.len(), b.len()), (rows * left, rows * right), "{rows} rows");
    let mut joined = Vec::with_capacity(a.len() + b.len());
    for row in 0..rows {
        joined.extend_from_slice(&a[row * left..][..left]);
        joined.extend_from_slice(&b[row * right..][..right]);
    }
    joined
}

/// The values of a contiguous `x`, row-major. dfdx's own `as_vec` copies element by element.
fn values(x: &Matrix) -> Vec<f32> {
    let mut values = vec![0.0; x.shape().num_elements()];
    x.copy_into(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix;

    fn grid(rows: usize, columns: usize, from: f32) -> Matrix {
        let values = (0..rows * columns).map(|i| from + i as f32).collect();
        matrix(&Cpu::default(), values, rows, columns)
    }

    #[test]
    fn rows_are_joined_side_by_side() {
        let joined = join_rows(2, &[1.0, 2.0, 3.0, 4.0], &[0.1, 0.2]);
        assert_eq!(joined, [1.0, 2.0, 0.1, 3.0, 4.0, 0.2]);
    }

    #[test]
    fn columns_are_joined_and_gradients_split() {
        let (a, b, weights) = (grid(2, 1, 1.0), grid(2, 2, 10.0), grid(2, 3, 100.0));
        let joined = concat_columns(a.leaky_trace(), b.leaky_trace());
        assert_eq!(joined.as_vec(), [1.0, 10.0, 11.0, 2.0, 12.0, 13.0]);
        let grads = (joined * weights.clone()).sum().backward();
        assert_eq!(grads.get(&a).as_vec(), [100.0, 103.0]);
        assert_eq!(grads.get(&b).as_vec(), [101.0, 102.0, 104.0, 105.0]);

        let joined = concat_columns(a.clone(), b.leaky_trace());
        assert_eq!(joined.as_vec(), [1.0, 10.0, 11.0, 2.0, 12.0, 13.0]);
        let mut grads = (joined * weights).sum().backward();
        assert_eq!(grads.get(&b).as_vec(), [101.0, 102.0, 104.0, 105.0]);
        assert_eq!(grads.get_or_alloc_mut(&a).unwrap().to_vec(), [0.0, 0.0], "data has no gradient");
    }
}
