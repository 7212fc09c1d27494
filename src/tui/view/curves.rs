//! The curves of a run: one value an episode for every metric that is drawn.

use crate::run::{EpisodeRecord, Metric};

/// One value an episode for every metric; NaN where there is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    values: [Vec<f32>; Metric::CURVES.len()],
}

impl Curves {
    /// The values of a metric, the first episode first; none for one without a curve.
    pub fn get(&self, metric: Metric) -> &[f32] {
        let place = Metric::CURVES.iter().position(|drawn| *drawn == metric);
        place.map_or(&[], |place| &self.values[place])
    }

    /// Adds an episode: a value for each metric, in the order of [`Metric::CURVES`].
    pub fn push(&mut self, values: [f32; Metric::CURVES.len()]) {
        for (curve, value) in self.values.iter_mut().zip(values) {
            curve.push(value);
        }
    }

    /// Adds a finished episode.
    pub fn push_record(&mut self, record: &EpisodeRecord) {
        self.push(Metric::CURVES.map(|metric| metric.of(record) as f32));
    }

    /// Forgets all but the first `episodes` episodes.
    pub fn truncate(&mut self, episodes: usize) {
        self.values.iter_mut().for_each(|curve| curve.truncate(episodes));
    }

    /// Episodes.
    pub fn episodes(&self) -> usize {
        self.values[0].len()
    }
}
