//! Reduces curves of any length to the columns of dots available.

use std::collections::VecDeque;

use super::axes::Scale;
use super::range::Window;

/// A [`Look`] as a cache key, with the bits of its numbers.
pub type LookKey = ([u32; 2], Scale, usize, u16);

/// How a curve is displayed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Episodes to show.
    pub x: Window,
    /// How values map to heights.
    pub scale: Scale,
    /// Number of episodes in the moving average of each value.
    pub smoothing: usize,
    /// Columns of dots.
    pub columns: u16,
}

/// The scaled values in one column of dots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Index of the column of dots.
    pub x: u16,
    /// Its first and last value.
    pub ends: [f32; 2],
    /// Its smallest and largest value.
    pub range: [f32; 2],
    /// Its last episode.
    pub last: u64,
    /// It is not connected to the previous column.
    pub after_gap: bool,
}

/// A curve reduced to columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decimated {
    /// Columns with values, from left to right. A gap within a column of dots splits it into two entries.
    pub columns: Vec<Column>,
    /// Smallest and largest value, if there are any.
    pub range: Option<[f32; 2]>,
}

impl Look {
    /// The cache key.
    pub fn key(&self) -> LookKey {
        ([self.x.from, self.x.to].map(f32::to_bits), self.scale, self.smoothing, self.columns)
    }

    /// Dots per episode.
    fn pace(&self) -> f32 {
        f32::from(self.columns.saturating_sub(1)) / (self.x.to - self.x.from).max(f32::EPSILON)
    }

    /// The column of an episode.
    fn column(&self, episode: u64) -> f32 {
        ((episode as f32 - self.x.from) * self.pace() + 0.5).floor()
    }

    /// The indices of the episodes to show.
    fn shown(&self, episodes: &[u64]) -> std::ops::Range<usize> {
        let first = place(episodes, self.x.from.floor().max(1.0) as u64);
        let end = place(episodes, self.x.to.ceil().max(0.0) as u64 + 1);
        first.min(end)..end
    }

    /// The smoothing window in values, which for thinned episodes is less than `smoothing`.
    fn width(&self, episodes: &[u64]) -> usize {
        let last = episodes.last().map_or(0, |last| *last as usize);
        (self.smoothing * episodes.len()).checked_div(last).unwrap_or(self.smoothing).max(1)
    }

    /// Reduces a curve, with one value per episode, to columns.
    pub fn decimate(&self, episodes: &[u64], values: &[f32]) -> Decimated {
        let shown = self.shown(episodes);
        let width = self.width(episodes);
        let mut smooth = Smoothing::new(width);
        // The means of the first visible values include the values before them.
        for value in &values[shown.start.saturating_sub(width)..shown.start] {
            smooth.next(*value);
        }
        let mut found = Decimated::default();
        let mut after_gap = true;
        for place in shown {
            let value = self.scale.apply(smooth.next(values[place]));
            let episode = episodes[place];
            let column = self.column(episode);
            if !value.is_finite() || !(0.0..f32::from(self.columns)).contains(&column) {
                after_gap = true;
                continue;
            }
            let column = column as u16;
            match found.columns.last_mut().filter(|known| known.x == column && !after_gap) {
                Some(known) => {
                    known.range = union(known.range, [value; 2]);
                    (known.ends[1], known.last) = (value, episode);
                }
                None => found.columns.push(Column {
                    x: column,
                    ends: [value; 2],
                    range: [value; 2],
                    last: episode,
                    after_gap,
                }),
            }
            after_gap = false;
        }
        let ranges = found.columns.iter().map(|column| column.range);
        found.range = ranges.reduce(union);
        found
    }

    /// Samples two curves at every other column of dots: the column with the smoothed, scaled values.
    pub fn samples(&self, episodes: &[u64], curves: [&[f32]; 2]) -> Vec<(u16, [f32; 2])> {
        let width = self.width(episodes);
        let mut samples: Vec<(u16, [f32; 2])> = Vec::new();
        for place in self.shown(episodes) {
            let column = self.column(episodes[place]);
            let is_near = samples.last().is_some_and(|(last, _)| column < f32::from(*last) + 2.0);
            if is_near || !(0.0..f32::from(self.columns)).contains(&column) {
                continue;
            }
            let values = curves.map(|values| self.scale.apply(mean_up_to(values, place, width)));
            if values.iter().all(|value| value.is_finite()) {
                samples.push((column as u16, values));
            }
        }
        samples
    }
}

/// The range from the lowest to the highest value of two ranges.
pub fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The index of an episode, or of the next one if it is missing.
pub fn place(episodes: &[u64], episode: u64) -> usize {
    episodes.partition_point(|known| *known < episode)
}

/// The mean of a value and the finite ones before it, `width` in all; NaN if the value itself is not finite.
fn mean_up_to(values: &[f32], place: usize, width: usize) -> f32 {
    let Some(value) = values.get(place).copied().filter(|value| value.is_finite()) else { return f32::NAN };
    if width <= 1 {
        return value;
    }
    let before = values[..=place].iter().rev().take(2 * width).filter(|value| value.is_finite()).take(width);
    let (sum, count) = before.fold((0.0, 0u32), |(sum, count), value| (sum + f64::from(*value), count + 1));
    (sum / f64::from(count)) as f32
}

/// A moving average over finite values.
struct Smoothing {
    width: usize,
    window: VecDeque<f32>,
    sum: f64,
    pushed: usize,
}

impl Smoothing {
    fn new(width: usize) -> Self {
        Self { width: width.max(1), window: VecDeque::new(), sum: 0.0, pushed: 0 }
    }

    fn next(&mut self, value: f32) -> f32 {
        if self.width == 1 || !value.is_finite() {
            return value;
        }
        if self.window.len() == self.width {
            self.sum -= f64::from(self.window.pop_front().unwrap_or(0.0));
        }
        self.window.push_back(value);
        self.sum += f64::from(value);
        self.pushed += 1;
        if self.pushed.is_multiple_of(self.width) {
            // Recompute the sum now and then, so that rounding errors of large values do not persist.
            self.sum = self.window.iter().map(|value| f64::from(*value)).sum();
        }
        (self.sum / self.window.len() as f64) as f32
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Consecutive episode numbers, one per value.
    pub fn all(values: &[f32]) -> Vec<u64> {
        (1..=values.len() as u64).collect()
    }

    /// An unsmoothed, linear look.
    pub fn look(from: f32, to: f32, columns: u16) -> Look {
        Look { x: Window { from, to }, scale: Scale::Linear, smoothing: 1, columns }
    }

    #[test]
    fn columns_keep_ends_and_range_and_are_split_by_gaps() {
        let mut values: Vec<f32> = (0..100).map(|at| at as f32).collect();
        values[55] = 1000.0;
        let found = look(1.0, 100.0, 10).decimate(&all(&values), &values);
        assert_eq!(found.columns.len(), 10);
        assert_eq!(found.range, Some([0.0, 1000.0]));
        let spiked = found.columns.iter().find(|column| column.range[1] == 1000.0).unwrap();
        assert!(spiked.ends[0] < 56.0 && spiked.ends[1] > 55.0 && !spiked.after_gap);
        values[50] = f32::NAN;
        let gaps = look(1.0, 100.0, 10).decimate(&all(&values), &values).columns;
        assert_eq!(gaps.iter().filter(|column| column.after_gap).count(), 2, "the beginning and the gap");
        assert_eq!(look(200.0, 300.0, 10).decimate(&all(&values), &values), Decimated::default());
    }

    #[test]
    fn samples_are_at_every_other_column_and_smoothed() {
        let (low, high) = (vec![0.0; 1000], vec![1.0; 1000]);
        let samples = Look { smoothing: 10, ..look(1.0, 1000.0, 100) }.samples(&all(&low), [&low, &high]);
        assert!((48..=52).contains(&samples.len()) && samples.iter().all(|(_, ends)| *ends == [0.0, 1.0]));
        assert_eq!(mean_up_to(&[2.0, f32::NAN, 4.0], 2, 2), 3.0);
        let gap = [4.0, 4.0, f32::NAN, f32::NAN, f32::NAN, f32::NAN, 0.0, 0.0];
        assert_eq!(mean_up_to(&gap, 7, 4), 2.0, "a gap as long as the window is bridged");
    }

    #[test]
    fn values_of_a_thinned_run_are_placed_at_their_episodes() {
        let episodes: Vec<u64> = (1..=20).map(|number| 100 * number).collect();
        let values: Vec<f32> = (1..=20).map(|number| number as f32).collect();
        let part = look(401.0, 700.0, 300);
        let of = |look: &Look| -> Vec<(u64, f32)> {
            look.decimate(&episodes, &values).columns.iter().map(|column| (column.last, column.ends[0])).collect()
        };
        assert_eq!(of(&part), [(500, 5.0), (600, 6.0), (700, 7.0)]);
        let smooth = Look { smoothing: 200, ..part };
        assert_eq!(of(&smooth), [(500, 4.5), (600, 5.5), (700, 6.5)], "200 episodes are two values");
        assert_eq!(smooth.samples(&episodes, [&values, &values]).len(), 3);
    }
}
