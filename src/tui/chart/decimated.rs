//! Reduces curves of any length to the columns of dots available.

use std::ops::Range;

use super::axes::Scale;
use super::range::Window;
use crate::tui::widgets::canvas::Point;
use mge_stats::rolling::finite_means;

/// How a curve is displayed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Episodes to show.
    pub x: Window,
    /// How values map to heights.
    pub scale: Scale,
    /// Number of values in the moving average of each.
    pub smoothing: usize,
    /// Columns of dots, at least 2.
    pub columns: u16,
}

impl Look {
    /// Reduces a curve, with one value per episode, to a line of points: episode and scaled value. In each column of
    /// dots it covers all values. Points that are not finite are gaps.
    pub fn decimate(&self, episodes: &[u64], values: &[f32]) -> Vec<Point> {
        let shown = self.shown(episodes);
        let last = f32::from(self.columns - 1);
        let width = (self.x.to - self.x.from).max(f32::EPSILON);
        let smooth = finite_means(&values[..shown.end], self.smoothing).skip(shown.start);
        let visible: Vec<Point> = episodes[shown]
            .iter()
            .zip(smooth)
            .map(|(episode, value)| {
                let column = ((*episode as f32 - self.x.from) / width * last).round();
                [self.x.from + column / last * width, self.scale.apply(value)]
            })
            .collect();
        let columns = visible.chunk_by(|a, b| a[0] == b[0] && a[1].is_finite() == b[1].is_finite());
        columns.flat_map(envelope).collect()
    }

    /// The indices of the episodes to show.
    fn shown(&self, episodes: &[u64]) -> Range<usize> {
        let first = place(episodes, self.x.from.ceil().max(1.0) as u64);
        let end = place(episodes, self.x.to.floor().max(0.0) as u64 + 1);
        first.min(end)..end
    }
}

/// The first, lowest, highest and last point of a column.
fn envelope(column: &[Point]) -> Vec<Point> {
    let values = || column.iter().map(|[_, value]| *value);
    match column {
        [first, .., last] => {
            let [low, high] = [values().fold(f32::INFINITY, f32::min), values().fold(f32::NEG_INFINITY, f32::max)];
            [first[1], low, high, last[1]].map(|value| [first[0], value]).to_vec()
        }
        single => single.to_vec(),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// An unsmoothed, linear look.
    fn look(from: f32, to: f32, columns: u16) -> Look {
        Look { x: Window { from, to }, scale: Scale::Linear, smoothing: 1, columns }
    }

    #[test]
    fn columns_cover_all_values_and_are_split_by_gaps() {
        let episodes: Vec<u64> = (1..=100).collect();
        let mut values: Vec<f32> = (0..100).map(|at| at as f32).collect();
        values[55] = 1000.0;
        let found = look(1.0, 100.0, 10).decimate(&episodes, &values);
        assert_eq!(found.len(), 4 * 10);
        let highest = found.iter().map(|point| point[1]).fold(0.0, f32::max);
        assert_eq!((found[0], highest, found[39]), ([1.0, 0.0], 1000.0, [100.0, 99.0]));
        values[50] = f32::NAN;
        let gaps = look(1.0, 100.0, 10).decimate(&episodes, &values);
        assert_eq!(gaps.iter().filter(|point| !point[1].is_finite()).count(), 1);
        assert!(look(200.0, 300.0, 10).decimate(&episodes, &values).is_empty());
    }

    #[test]
    fn smoothing_is_a_trailing_mean_over_finite_values() {
        let smooth =
            |values: &[f32], width| finite_means(values, width).map(|value| value.to_string()).collect::<Vec<_>>();
        assert_eq!(smooth(&[0.0, 4.0, 2.0, f32::NAN, 6.0], 2), ["0", "2", "3", "NaN", "6"]);
        assert_eq!(smooth(&[3.0, f32::INFINITY, 5.0, 7.0], 3), ["3", "NaN", "4", "6"]);
        assert_eq!(smooth(&[1e30, 0.1, 0.1, 0.1, 0.1, 0.1], 2)[4..], ["0.1", "0.1"], "a spike leaves no error");
    }

    #[test]
    fn values_of_a_thinned_run_are_placed_at_their_episodes() {
        let episodes: Vec<u64> = (1..=20).map(|number| 100 * number).collect();
        let values: Vec<f32> = (1..=20).map(|number| number as f32).collect();
        let part = look(401.0, 700.0, 300);
        assert_eq!(part.decimate(&episodes, &values), [[500.0, 5.0], [600.0, 6.0], [700.0, 7.0]]);
        let smooth = Look { smoothing: 2, ..part }.decimate(&episodes, &values);
        assert_eq!(smooth, [[500.0, 4.5], [600.0, 5.5], [700.0, 6.5]]);
    }
}
