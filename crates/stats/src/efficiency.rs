//! Sample efficiency: how fast and how well a run learned.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use super::rolling::rolling_success;

/// Five numbers that summarise a run's learning. A threshold that was never reached is `None`, `null` in JSON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Efficiency {
    /// Episodes until half of the last `window` reached the goal.
    pub episodes_to_50: Option<u64>,
    /// Episodes until 80 % of the last `window` reached the goal.
    pub episodes_to_80: Option<u64>,
    /// Mean height of the rolling success curve, in [0, 1].
    pub auc: Option<f64>,
    /// Success rate over the last `window` episodes.
    pub final_success: Option<f64>,
    /// Lowest rolling success rate over the last quarter of the episodes: the level that the run holds, in contrast
    /// to the thresholds it reached at some time.
    #[serde(default)]
    pub held_success: Option<f64>,
}

/// The five numbers of a run, given whether each of its episodes reached the goal.
pub fn efficiency(successes: &[bool], window: NonZeroUsize) -> Efficiency {
    let curve = rolling_success(successes, window);
    Efficiency {
        episodes_to_50: episodes_to_threshold(&curve, window, 0.5),
        episodes_to_80: episodes_to_threshold(&curve, window, 0.8),
        auc: area_under_curve(&curve),
        final_success: curve.last().copied(),
        held_success: curve[curve.len() - curve.len().div_ceil(4)..].iter().copied().min_by(f64::total_cmp),
    }
}

/// Number of episodes after which a curve of the rolling success rate first is at least `threshold`; `None` if it never
/// is. Only full windows count, otherwise a single lucky first episode would be 100 %.
fn episodes_to_threshold(curve: &[f64], window: NonZeroUsize, threshold: f64) -> Option<u64> {
    let full = window.get() - 1;
    let after = curve.iter().skip(full).position(|&rate| rate >= threshold)?;
    Some((full + after + 1) as u64)
}

/// Area under a learning curve divided by its length: the mean height. `None` if it has no points.
pub fn area_under_curve(curve: &[f64]) -> Option<f64> {
    (!curve.is_empty()).then(|| curve.iter().sum::<f64>() / curve.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: NonZeroUsize = NonZeroUsize::new(4).unwrap();

    #[test]
    fn thresholds_count_from_the_first_full_window() {
        let successes = [true, false, false, false, true, true, true, true];
        let to = |threshold| episodes_to_threshold(&rolling_success(&successes, WINDOW), WINDOW, threshold);
        assert_eq!(to(0.25), Some(4));
        assert_eq!(to(0.5), Some(6));
        assert_eq!(to(1.0), Some(8));
        assert_eq!(to(1.1), None);
        assert_eq!(to(f64::NAN), None);
        assert_eq!(episodes_to_threshold(&[1.0; 3], WINDOW, 0.5), None);
        assert_eq!(episodes_to_threshold(&[1.0; 4], WINDOW, 0.5), Some(4));
    }

    #[test]
    fn a_run_in_five_numbers() {
        let successes = [false, false, true, true, true, true];
        let found = efficiency(&successes, WINDOW);
        assert_eq!(found.episodes_to_50, Some(4));
        assert_eq!(found.episodes_to_80, Some(6));
        assert_eq!(found.final_success, Some(1.0));
        // The last quarter of six episodes is the last two.
        assert_eq!(found.held_success, Some(0.75));
        let fallen = efficiency(&[true, true, true, true, true, true, true, false], WINDOW);
        assert_eq!((fallen.episodes_to_80, fallen.held_success), (Some(4), Some(0.75)));
        let before = efficiency(&[true, true, false, false, true, true, true, true], WINDOW);
        assert_eq!((before.auc.map(|auc| auc < 0.8), before.held_success), (Some(true), Some(0.75)));
        let auc = (0.0 + 0.0 + 1.0 / 3.0 + 0.5 + 0.75 + 1.0) / 6.0;
        assert!((found.auc.unwrap() - auc).abs() < 1e-15);
    }

    #[test]
    fn without_episodes_all_numbers_are_null() {
        let none = efficiency(&[], WINDOW);
        let text = serde_json::to_string(&none).unwrap();
        assert_eq!(
            text,
            r#"{"episodes_to_50":null,"episodes_to_80":null,"auc":null,"final_success":null,"held_success":null}"#
        );
    }
}
