//! Aggregates the scores of many runs into one number.

use super::scores::TaskScores;

/// Mean over tasks of the mean over runs.
pub fn mean(scores: &TaskScores) -> f64 {
    mean_of(&task_means(scores))
}

/// Median over tasks of the mean over runs.
pub fn median(scores: &TaskScores) -> f64 {
    let means = sorted(task_means(scores));
    let middle = means.len() / 2;
    if means.len() % 2 == 1 { means[middle] } else { (means[middle - 1] + means[middle]) / 2.0 }
}

/// Interquartile mean: the mean of the middle half of all scores of all tasks pooled. As robust as the median, with
/// an interval nearly as narrow as the mean's.
pub fn iqm(scores: &TaskScores) -> f64 {
    trimmed_mean(&sorted(scores.all().collect()))
}

/// Mean amount by which scores fall short of `target`; higher scores count as `target`.
pub fn optimality_gap(scores: &TaskScores, target: f64) -> f64 {
    let clipped: Vec<f64> = scores.all().map(|score| score.min(target)).collect();
    target - mean_of(&clipped)
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// Mean of sorted values without the lowest and the highest quarter, each rounded down; the [`iqm`] of one task's
/// scores. NaN if there are no values.
pub fn trimmed_mean(sorted: &[f64]) -> f64 {
    let cut = sorted.len() / 4;
    mean_of(&sorted[cut..sorted.len() - cut])
}

fn task_means(scores: &TaskScores) -> Vec<f64> {
    scores.tasks().iter().map(|runs| mean_of(runs)).collect()
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Scores of two methods on three tasks, with 7 and 5 runs per task and ties between the methods in task 1.
    ///
    /// Drawn with numpy (`default_rng(5)`, `beta(3, 2)` and `beta(2, 2)`, rounded to two digits). The values that
    /// tests in this folder expect were computed with rliable 1.2.0 (arch 7.2.0, numpy 2.4.6, scipy 1.17.1):
    /// `metrics.aggregate_*`, `metrics.probability_of_improvement`, `library.run_score_deviation`; intervals with
    /// `library.get_interval_estimates`.
    pub fn two_methods() -> (TaskScores, TaskScores) {
        let x = vec![
            vec![0.53, 0.66, 0.53, 0.45, 0.62, 0.3, 0.89],
            vec![0.83, 0.66, 0.4, 0.48, 0.33, 0.54, 0.87],
            vec![0.82, 0.53, 0.68, 0.66, 0.75, 0.57, 0.87],
        ];
        let y = vec![
            vec![0.25, 0.53, 0.3, 0.76, 0.48],
            vec![0.6, 0.51, 0.36, 0.83, 0.83],
            vec![0.16, 0.32, 0.19, 0.48, 0.61],
        ];
        (TaskScores::new(x).unwrap(), TaskScores::new(y).unwrap())
    }

    #[track_caller]
    pub fn check(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }

    #[test]
    fn agrees_with_rliable() {
        let (x, y) = two_methods();
        check(mean(&x), 0.6176190476190476);
        check(median(&x), 0.5871428571428572);
        check(iqm(&x), 0.6118181818181818);
        check(optimality_gap(&x, 0.8), 0.19571428571428573);
        check(mean(&y), 0.48066666666666674);
        check(median(&y), 0.4640000000000001);
        check(iqm(&y), 0.4655555555555556);
        check(optimality_gap(&y, 0.8), 0.32333333333333336);
    }

    #[test]
    fn small_samples() {
        // scipy.stats.trim_mean([1..9, 100], 0.25)
        let mut values = Vec::from_iter((1..10).map(f64::from));
        values.push(100.0);
        for (values, mean) in
            [(values, 5.5), (vec![3.0], 3.0), (vec![1.0, 2.0, 6.0], 3.0), (vec![9.0, 0.0, 1.0, 2.0], 1.5)]
        {
            assert_eq!(iqm(&TaskScores::of_one_task(&values).unwrap()), mean);
        }
        let even = TaskScores::new(vec![vec![1.0], vec![4.0]]).unwrap();
        assert_eq!(median(&even), 2.5);
    }
}
