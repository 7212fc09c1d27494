//! The curves of a run: one value per episode for every metric that is drawn.

use std::borrow::Cow;

use mge_run::{EpisodeRecord, Metric, TrainingTime};

/// What curves are drawn against.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum XAxis {
    /// Episodes.
    #[default]
    Episodes,
    /// Actions of episodes and practice.
    Actions,
    /// All actions that the run is charged for.
    Charged,
    /// The time of training: see [`TrainingTime`].
    Time,
}

mge_base::names!(XAxis {
    Episodes = "episodes", Actions = "actions", Charged = "charged actions", Time = "time of training"
});

/// Seconds of training over which its pace is measured, and the least of them.
const LATEST: f32 = 60.0;
const LEAST: f64 = 1.0;

/// One value per episode for every metric that is drawn, or drawn against; NaN where there is none. The episodes of a long run
/// may be thinned.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    episodes: Vec<u64>,
    /// Seconds of training at the end of each episode.
    pub(super) seconds: Vec<f32>,
    values: [Vec<f32>; Metric::KEPT.len()],
    /// The least and the greatest finite value of each metric.
    ranges: [Option<[f32; 2]>; Metric::KEPT.len()],
}

impl Curves {
    /// The values of a metric, one for each of [`Curves::episodes`]; empty for a metric without a curve.
    pub fn get(&self, metric: Metric) -> &[f32] {
        let index = Metric::KEPT.iter().position(|drawn| *drawn == metric);
        index.map_or(&[], |index| &self.values[index])
    }

    /// The least and the greatest finite value of a metric; None if there is none.
    pub fn range(&self, metric: Metric) -> Option<[f32; 2]> {
        self.ranges[Metric::KEPT.iter().position(|drawn| *drawn == metric)?]
    }

    /// The value of a metric at an episode, or at the next one that is kept.
    pub fn at(&self, metric: Metric, episode: u64) -> Option<f32> {
        self.get(metric).get(self.episodes.partition_point(|known| *known < episode)).copied()
    }

    /// The numbers of the episodes, in order.
    pub fn episodes(&self) -> &[u64] {
        &self.episodes
    }

    /// Where each of [`Curves::episodes`] is on an axis, in order: numbers of episodes or actions, or milliseconds.
    pub fn positions(&self, axis: XAxis) -> Cow<'_, [u64]> {
        let (values, unit) = match axis {
            XAxis::Episodes => return Cow::Borrowed(&self.episodes),
            XAxis::Actions => (self.get(Metric::EnvironmentSteps), 1.0),
            XAxis::Charged => (self.get(Metric::ChargedActions), 1.0),
            XAxis::Time => (&*self.seconds, 1000.0),
        };
        // The mean of a group falls where its longest run ends.
        let mut furthest = 0;
        let ordered = values.iter().map(|value| {
            furthest = furthest.max((unit * value) as u64);
            furthest
        });
        ordered.collect()
    }

    /// Where an episode is on an axis: that of the next one kept, or beyond the last as if the run went on as in its
    /// latest quarter. None without episodes.
    pub fn expected(&self, axis: XAxis, episode: u64) -> Option<f64> {
        let positions = self.positions(axis);
        let last = positions.len().checked_sub(1)?;
        let place = self.episodes.partition_point(|known| *known < episode);
        if let Some(position) = positions.get(place) {
            return Some(*position as f64);
        }
        let first = last - last / 4;
        let per_episode =
            (positions[last] - positions[first]) as f64 / (self.episodes[last] - self.episodes[first]).max(1) as f64;
        Some(positions[last] as f64 + per_episode * (episode - self.episodes[last]) as f64)
    }

    /// Episodes per second in the latest quarter of the episodes, of which the last minute counts. An agent needs less
    /// time for an episode the more it has learned. None if that quarter is too short.
    pub fn pace(&self) -> Option<f64> {
        let (last, end) = (self.episodes.len().checked_sub(1)?, *self.seconds.last()?);
        let recent = self.seconds.partition_point(|at| *at < end - LATEST);
        let first = recent.min(last).max(last - last / 4);
        let time = f64::from(end - self.seconds[first]);
        (time >= LEAST).then(|| (self.episodes[last] - self.episodes[first]) as f64 / time)
    }

    /// The number of the last episode; 0 if there is none.
    pub fn last_episode(&self) -> usize {
        self.episodes.last().map_or(0, |episode| *episode as usize)
    }

    /// Adds an episode: the seconds of training at its end, and a value for each metric, in the order of
    /// [`Metric::KEPT`].
    pub fn push(&mut self, episode: u64, seconds: f32, values: [f32; Metric::KEPT.len()]) {
        self.episodes.push(episode);
        self.seconds.push(seconds);
        for ((curve, range), value) in self.values.iter_mut().zip(&mut self.ranges).zip(values) {
            curve.push(value);
            widen(range, value);
        }
    }

    /// Whether the curves cover exactly these episodes. It is enough to compare the number and the last, because
    /// the episodes of a run are only appended, cut from the end, or thinned.
    pub fn is_of(&self, records: &[EpisodeRecord]) -> bool {
        self.episodes.len() == records.len() && self.episodes.last().copied() == records.last().map(|last| last.episode)
    }

    /// Appends the episodes that were added to a run; rebuilds the curves if earlier ones were removed.
    pub fn follow(&mut self, records: &[EpisodeRecord], times: &[TrainingTime]) {
        // The last episode of a thinned series may have been replaced by a later one.
        let kept = self.episodes.len().min(records.len());
        let kept = (kept.saturating_sub(1)..=kept).rev().find(|&count| {
            let last = count.checked_sub(1);
            last.is_none_or(|last| self.episodes[last] == records[last].episode)
        });
        self.truncate(kept.unwrap_or(0));
        for (place, record) in records.iter().enumerate().skip(self.episodes.len()) {
            let seconds = times.get(place).map_or(0.0, |time| time.seconds as f32);
            self.push(record.episode, seconds, Metric::KEPT.map(|metric| metric.of(record) as f32));
        }
    }

    fn truncate(&mut self, count: usize) {
        if count < self.episodes.len() {
            self.episodes.truncate(count);
            self.seconds.truncate(count);
            for (curve, range) in self.values.iter_mut().zip(&mut self.ranges) {
                curve.truncate(count);
                *range = None;
                curve.iter().for_each(|value| widen(range, *value));
            }
        }
    }
}

/// Widens a range so that it includes a value, if that is finite.
fn widen(range: &mut Option<[f32; 2]>, value: f32) {
    if value.is_finite() {
        let [low, high] = range.unwrap_or([value; 2]);
        *range = Some([low.min(value), high.max(value)]);
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use mge_run::Series;

    #[test]
    fn curves_can_be_drawn_against_actions_and_time() {
        let record = |episode| EpisodeRecord {
            episode,
            environment_steps: 10 * episode,
            charged_actions: Some(500 + 10 * episode),
            ..EpisodeRecord::default()
        };
        let mut curves = Curves::default();
        curves.follow(&[record(1), record(2)], &[1.5, 2.0].map(|seconds| TrainingTime { episode: 0, seconds }));
        let positions = XAxis::ALL.map(|axis| curves.positions(axis));
        assert_eq!(positions.each_ref().map(|x| &**x), [[1, 2], [10, 20], [510, 520], [1500, 2000]]);
    }

    #[test]
    fn curves_follow_a_run_that_is_thinned_cut_and_restarted() {
        let mut records = Series::bounded(NonZeroUsize::new(8).unwrap());
        let mut curves = Curves::default();
        let mut follow = |records: &[EpisodeRecord]| {
            curves.follow(records, &[]);
            let episodes: Vec<u64> = records.iter().map(|record| record.episode).collect();
            let returns: Vec<f32> = records.iter().map(|record| record.return_).collect();
            assert_eq!((curves.episodes(), curves.get(Metric::Return)), (&episodes[..], &returns[..]));
            assert_eq!(curves.last_episode() as u64, episodes.last().copied().unwrap_or(0));
            assert_eq!(curves.at(Metric::Return, 1), returns.first().copied(), "or the value of the next one");
            assert!(curves.is_of(records));
            if let [_, later @ ..] = records {
                assert!(!curves.is_of(later), "episodes are missing");
            }
        };
        for episode in 1..=100 {
            records.push(EpisodeRecord { episode, return_: episode as f32, ..EpisodeRecord::default() });
            if episode % 3 != 0 {
                follow(&records);
            }
        }
        records.truncate(50);
        follow(&records);
        follow(&[]);
    }
}
