//! Confidence intervals by resampling: the stratified percentile bootstrap.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Deserializer, Serialize};

use super::aggregate;
use super::scores::TaskScores;
use super::{Result, StatsError};
use mge_base::streams::index;

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
    /// Lower end of the interval; NaN, `null` in files, if there is none.
    #[serde(deserialize_with = "number_or_null")]
    pub lower: f64,
    /// Upper end of the interval; NaN, `null` in files, if there is none.
    #[serde(deserialize_with = "number_or_null")]
    pub upper: f64,
}

fn number_or_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
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

    /// The value to so many decimals, with its interval if it has one.
    pub fn text(&self, digits: usize) -> String {
        let Self { value, lower, upper } = self;
        let interval =
            if self.has_interval() { format!(" [{lower:.digits$}, {upper:.digits$}]") } else { String::new() };
        format!("{value:.digits$}{interval}")
    }

    /// The value and both ends of the interval.
    pub fn values(&self) -> [f64; 3] {
        [self.value, self.lower, self.upper]
    }
}

impl Bootstrap {
    /// A statistic of all runs, such as [`aggregate::iqm`], with its interval: runs are drawn with replacement within
    /// each task, and the interval lies between two percentiles (interpolated linearly) of the resampled statistics. If
    /// no task has more than one run, tasks are drawn instead; a single run has no interval.
    ///
    /// # Errors
    /// [`StatsError::Confidence`] or [`StatsError::Resamples`]; the same for all methods below.
    pub fn stratified(&self, scores: &TaskScores, statistic: impl Fn(&TaskScores) -> f64) -> Result<Estimate> {
        self.percentiles([scores], |[scores]| statistic(scores))
    }

    /// A statistic of two methods, whose runs are resampled independently.
    ///
    /// # Errors
    /// As [`Bootstrap::stratified`].
    pub fn stratified_pair(
        &self,
        x: &TaskScores,
        y: &TaskScores,
        statistic: impl Fn(&TaskScores, &TaskScores) -> f64,
    ) -> Result<Estimate> {
        self.percentiles([x, y], |[x, y]| statistic(x, y))
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

    /// The statistic, with the interval from those of resampled scores.
    fn percentiles<const N: usize>(
        &self,
        scores: [&TaskScores; N],
        statistic: impl Fn(&[TaskScores; N]) -> f64,
    ) -> Result<Estimate> {
        // NaN is not between them.
        if !(self.confidence > 0.0 && self.confidence < 1.0) {
            return Err(StatsError::Confidence(self.confidence));
        }
        if self.resamples == 0 {
            return Err(StatsError::Resamples);
        }
        let mut drawn = scores.map(Clone::clone);
        let value = statistic(&drawn);
        let are_single = scores.iter().flat_map(|scores| scores.tasks()).all(|runs| runs.len() == 1);
        let tasks = scores[0].tasks().len();
        if are_single && tasks == 1 {
            return Ok(Estimate::exact(value));
        }
        let mut stream = ChaCha8Rng::seed_from_u64(self.seed);
        let mut resampled = Vec::with_capacity(self.resamples as usize);
        for _ in 0..self.resamples {
            // The same tasks for all methods.
            let chosen = are_single.then(|| (0..tasks).map(|_| index(&mut stream, tasks)).collect::<Vec<_>>());
            for (scores, drawn) in scores.iter().zip(&mut drawn) {
                match &chosen {
                    Some(tasks) => scores.choose_into(drawn, tasks),
                    None => scores.resample_into(drawn, &mut stream),
                }
            }
            resampled.push(statistic(&drawn));
        }
        let tail = (1.0 - self.confidence) / 2.0;
        resampled.sort_unstable_by(f64::total_cmp);
        Ok(Estimate { value, lower: quantile(&resampled, tail), upper: quantile(&resampled, 1.0 - tail) })
    }
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
    }

    #[test]
    fn a_single_run_has_no_interval_and_single_runs_of_tasks_have_one_over_tasks() {
        let hits = Bootstrap::default().mean(&[7.0]).unwrap();
        assert!(hits.value == 7.0 && !hits.has_interval());
        let read: Estimate = serde_json::from_str(&serde_json::to_string(&hits).unwrap()).unwrap();
        assert!(read.value == 7.0 && !read.has_interval());
        let of = |scores: [f64; 4]| TaskScores::new(scores.map(|score| vec![score]).to_vec()).unwrap();
        let (x, y) = (of([0.1, 0.2, 0.6, 0.7]), of([0.0, 0.1, 0.5, 0.9]));
        let [over_tasks, of_runs] = [&x, &TaskScores::of_one_task(&[0.1, 0.2, 0.6, 0.7]).unwrap()]
            .map(|scores| Bootstrap::default().stratified(scores, aggregate::mean).unwrap());
        assert_eq!(over_tasks, of_runs, "a task with one run is drawn as a run is");
        let difference = |x: &TaskScores, y: &TaskScores| aggregate::mean(x) - aggregate::mean(y);
        let paired = Bootstrap::default().stratified_pair(&x, &y, difference).unwrap();
        check(paired.upper, 0.1);
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
