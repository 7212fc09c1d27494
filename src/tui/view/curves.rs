//! The curves of a run: one value an episode for every metric that is drawn.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::run::{EpisodeRecord, Metric};

/// One value an episode for every metric; NaN where there is none.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    values: [Vec<f32>; Metric::CURVES.len()],
    version: u64,
}

/// The latest version of any curves.
static LATEST: AtomicU64 = AtomicU64::new(0);

impl PartialEq for Curves {
    fn eq(&self, other: &Self) -> bool {
        self.values == other.values
    }
}

impl Curves {
    /// The values of a metric, the first episode first; none for one without a curve.
    pub fn get(&self, metric: Metric) -> &[f32] {
        let place = Metric::CURVES.iter().position(|drawn| *drawn == metric);
        place.map_or(&[], |place| &self.values[place])
    }

    /// Another number whenever the values are others; that of a copy is the same.
    pub fn version(&self) -> u64 {
        self.version
    }

    fn renew(&mut self) {
        self.version = LATEST.fetch_add(1, Ordering::Relaxed) + 1;
    }

    /// Adds an episode: a value for each metric, in the order of [`Metric::CURVES`].
    pub fn push(&mut self, values: [f32; Metric::CURVES.len()]) {
        for (curve, value) in self.values.iter_mut().zip(values) {
            curve.push(value);
        }
        self.renew();
    }

    /// Adds a finished episode.
    pub fn push_record(&mut self, record: &EpisodeRecord) {
        self.push(Metric::CURVES.map(|metric| metric.of(record) as f32));
    }

    /// Forgets all but the first `episodes` episodes.
    pub fn truncate(&mut self, episodes: usize) {
        self.values.iter_mut().for_each(|curve| curve.truncate(episodes));
        self.renew();
    }

    /// Episodes.
    pub fn episodes(&self) -> usize {
        self.values[0].len()
    }
}
