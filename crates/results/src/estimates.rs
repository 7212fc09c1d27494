//! The points of learning curves with their intervals, cached while only the style of a figure changes.

use std::collections::HashMap;
use std::sync::Mutex;

use sha2::{Digest, Sha256};

use mge_base::sync::lock;
use mge_stats::aggregate::iqm;
use mge_stats::{Bootstrap, Estimate, StatsError, TaskScores};

/// A source of the points of a curve over seeds, with their intervals.
pub trait CurveEstimates {
    /// The interquartile mean over the seeds, with its interval, at each point that all of them have.
    ///
    /// # Errors
    /// When a statistic cannot be computed.
    fn of(&self, seeds: &[&[[f64; 2]]]) -> Result<Vec<Estimate>, StatsError>;
}

/// Computes the estimates without a cache.
impl CurveEstimates for Bootstrap {
    fn of(&self, seeds: &[&[[f64; 2]]]) -> Result<Vec<Estimate>, StatsError> {
        let estimate = |point: usize| {
            let values: Vec<f64> = seeds.iter().map(|seed| seed[point][1]).collect();
            self.stratified(&TaskScores::of_one_task(&values)?, iqm)
        };
        (0..points(seeds)).map(estimate).collect()
    }
}

/// The number of points that all seeds have.
pub fn points(seeds: &[&[[f64; 2]]]) -> usize {
    seeds.iter().map(|seed| seed.len()).min().unwrap_or(0)
}

/// Maximum number of cached points of curves.
const MAX_KEPT: usize = 10_000;

/// A cache of estimates by curve: a figure is redrawn often while it is composed, and resampling takes most of its
/// time.
#[derive(Debug, Default)]
pub struct KnownEstimates {
    bootstrap: Bootstrap,
    /// The estimates of every curve by the hash of its values.
    known: Mutex<HashMap<[u8; 32], Vec<Estimate>>>,
}

impl KnownEstimates {
    /// Number of cached curves.
    pub fn count(&self) -> usize {
        lock(&self.known).len()
    }
}

impl CurveEstimates for KnownEstimates {
    fn of(&self, seeds: &[&[[f64; 2]]]) -> Result<Vec<Estimate>, StatsError> {
        let key = hash(seeds);
        let known = || lock(&self.known);
        if let Some(estimates) = known().get(&key) {
            return Ok(estimates.clone());
        }
        // Computed without holding the lock.
        let estimates = self.bootstrap.of(seeds)?;
        let mut known = known();
        if known.values().map(Vec::len).sum::<usize>() + estimates.len() > MAX_KEPT {
            known.clear();
        }
        known.insert(key, estimates.clone());
        Ok(estimates)
    }
}

/// The hash of the values of each seed, on which the estimates depend.
fn hash(seeds: &[&[[f64; 2]]]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for seed in seeds {
        hash.update((seed.len() as u64).to_le_bytes());
        seed.iter().for_each(|[_, value]| hash.update(value.to_le_bytes()));
    }
    hash.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_values_are_resampled_once_with_the_same_result() {
        let known = KnownEstimates::default();
        let seeds = [vec![[1.0, 0.0], [2.0, 0.5], [3.0, 1.0]], vec![[1.0, 0.25], [2.0, 1.0]]];
        let seeds = seeds.each_ref().map(Vec::as_slice);
        let first = known.of(&seeds).unwrap();
        assert_eq!(first, Bootstrap::default().of(&seeds).unwrap());
        assert_eq!((first.len(), known.count()), (2, 1), "as far as the shorter one");
        assert_eq!((known.of(&seeds).unwrap(), known.count()), (first, 1));
        known.of(&seeds[..1]).unwrap();
        assert_eq!(known.count(), 2);
    }

    #[test]
    fn a_limited_number_of_points_is_kept() {
        let known = KnownEstimates::default();
        let counts = [0.1, 0.2, 0.3].map(|value| {
            known.of(&[&vec![[1.0, value]; MAX_KEPT / 2]]).unwrap();
            known.count()
        });
        assert_eq!(counts, [1, 2, 1]);
    }
}
