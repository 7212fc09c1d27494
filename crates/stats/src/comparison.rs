//! Comparison of two methods.

use super::bootstrap::{Bootstrap, Estimate};
use super::scores::TaskScores;
use super::{Result, StatsError};

/// Probability of improvement, with its interval (both methods are resampled): the probability that a run of `x` scores
/// higher than a run of `y` on the same task, averaged over tasks. A tie counts one half. 0.5 means no difference.
///
/// # Errors
/// [`StatsError::Tasks`] if the two do not have the same number of tasks; as [`Bootstrap::stratified`].
pub fn improvement_interval(x: &TaskScores, y: &TaskScores, bootstrap: &Bootstrap) -> Result<Estimate> {
    let tasks = (x.tasks().len(), y.tasks().len());
    if tasks.0 != tasks.1 {
        return Err(StatsError::Tasks(tasks.0, tasks.1));
    }
    bootstrap.stratified_pair(x, y, mean_win_rate)
}

fn mean_win_rate(x: &TaskScores, y: &TaskScores) -> f64 {
    let tasks = x.tasks().iter().zip(y.tasks());
    tasks.map(|(x, y)| win_rate(x, y)).sum::<f64>() / x.tasks().len() as f64
}

/// Mann-Whitney's U of `x` over `y`, as a fraction of all pairs.
fn win_rate(x: &[f64], y: &[f64]) -> f64 {
    let score = |x: &f64, y: &f64| match x.total_cmp(y) {
        _ if x == y => 0.5,
        std::cmp::Ordering::Greater => 1.0,
        _ => 0.0,
    };
    let wins: f64 = x.iter().map(|x| y.iter().map(|y| score(x, y)).sum::<f64>()).sum();
    wins / (x.len() * y.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::super::aggregate::tests::{check, two_methods};
    use super::*;

    #[test]
    fn agrees_with_rliable() {
        let (x, y) = two_methods();
        check(mean_win_rate(&x, &y), 0.6904761904761904);
        check(mean_win_rate(&y, &x), 0.30952380952380953);
        check(mean_win_rate(&x, &x), 0.5);
        let bootstrap = Bootstrap { resamples: 5000, ..Default::default() };
        let estimate = improvement_interval(&x, &y, &bootstrap).unwrap();
        // rliable, 5000 resamples: 0.5238 to 0.8429 and 0.8476 with two seeds.
        assert!((estimate.lower - 0.5238).abs() < 0.015, "{estimate:?}");
        assert!((estimate.upper - 0.8452).abs() < 0.015, "{estimate:?}");
    }

    #[test]
    fn edge_cases() {
        let one = |score| TaskScores::of_one_task(&[score]).unwrap();
        assert_eq!(mean_win_rate(&one(1.0), &one(0.0)), 1.0);
        assert_eq!(mean_win_rate(&one(0.0), &one(1.0)), 0.0);
        assert_eq!(mean_win_rate(&one(0.0), &one(-0.0)), 0.5);
        let (x, _) = two_methods();
        let bootstrap = Bootstrap::default();
        assert_eq!(improvement_interval(&x, &one(0.0), &bootstrap).unwrap_err(), StatsError::Tasks(3, 1));
        let same = improvement_interval(&one(1.0), &one(1.0), &bootstrap).unwrap();
        assert!(same.value == 0.5 && !same.has_interval());
    }
}
