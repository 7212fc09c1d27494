//! Series of values over the episodes of a run, complete or evenly thinned.

use std::num::NonZeroUsize;
use std::ops::Deref;

/// A value that belongs to an episode.
pub trait Numbered {
    /// The number of the episode, from 1.
    fn episode(&self) -> u64;
}

/// Values in the order of their episodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Series<T> {
    values: Vec<T>,
    /// Values of episodes that are multiples of this are kept, and the latest value.
    every: u64,
    most: Option<NonZeroUsize>,
}

impl<T> Default for Series<T> {
    /// A series of unlimited length.
    fn default() -> Self {
        Self { values: Vec::new(), every: 1, most: None }
    }
}

impl<T> Deref for Series<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

impl<T: Numbered> Series<T> {
    /// A series that keeps at most `most` values. When there are more, only those of every second episode
    /// are kept, then of every fourth, and so on, and always the latest. The choice depends only on the
    /// added episodes.
    pub fn bounded(most: NonZeroUsize) -> Self {
        Self { most: Some(most), ..Self::default() }
    }

    /// Adds the value of a later episode.
    pub fn push(&mut self, value: T) {
        if self.values.last().is_some_and(|latest| !latest.episode().is_multiple_of(self.every)) {
            self.values.pop();
        }
        self.values.push(value);
        while self.most.is_some_and(|most| self.values.len() > most.get()) {
            let Some(every) = self.every.checked_mul(2) else {
                // Only possible with wrong episode numbers in a log.
                self.values.remove(0);
                continue;
            };
            self.every = every;
            let mut left = self.values.len();
            self.values.retain(|value| {
                left -= 1;
                left == 0 || value.episode().is_multiple_of(self.every)
            });
        }
    }

    /// Removes the values after an episode.
    pub fn truncate(&mut self, episode: u64) {
        self.values.retain(|value| value.episode() <= episode);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Numbered for u64 {
        fn episode(&self) -> u64 {
            *self
        }
    }

    fn bounded(most: usize, episodes: impl IntoIterator<Item = u64>) -> Vec<u64> {
        let mut series = Series::bounded(NonZeroUsize::new(most).unwrap());
        episodes.into_iter().for_each(|episode| series.push(episode));
        series.to_vec()
    }

    #[test]
    fn a_long_series_is_thinned_evenly_and_ends_with_the_latest() {
        assert_eq!(bounded(4, 1..=4), [1, 2, 3, 4]);
        assert_eq!(bounded(4, 1..=5), [2, 4, 5]);
        assert_eq!(bounded(4, 1..=7), [2, 4, 6, 7]);
        assert_eq!(bounded(4, 1..=9), [4, 8, 9]);
        assert_eq!(bounded(4, (1..=9).map(|number| 50 * number)), [200, 400, 450], "evaluations");
        assert_eq!(bounded(1, 1..=9), [9]);
        for wrong in [0, 6, u64::MAX] {
            assert!(bounded(4, [wrong; 99]).len() <= 4);
        }
        for count in 1..2000 {
            let kept = bounded(64, 1..=count);
            assert!(kept.len() <= 64 && kept.len() as u64 >= count.min(32), "{} of {count}", kept.len());
        }
    }

    #[test]
    fn values_repeated_after_a_cut_are_kept_once() {
        let mut series = Series::bounded(NonZeroUsize::new(4).unwrap());
        (1..=7).for_each(|episode| series.push(episode));
        series.truncate(5);
        (6..=7).for_each(|episode| series.push(episode));
        assert_eq!(*series, [2, 4, 6, 7]);
        let mut all = Series::default();
        (1..=5000).for_each(|episode: u64| all.push(episode));
        assert_eq!(all.len(), 5000);
    }
}
