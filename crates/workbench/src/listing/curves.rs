//! The curves of a run: one value per episode for every metric that is drawn.

use std::borrow::Cow;

use mge_figures::Against;
use mge_run::{EpisodeRecord, Metric};

/// One value per episode for every metric that is drawn, or drawn against; NaN where there is none. The episodes of a long run
/// may be thinned.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    episodes: Vec<u64>,
    values: [Vec<f32>; Metric::KEPT.len()],
}

impl Curves {
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

    /// The numbers of actions after each of [`Curves::episodes`]; of episodes for [`Against::Episodes`].
    pub fn positions(&self, against: Against) -> Cow<'_, [u64]> {
        let metric = match against {
            Against::Episodes => return Cow::Borrowed(&self.episodes),
            Against::Actions => Metric::EnvironmentSteps,
            Against::Charged => Metric::ChargedActions,
        };
        self.get(metric).iter().map(|actions| *actions as u64).collect()
    }

    /// The number of the last episode; 0 if there is none.
    pub fn last_episode(&self) -> usize {
        self.episodes.last().map_or(0, |episode| *episode as usize)
    }

    /// Adds an episode: a value for each metric, in the order of [`Metric::KEPT`].
    pub fn push(&mut self, episode: u64, values: [f32; Metric::KEPT.len()]) {
        self.episodes.push(episode);
        for (curve, value) in self.values.iter_mut().zip(values) {
            curve.push(value);
        }
    }

    /// Whether the curves cover exactly these episodes. It is enough to compare the number and the last, because
    /// the episodes of a run are only appended, cut from the end, or thinned.
    pub fn is_of(&self, records: &[EpisodeRecord]) -> bool {
        self.episodes.len() == records.len() && self.episodes.last().copied() == records.last().map(|last| last.episode)
    }

    /// Appends the episodes that were added to a run; rebuilds the curves if earlier ones were removed.
    pub fn follow(&mut self, records: &[EpisodeRecord]) {
        // The last episode of a thinned series may have been replaced by a later one.
        let kept = self.episodes.len().min(records.len());
        let kept = (kept.saturating_sub(1)..=kept).rev().find(|&count| {
            let last = count.checked_sub(1);
            last.is_none_or(|last| self.episodes[last] == records[last].episode)
        });
        self.truncate(kept.unwrap_or(0));
        for record in &records[self.episodes.len()..] {
            self.push(record.episode, Metric::KEPT.map(|metric| metric.of(record) as f32));
        }
    }

    fn truncate(&mut self, count: usize) {
        if count < self.episodes.len() {
            self.episodes.truncate(count);
            self.values.iter_mut().for_each(|curve| curve.truncate(count));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use mge_run::Series;

    #[test]
    fn curves_can_be_drawn_against_actions() {
        let record = |episode| EpisodeRecord {
            episode,
            environment_steps: 10 * episode,
            charged_actions: Some(500 + 10 * episode),
            ..EpisodeRecord::default()
        };
        let mut curves = Curves::default();
        curves.follow(&[record(1), record(2)]);
        let positions =
            [Against::Episodes, Against::Actions, Against::Charged].map(|against| curves.positions(against));
        assert_eq!(positions.each_ref().map(|x| &**x), [[1, 2], [10, 20], [510, 520]]);
    }

    #[test]
    fn curves_follow_a_run_that_is_thinned_cut_and_restarted() {
        let mut records = Series::bounded(NonZeroUsize::new(8).unwrap());
        let mut curves = Curves::default();
        let mut follow = |records: &[EpisodeRecord]| {
            curves.follow(records);
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
