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

/// Least seconds of training over which its pace is measured.
const LEAST: f64 = 1.0;

/// One value per episode for every metric that is drawn, or drawn against; NaN where there is none. The episodes of a long run
/// may be thinned.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    episodes: Vec<u64>,
    /// Seconds of training at the end of each episode.
    pub(super) seconds: Vec<f32>,
    values: [Vec<f32>; Metric::KEPT.len()],
}

impl Curves {
    /// The curves of these episodes, given the times at their ends.
    pub fn of(records: &[EpisodeRecord], times: &[TrainingTime]) -> Self {
        let mut curves = Self::default();
        for (place, record) in records.iter().enumerate() {
            let seconds = times.get(place).map_or(0.0, |time| time.seconds as f32);
            curves.push(record.episode, seconds, Metric::KEPT.map(|metric| metric.of(record) as f32));
        }
        curves
    }

    /// The values of a metric, one for each of [`Curves::episodes`]; empty for a metric without a curve.
    pub fn get(&self, metric: Metric) -> &[f32] {
        let index = Metric::KEPT.iter().position(|drawn| *drawn == metric);
        index.map_or(&[], |index| &self.values[index])
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

    /// Episodes per second in the latest quarter of the episodes. None if that is too short.
    pub fn pace(&self) -> Option<f64> {
        let last = self.last_episode() as u64;
        let [episodes, seconds] = self.between(XAxis::Episodes, last - last / 4, last)?;
        (seconds >= LEAST).then(|| episodes / seconds)
    }

    /// The number of the episodes between two places on an axis, and the seconds that they took.
    pub(super) fn between(&self, axis: XAxis, first: u64, last: u64) -> Option<[f64; 2]> {
        let places = self.positions(axis);
        let [first, last] = [first, last].map(|place| places.partition_point(|other| *other < place));
        let seconds = f64::from(self.seconds.get(last)? - self.seconds.get(first)?);
        Some([(self.episodes[last] - self.episodes[first]) as f64, seconds]).filter(|_| first < last)
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
        self.values.iter_mut().zip(values).for_each(|(curve, value)| curve.push(value));
    }

    /// Whether the curves cover exactly these episodes. It is enough to compare the number and the last, because
    /// the episodes of a run are only appended, cut from the end, or thinned.
    pub fn is_of(&self, records: &[EpisodeRecord]) -> bool {
        self.episodes.len() == records.len() && self.episodes.last().copied() == records.last().map(|last| last.episode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_can_be_drawn_against_actions_and_time() {
        let record = |episode| EpisodeRecord {
            episode,
            environment_steps: 10 * episode,
            charged_actions: Some(500 + 10 * episode),
            ..EpisodeRecord::default()
        };
        let times = [1.5, 2.0].map(|seconds| TrainingTime { episode: 0, seconds });
        let curves = Curves::of(&[record(1), record(2)], &times);
        let positions = XAxis::ALL.map(|axis| curves.positions(axis));
        assert_eq!(positions.each_ref().map(|x| &**x), [[1, 2], [10, 20], [510, 520], [1500, 2000]]);
    }

    #[test]
    fn curves_are_of_the_episodes_they_were_made_of() {
        let record = |episode| EpisodeRecord { episode, return_: episode as f32, ..EpisodeRecord::default() };
        let records: Vec<EpisodeRecord> = (1..=100).map(record).collect();
        let curves = Curves::of(&records, &[]);
        assert_eq!((curves.last_episode(), curves.at(Metric::Return, 7)), (100, Some(7.0)));
        assert!(curves.is_of(&records) && !curves.is_of(&records[1..]), "episodes are missing");
    }
}
