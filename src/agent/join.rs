//! The critic's input: observations and actions side by side, `[s, a]`.

/// Row `i` of `observations` followed by row `i` of `actions`, for all `rows`.
///
/// # Panics
/// If the values are not `rows` whole rows.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_joined_side_by_side() {
        let joined = join(2, &[1.0, 2.0, 3.0, 4.0], &[0.1, 0.2]);
        assert_eq!(joined, [1.0, 2.0, 0.1, 3.0, 4.0, 0.2]);
    }
}
