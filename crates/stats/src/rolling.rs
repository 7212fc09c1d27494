//! Means over the last episodes.

use std::collections::VecDeque;
use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

/// Window of the paper's learning curves (figure 6): 100 episodes.
pub const WINDOW: NonZeroUsize = NonZeroUsize::new(100).unwrap();

/// Success rate over the last episodes, updated episode by episode. Serialisable as part of a training's state.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct RollingRate {
    recent: VecDeque<bool>,
}

impl RollingRate {
    /// Adds an episode and returns the rate over the last `window` episodes, or over all if there are fewer.
    pub fn push(&mut self, success: bool, window: NonZeroUsize) -> f64 {
        self.recent.push_back(success);
        if self.recent.len() > window.get() {
            self.recent.pop_front();
        }
        self.rate()
    }

    /// The rate over the latest episodes.
    pub fn rate(&self) -> f64 {
        let hits = self.recent.iter().filter(|&&success| success).count();
        hits as f64 / self.recent.len() as f64
    }
}

/// Success rate over the last `window` episodes after each episode; over all episodes at the start.
pub fn rolling_success(successes: &[bool], window: NonZeroUsize) -> Vec<f64> {
    let mut rate = RollingRate::default();
    successes.iter().map(|&success| rate.push(success, window)).collect()
}

/// Mean of the last `window` values after each value; of all values at the start. A NaN affects exactly the means
/// whose window contains it.
pub fn rolling_mean(values: &[f64], window: NonZeroUsize) -> Vec<f64> {
    let mean_to = |end: usize| {
        let recent = &values[end.saturating_sub(window.get())..end];
        recent.iter().sum::<f64>() / recent.len() as f64
    };
    (1..=values.len()).map(mean_to).collect()
}

/// For each finite value the mean of the finite ones among it and those before it, `width` in all.
pub fn finite_means(values: &[f32], width: usize) -> impl Iterator<Item = f32> {
    values.iter().enumerate().map(move |(index, value)| {
        let recent = values[(index + 1).saturating_sub(width)..=index].iter().filter(|value| value.is_finite());
        let (sum, count) = recent.fold((0.0, 0u32), |(sum, count), value| (sum + f64::from(*value), count + 1));
        if value.is_finite() { (sum / f64::from(count)) as f32 } else { f32::NAN }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(episodes: usize) -> NonZeroUsize {
        NonZeroUsize::new(episodes).unwrap()
    }

    #[test]
    fn the_window_grows_and_then_moves() {
        let successes = [true, false, false, true, true];
        let rates = rolling_success(&successes, window(2));
        assert_eq!(rates, [1.0, 0.5, 0.0, 0.5, 1.0]);
        let values: Vec<f64> = successes.iter().map(|&s| f64::from(u8::from(s))).collect();
        assert_eq!(rolling_mean(&values, window(2)), rates);
        assert_eq!(rolling_success(&successes, window(9))[4], 0.6);
        assert!(rolling_success(&[], WINDOW).is_empty() && rolling_mean(&[], WINDOW).is_empty());
    }

    #[test]
    fn a_nan_leaves_with_the_window() {
        let means = rolling_mean(&[1.0, f64::NAN, 3.0, 5.0], window(2));
        assert_eq!(means.iter().map(|mean| mean.is_nan()).collect::<Vec<_>>(), [false, true, true, false]);
        assert_eq!(means[3], 4.0);
    }

    #[test]
    fn a_restored_rate_continues() {
        let mut rate = RollingRate::default();
        for success in [true, true, false] {
            rate.push(success, window(3));
        }
        let text = serde_json::to_string(&rate).unwrap();
        let mut restored: RollingRate = serde_json::from_str(&text).unwrap();
        assert_eq!(restored.push(false, window(3)), rate.push(false, window(3)));
        assert_eq!(restored, rate);
    }
}
