//! Differentiable operations on the rows of matrices, as one tape entry each.

use dfdx::prelude::*;

use super::Matrix;

/// `a` and `b` side by side: the rows of `a`, each followed by the same row of `b`. No gradient is
/// computed for a `b` without a tape.
///
/// # Panics
/// If the numbers of rows differ.
pub fn concat_columns<T, R>(a: Matrix<T>, b: Matrix<R>) -> Matrix<T>
where
    T: Tape<f32, Cpu> + Merge<R>,
    R: Tape<f32, Cpu>,
{
    let (a, tape) = a.contiguous().split_tape();
    let (b, other) = b.contiguous().split_tape();
    join(a, b, tape.merge(other), [true, R::OWNS_TAPE])
}

/// `data` and `x` side by side, as [`concat_columns`]; no gradient is computed for `data`.
///
/// # Panics
/// If the numbers of rows differ.
pub fn prepend_columns<T: Tape<f32, Cpu>>(data: &Matrix, x: Matrix<T>) -> Matrix<T> {
    let (x, tape) = x.contiguous().split_tape();
    join(data.clone().contiguous(), x, tape, [false, true])
}

fn join<T: Tape<f32, Cpu>>(a: Matrix, b: Matrix, mut tape: T, wanted: [bool; 2]) -> Matrix<T> {
    let ((rows, left), (rows_b, right)) = (*a.shape(), *b.shape());
    assert_eq!(rows, rows_b, "rows of the concatenated matrices");
    let (av, bv) = (values(&a), values(&b));
    let mut joined = Vec::with_capacity(rows * (left + right));
    for r in 0..rows {
        joined.extend_from_slice(&av[r * left..(r + 1) * left]);
        joined.extend_from_slice(&bv[r * right..(r + 1) * right]);
    }
    let out = a.device().tensor_from_vec(joined, (rows, left + right));
    let ghost = out.clone();
    tape.add_backward_op(move |grads| {
        let g = grads.get_or_alloc_mut(&ghost)?.to_vec();
        let parts = [(&a, 0, left), (&b, left, right)];
        for ((part, offset, width), _) in parts.into_iter().zip(wanted).filter(|(_, w)| *w) {
            let rows = grads.get_or_alloc_mut(part)?.chunks_exact_mut(width);
            for (to, from) in rows.zip(g.chunks_exact(left + right)) {
                to.iter_mut().zip(&from[offset..]).for_each(|(d, g)| *d += g);
            }
        }
        Ok(())
    });
    out.put_tape(tape)
}

/// The values of a contiguous `x`, row-major. dfdx's own `as_vec` goes element by element.
fn values(x: &Matrix) -> Vec<f32> {
    let mut values = vec![0.0; x.shape().num_elements()];
    x.copy_into(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::matrix;

    fn grid(rows: usize, columns: usize, from: f32) -> Matrix {
        let values = (0..rows * columns).map(|i| from + i as f32).collect();
        matrix(&Cpu::default(), values, rows, columns)
    }

    #[test]
    fn columns_are_joined_and_gradients_parted() {
        let (a, b, weights) = (grid(2, 1, 1.0), grid(2, 2, 10.0), grid(2, 3, 100.0));
        let joined = concat_columns(a.leaky_trace(), b.leaky_trace());
        assert_eq!(joined.as_vec(), [1.0, 10.0, 11.0, 2.0, 12.0, 13.0]);
        let grads = (joined * weights.clone()).sum().backward();
        assert_eq!(grads.get(&a).as_vec(), [100.0, 103.0]);
        assert_eq!(grads.get(&b).as_vec(), [101.0, 102.0, 104.0, 105.0]);

        let joined = prepend_columns(&a, b.leaky_trace());
        assert_eq!(joined.as_vec(), [1.0, 10.0, 11.0, 2.0, 12.0, 13.0]);
        let grads = (joined * weights).sum().backward();
        assert_eq!(grads.get(&b).as_vec(), [101.0, 102.0, 104.0, 105.0]);
    }
}
