//! Rates, and times in text form.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The rate of a counter over the latest seconds.
#[derive(Debug, Default)]
pub struct Rate {
    counts: VecDeque<(Instant, u64)>,
}

/// The period over which the rate is measured.
const WINDOW: Duration = Duration::from_secs(20);
/// Minimum period for a rate to be known.
const WARM_UP: Duration = Duration::from_secs(2);

impl Rate {
    /// Records a count at a time.
    pub fn record(&mut self, now: Instant, count: u64) {
        if self.counts.back().is_some_and(|(_, last)| *last > count) {
            self.counts.clear();
        }
        let spaced = |(at, _): &(Instant, u64)| now.duration_since(*at) >= Duration::from_millis(200);
        if self.counts.back().is_none_or(spaced) {
            self.counts.push_back((now, count));
        }
        while self.counts.front().is_some_and(|(at, _)| now.duration_since(*at) > WINDOW) {
            self.counts.pop_front();
        }
    }

    /// Starts again, as after a pause.
    pub fn forget(&mut self) {
        self.counts.clear();
    }

    /// Counts per second; None until there is enough data.
    pub fn per_second(&self) -> Option<f64> {
        let ((from, first), (to, last)) = (self.counts.front()?, self.counts.back()?);
        let time = to.duration_since(*from);
        (time >= WARM_UP && last > first).then(|| (last - first) as f64 / time.as_secs_f64())
    }
}

/// A span of time as `12 s`, `3:05` or `1:02:30`.
pub fn span(seconds: f64) -> String {
    let seconds = seconds.clamp(0.0, 3.6e6).round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_shown_after_the_warm_up_and_follows_the_latest_seconds() {
        let start = Instant::now();
        let mut rate = Rate::default();
        let mut run = |from: u64, to: u64, per_second: u64| {
            for second in from..to {
                rate.record(start + Duration::from_secs(second), 1000 + second * per_second);
            }
            rate.per_second()
        };
        assert_eq!(run(0, 2, 10), None);
        assert_eq!(run(2, 10, 10), Some(10.0));
        rate.record(start + Duration::from_secs(11), 0);
        assert_eq!(rate.per_second(), None, "a count that decreases starts the rate again");
    }

    #[test]
    fn a_rate_needs_progress_and_covers_only_the_counts_of_one_process() {
        let start = Instant::now();
        let rate = |counts: &[(u64, u64)]| {
            let mut rate = Rate::default();
            counts.iter().for_each(|(second, count)| rate.record(start + Duration::from_secs(*second), *count));
            rate.per_second()
        };
        assert_eq!(rate(&[(0, 7), (5, 7)]), None);
        assert_eq!(rate(&[(0, 0), (2, 10), (3, 10), (4, 40)]), Some(10.0), "a pause between two episodes counts");
        assert_eq!(rate(&[(0, 100), (5, 0), (10, 150)]), Some(30.0), "it began again");
        assert_eq!(rate(&[(0, 0), (30, 1000), (33, 1030)]), Some(10.0), "long ago");
    }

    #[test]
    fn spans_are_written_for_people() {
        assert_eq!((span(12.3), span(185.0), span(3750.0)), ("12 s".into(), "3:05".into(), "1:02:30".into()));
    }

    #[test]
    fn old_counts_and_counts_before_a_pause_are_forgotten() {
        let start = Instant::now();
        let mut rate = Rate::default();
        (0..60).for_each(|second| rate.record(start + Duration::from_secs(second), 10 * second));
        (60..90).for_each(|second| rate.record(start + Duration::from_secs(second), 600 + 20 * (second - 60)));
        assert_eq!(rate.per_second(), Some(20.0));
        rate.forget();
        assert_eq!(rate.per_second(), None);
    }
}
