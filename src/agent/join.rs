//! The critic's input: observations and actions side by side, `[s, a]`.

use dfdx::prelude::*;

use crate::nn::{Matrix, matrix};

/// Row `i` of `observations` followed by row `i` of `actions`, for all `rows`.
///
/// # Panics
/// If the values do not make as many whole rows.
pub(super) fn join(rows: usize, observations: &[f32], actions: &[f32]) -> Vec<f32> {
    if rows == 0 {
        return Vec::new();
    }
    let (observation_len, action_len) = (observations.len() / rows, actions.len() / rows);
    assert_eq!(observations.len(), rows * observation_len, "{rows} observations");
    assert_eq!(actions.len(), rows * action_len, "{rows} actions");
    let mut joined = Vec::with_capacity(observations.len() + actions.len());
    for row in 0..rows {
        joined.extend_from_slice(&observations[row * observation_len..][..observation_len]);
        joined.extend_from_slice(&actions[row * action_len..][..action_len]);
    }
    joined
}

/// [`join`] as an operation on the tape of `actions`, through which their gradient flows.
/// Observations are data and have none.
pub(super) fn join_on_tape<T: Tape<f32, Cpu>>(observations: &[f32], actions: Matrix<T>) -> Matrix<T> {
    let (actions, mut tape) = actions.split_tape();
    let (rows, action_len) = *actions.shape();
    let joined = join(rows, observations, &actions.as_vec());
    let columns = joined.len() / rows;
    let out = matrix(actions.device(), joined, rows, columns);
    let joined = out.clone();
    tape.add_backward_op(move |gradients| {
        let outer = std::mem::take(&mut **gradients.get_or_alloc_mut(&joined)?);
        let inner = gradients.get_or_alloc_mut(&actions)?;
        for (inner, outer) in inner.chunks_exact_mut(action_len).zip(outer.chunks_exact(columns)) {
            let outer = &outer[columns - action_len..];
            inner.iter_mut().zip(outer).for_each(|(inner, outer)| *inner += outer);
        }
        Ok(())
    });
    out.put_tape(tape)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_side_by_side() {
        let joined = join(2, &[1.0, 2.0, 3.0, 4.0], &[0.1, 0.2]);
        assert_eq!(joined, [1.0, 2.0, 0.1, 3.0, 4.0, 0.2]);
    }

    #[test]
    fn the_gradient_of_the_action_columns_flows_back() {
        let device = Cpu::default();
        let actions = matrix(&device, vec![0.1, 0.2, 0.3, 0.4], 2, 2);
        let weights = matrix(&device, vec![9.0, 1.0, 2.0, 9.0, 3.0, 4.0], 2, 3);
        let joined = join_on_tape(&[1.0, 2.0], actions.leaky_trace());
        assert_eq!(joined.as_vec(), [1.0, 0.1, 0.2, 2.0, 0.3, 0.4]);
        let gradients = (joined * weights).sum::<Rank0, _>().backward();
        assert_eq!(gradients.get(&actions).as_vec(), [1.0, 2.0, 3.0, 4.0]);
    }
}
