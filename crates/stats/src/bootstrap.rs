//! Confidence intervals by resampling: the stratified percentile bootstrap.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::aggregate;
use super::scores::TaskScores;
use super::{Result, StatsError};

/// Settings for computing an interval. Report them beside it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bootstrap {
    /// Number of resamples.
    pub resamples: u32,
    /// Confidence level, such as 0.95.
    pub confidence: f64,
    /// Seed of the resampling; every interval starts a new stream from it.
    pub seed: u64,
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self { resamples: 2000, confidence: 0.95, seed: 0 }
    }
}

/// A value with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The statistic of the original data.
    pub value: f64,
    /// Lower end of the interval.
    pub lower: f64,
    /// Upper end of the interval.
    pub upper: f64,
}

impl Estimate {
    /// A value without an interval.
    pub fn exact(value: f64) -> Self {
        Self { value, lower: f64::NAN, upper: f64::NAN }
    }

    /// Whether both ends of the interval are numbers.
    pub fn has_interval(&self) -> bool {
        self.lower.is_finite() && self.upper.is_finite()
    }

    /// The value and both ends of the interval.
    pub fn values(&self) -> [f64; 3] {
        [self.value, self.lower, self.upper]
    }
}

impl Bootstrap {
    /// A statistic of all runs, such as [`aggregate::iqm`], with its interval: runs are drawn with replacement within
    /// each task, and the interval lies between two percentiles (interpolated linearly) of the resampled statistics.
    ///
    /// # Errors
    /// [`StatsError::Confidence`] or [`StatsError::Resamples`]; the same for all methods below.
    pub fn stratified(&self, scores: &TaskScores, statistic: impl Fn(&TaskScores) -> f64) -> Result<Estimate> {
        self.only(self.pointwise(scores, |scores| vec![statistic(scores)])?)
    }

    /// A statistic of two methods, which are resampled independently.
    ///
    /// # Errors
    /// As [`Bootstrap::stratified`].
    pub fn stratified_pair(
        &self,
        x: &TaskScores,
        y: &TaskScores,
        statistic: impl Fn(&TaskScores, &TaskScores) -> f64,
    ) -> Result<Estimate> {
        let (mut drawn_x, mut drawn_y) = (x.clone(), y.clone());
        self.only(self.percentiles(vec![statistic(x, y)], |stream| {
            x.resample_into(&mut drawn_x, stream);
            y.resample_into(&mut drawn_y, stream);
            vec![statistic(&drawn_x, &drawn_y)]
        })?)
    }

    /// Several statistics of the same runs, each with its own (pointwise) interval.
    ///
    /// # Errors
    /// As [`Bootstrap::stratified`].
    pub fn pointwise(&self, scores: &TaskScores, statistic: impl Fn(&TaskScores) -> Vec<f64>) -> Result<Vec<Estimate>> {
        let mut drawn = scores.clone();
        self.percentiles(statistic(scores), |stream| {
            scores.resample_into(&mut drawn, stream);
            statistic(&drawn)
        })
    }

    /// Mean of plain values, such as hit counts of several seeds.
    ///
    /// # Errors
    /// As [`Bootstrap::stratified`], and as [`TaskScores::new`] for the values.
    pub fn mean(&self, values: &[f64]) -> Result<Estimate> {
        if values.is_empty() {
            return Err(StatsError::Empty("values"));
        }
        self.stratified(&TaskScores::of_one_task(values)?, aggregate::mean)
    }

    /// The interval of each of `values`, from the corresponding values of `resample`.
    fn percentiles(
        &self,
        values: Vec<f64>,
        mut resample: impl FnMut(&mut ChaCha8Rng) -> Vec<f64>,
    ) -> Result<Vec<Estimate>> {
        check_confidence(self.confidence)?;
        if self.resamples == 0 {
            return Err(StatsError::Resamples);
        }
        let mut stream = ChaCha8Rng::seed_from_u64(self.seed);
        let mut columns = vec![Vec::with_capacity(self.resamples as usize); values.len()];
        for _ in 0..self.resamples {
            for (column, value) in columns.iter_mut().zip(resample(&mut stream)) {
                column.push(value);
            }
        }
        let tail = (1.0 - self.confidence) / 2.0;
        let interval = |(value, mut column): (f64, Vec<f64>)| {
            column.sort_unstable_by(f64::total_cmp);
            Estimate { value, lower: quantile(&column, tail), upper: quantile(&column, 1.0 - tail) }
        };
        Ok(values.into_iter().zip(columns).map(interval).collect())
    }

    /// The estimate of a single statistic.
    fn only(&self, estimates: Vec<Estimate>) -> Result<Estimate> {
        estimates.into_iter().next().ok_or(StatsError::Empty("statistics"))
    }
}

/// Checks that a level is strictly between 0 and 1 (NaN is not).
pub(super) fn check_confidence(level: f64) -> Result<()> {
    if level > 0.0 && level < 1.0 { Ok(()) } else { Err(StatsError::Confidence(level)) }
}

/// Quantile of sorted values, interpolated linearly between the two nearest, as in numpy.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let place = q * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::super::aggregate::tests::{check, two_methods};
    use super::*;

    #[test]
    fn quantiles_are_interpolated() {
        // numpy.percentile([1, 2, 4, 8], [2.5, 97.5])
        check(quantile(&[1.0, 2.0, 4.0, 8.0], 0.025), 1.075);
        check(quantile(&[1.0, 2.0, 4.0, 8.0], 0.975), 7.7);
        check(quantile(&[3.0], 0.975), 3.0);
    }

    #[test]
    fn intervals_agree_with_rliable_within_resampling_error() {
        let (x, _) = two_methods();
        let bootstrap = Bootstrap { resamples: 20_000, ..Default::default() };
        let near = |statistic: fn(&TaskScores) -> f64, lower: f64, upper: f64| {
            let estimate = bootstrap.stratified(&x, statistic).unwrap();
            assert_eq!(estimate.value, statistic(&x));
            // rliable's own bounds, from 50 000 resamples, differ by 0.001 between seeds.
            assert!((estimate.lower - lower).abs() < 0.004, "{estimate:?} {lower}");
            assert!((estimate.upper - upper).abs() < 0.004, "{estimate:?} {upper}");
        };
        near(aggregate::mean, 0.5486, 0.6876);
        near(aggregate::median, 0.5071, 0.7100);
        near(aggregate::iqm, 0.5382, 0.7091);
    }

    #[test]
    fn an_interval_depends_only_on_the_seed() {
        let (x, _) = two_methods();
        let with = |seed| Bootstrap { resamples: 100, seed, ..Default::default() }.stratified(&x, aggregate::iqm);
        assert_eq!(with(1), with(1));
        assert_ne!(with(1), with(2));
    }

    #[test]
    fn identical_scores_have_an_interval_of_zero_width() {
        let same = TaskScores::new(vec![vec![0.1; 6], vec![0.1; 3]]).unwrap();
        for statistic in [aggregate::mean, aggregate::median, aggregate::iqm] {
            let estimate = Bootstrap::default().stratified(&same, statistic).unwrap();
            assert_eq!((estimate.lower, estimate.upper), (estimate.value, estimate.value));
        }
        let hits = Bootstrap::default().mean(&[7.0]).unwrap();
        assert_eq!(hits, Estimate { value: 7.0, lower: 7.0, upper: 7.0 });
    }

    #[test]
    fn wrong_input_is_refused() {
        let bootstrap = Bootstrap::default();
        assert_eq!(bootstrap.mean(&[]), Err(StatsError::Empty("values")));
        assert!(matches!(bootstrap.mean(&[f64::NAN]), Err(StatsError::NotFinite { .. })));
        for confidence in [0.0, 1.0, 95.0, f64::NAN] {
            let result = Bootstrap { confidence, ..bootstrap }.mean(&[1.0]);
            assert!(matches!(result, Err(StatsError::Confidence(_))), "{confidence}");
        }
        let none = Bootstrap { resamples: 0, ..bootstrap };
        assert_eq!(none.mean(&[1.0]), Err(StatsError::Resamples));
    }
}
