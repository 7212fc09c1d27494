//! Performance profiles: the whole distribution of scores instead of one number.

use super::Result;
use super::bootstrap::{Bootstrap, Estimate};
use super::scores::TaskScores;

/// Fraction of all runs on all tasks with a score above each threshold.
pub fn performance_profile(scores: &TaskScores, thresholds: &[f64]) -> Vec<f64> {
    let count = scores.all().count() as f64;
    let above = |&threshold: &f64| scores.all().filter(|&score| score > threshold).count() as f64;
    thresholds.iter().map(|threshold| above(threshold) / count).collect()
}

/// [`performance_profile`] with a pointwise interval.
///
/// # Errors
/// As [`Bootstrap::stratified`].
pub fn profile_intervals(scores: &TaskScores, thresholds: &[f64], bootstrap: &Bootstrap) -> Result<Vec<Estimate>> {
    bootstrap.pointwise(scores, |scores| performance_profile(scores, thresholds))
}

#[cfg(test)]
mod tests {
    use super::super::aggregate::tests::{check, two_methods};
    use super::*;

    const THRESHOLDS: [f64; 6] = [0.0, 0.25, 0.5, 0.58, 0.75, 1.0];

    #[test]
    fn agrees_with_rliable() {
        let (x, _) = two_methods();
        let expected = [1.0, 1.0, 0.7619047619047619, 0.5238095238095238, 0.23809523809523808, 0.0];
        let profile = performance_profile(&x, &THRESHOLDS);
        profile.iter().zip(expected).for_each(|(found, expected)| check(*found, expected));

        // rliable, 10 000 resamples; a step of the profile is 1/21.
        let bootstrap = Bootstrap { resamples: 10_000, ..Default::default() };
        let band = profile_intervals(&x, &THRESHOLDS, &bootstrap).unwrap();
        let lower = [1.0, 1.0, 0.5714285714, 0.3333333333, 0.0952380952, 0.0];
        let upper = [1.0, 1.0, 0.9047619048, 0.7142857143, 0.4285714286, 0.0];
        for (at, estimate) in band.iter().enumerate() {
            assert!((estimate.lower - lower[at]).abs() < 0.048, "{at}: {estimate:?}");
            assert!((estimate.upper - upper[at]).abs() < 0.048, "{at}: {estimate:?}");
        }
    }

    #[test]
    fn a_score_at_the_threshold_is_not_above_it() {
        let scores = TaskScores::of_one_task(&[0.5, 0.6]).unwrap();
        assert_eq!(performance_profile(&scores, &[0.5, 0.6]), [0.5, 0.0]);
        assert!(performance_profile(&scores, &[]).is_empty());
        assert_eq!(profile_intervals(&scores, &[], &Bootstrap::default()), Ok(vec![]));
    }
}
