//! Curves of any length in the columns of dots there are, kept from frame to frame: a curve is looked at
//! again only when it, the window or the size of the chart is another.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};
use std::hash::{Hash, Hasher};
use std::rc::Rc;

use ratatui::buffer::Buffer;
use ratatui::style::Color;

use super::axes::Scale;
use super::range::Window;

/// How a curve is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Episodes that are shown.
    pub x: Window,
    /// How values become heights.
    pub scale: Scale,
    /// Each value is the mean of so many episodes up to it.
    pub smoothing: usize,
    /// Columns of dots.
    pub columns: u16,
}

/// The values in one column of dots, on the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Place of the column.
    pub x: u16,
    /// The first and the last of its values.
    pub ends: [f32; 2],
    /// The least and the greatest.
    pub range: [f32; 2],
    /// Its last episode.
    pub last: u64,
    /// It is not connected with the column before.
    pub after_gap: bool,
}

/// A curve in columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decimated {
    /// Columns with values, from left to right; of gaps in one column each side is one.
    pub columns: Vec<Column>,
    /// Least and greatest of all values, if there are any.
    pub range: Option<[f32; 2]>,
}

impl Look {
    /// What it is told apart by.
    pub fn key(&self) -> LookKey {
        ([self.x.from, self.x.to].map(f32::to_bits), self.scale, self.smoothing, self.columns)
    }

    /// Dots between two episodes.
    fn pace(&self) -> f32 {
        f32::from(self.columns.saturating_sub(1)) / (self.x.to - self.x.from).max(f32::EPSILON)
    }

    /// The column of an episode.
    fn column(&self, episode: u64) -> f32 {
        ((episode as f32 - self.x.from) * self.pace() + 0.5).floor()
    }

    /// The places of the episodes that are shown.
    fn shown(&self, episodes: &[u64]) -> std::ops::Range<usize> {
        let first = place(episodes, self.x.from.floor().max(1.0) as u64);
        let end = place(episodes, self.x.to.ceil().max(0.0) as u64 + 1);
        first.min(end)..end
    }

    /// Values whose mean each value is: of a long run not every episode is here.
    fn width(&self, episodes: &[u64]) -> usize {
        let last = episodes.last().map_or(0, |last| *last as usize);
        (self.smoothing * episodes.len()).checked_div(last).unwrap_or(self.smoothing).max(1)
    }

    /// A curve in columns: one value for each of some episodes.
    pub fn decimate(&self, episodes: &[u64], values: &[f32]) -> Decimated {
        let shown = self.shown(episodes);
        let width = self.width(episodes);
        let mut smooth = Smoothing::new(width);
        // What comes before the window belongs to the means of its first values.
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
                    known.range = [known.range[0].min(value), known.range[1].max(value)];
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
        found.range = ranges.reduce(|[low, high], [least, greatest]| [low.min(least), high.max(greatest)]);
        found
    }

    /// Some episodes with the smoothed values of two curves there, on the scale: one for every other column of
    /// dots, with the column.
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

/// The place of an episode among some, or of the next one that is there.
pub fn place(episodes: &[u64], episode: u64) -> usize {
    episodes.partition_point(|known| *known < episode)
}

/// The mean of a value and the finite ones before it, so many together; the value itself if it is not finite.
fn mean_up_to(values: &[f32], place: usize, width: usize) -> f32 {
    let Some(value) = values.get(place).copied().filter(|value| value.is_finite()) else { return f32::NAN };
    if width <= 1 {
        return value;
    }
    let before = values[..=place].iter().rev().take(2 * width).filter(|value| value.is_finite()).take(width);
    let (sum, count) = before.fold((0.0, 0u32), |(sum, count), value| (sum + f64::from(*value), count + 1));
    (sum / f64::from(count)) as f32
}

/// Running means.
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
            // What a large value has cost in precision does not stay.
            self.sum = self.window.iter().map(|value| f64::from(*value)).sum();
        }
        (self.sum / self.window.len() as f64) as f32
    }
}

/// Curves that were drawn, as they were, those of whole charts, and their pictures.
#[derive(Debug, Default)]
pub struct Kept {
    known: RefCell<HashMap<Key, Rc<Decimated>>>,
    drawn: RefCell<HashMap<DrawnKey, Rc<Drawn>>>,
    pictures: RefCell<HashMap<PictureKey, Rc<Buffer>>>,
    /// Charts that were numbered.
    numbered: Cell<u64>,
}

/// The version of a curve and how it is seen.
type Key = (u64, usize, LookKey);

/// How a curve is seen, its numbers by their bits.
type LookKey = ([u32; 2], Scale, usize, u16);

/// What the curves of a chart, all together, are told apart by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawnKey {
    /// The curves: version, colour, values that are dotted, and whether there is a band.
    pub curves: Vec<((u64, usize), Color, u64, bool)>,
    /// How they are seen.
    pub look: LookKey,
}

impl Hash for DrawnKey {
    fn hash<H: Hasher>(&self, state: &mut H) {
        // Versions say nearly all; a hundred curves are hashed with every chart of a frame.
        self.curves.iter().for_each(|((version, _), ..)| state.write_u64(*version));
        self.curves.first().hash(state);
        self.look.hash(state);
    }
}

/// The curves of a chart.
#[derive(Debug)]
pub struct Drawn {
    /// Its number, which no others have; none if they cannot be told apart from others.
    pub number: Option<u64>,
    /// The curves in columns.
    pub lines: Vec<Rc<Decimated>>,
    /// Least and greatest value of all of them.
    pub range: Option<[f32; 2]>,
}

impl Drawn {
    fn new(number: Option<u64>, lines: Vec<Rc<Decimated>>) -> Self {
        let ranges = lines.iter().filter_map(|line| line.range);
        let range = ranges.reduce(|[low, high], [least, greatest]| [low.min(least), high.max(greatest)]);
        Self { number, lines, range }
    }
}

/// What the picture of the curves of a chart depends on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PictureKey {
    /// The number of the curves.
    pub number: u64,
    /// The lowest and the highest value of the axis, by their bits.
    pub range: [u32; 2],
    /// Cells of the plot.
    pub size: [u16; 2],
    /// Dots of a cell.
    pub dots: [u16; 2],
}

/// Curves and pictures that are kept at most.
const MOST: usize = 4000;
const MOST_PICTURES: usize = 64;

impl Kept {
    /// A curve in columns. Its version is a number that is another whenever the values are others, and which of the
    /// curves of that number it is; without one it is looked at again.
    pub fn decimated(
        &self,
        version: Option<(u64, usize)>,
        episodes: &[u64],
        values: &[f32],
        look: &Look,
    ) -> Rc<Decimated> {
        let Some((version, curve)) = version else { return Rc::new(look.decimate(episodes, values)) };
        let key = (version, curve, look.key());
        let mut known = self.known.borrow_mut();
        if known.len() > MOST {
            known.clear();
        }
        known.entry(key).or_insert_with(|| Rc::new(look.decimate(episodes, values))).clone()
    }

    /// The curves of a chart; put together if they are not known, or cannot be told apart from others.
    pub fn drawn(&self, key: Option<DrawnKey>, lines: impl FnOnce() -> Vec<Rc<Decimated>>) -> Rc<Drawn> {
        let Some(key) = key else { return Rc::new(Drawn::new(None, lines())) };
        let mut all = self.drawn.borrow_mut();
        if all.len() > MOST_PICTURES {
            all.clear();
        }
        let number = || {
            self.numbered.set(self.numbered.get() + 1);
            Some(self.numbered.get())
        };
        all.entry(key).or_insert_with(|| Rc::new(Drawn::new(number(), lines()))).clone()
    }

    /// The picture of the curves of a chart; drawn if it is not known.
    pub fn picture(&self, key: PictureKey, draw: impl FnOnce() -> Buffer) -> Rc<Buffer> {
        let mut pictures = self.pictures.borrow_mut();
        if pictures.len() > MOST_PICTURES {
            pictures.clear();
        }
        pictures.entry(key).or_insert_with(|| Rc::new(draw())).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(values: &[f32]) -> Vec<u64> {
        (1..=values.len() as u64).collect()
    }

    fn look(from: f32, to: f32, columns: u16) -> Look {
        Look { x: Window { from, to }, scale: Scale::Linear, smoothing: 1, columns }
    }

    #[test]
    fn a_column_has_its_first_last_least_and_greatest_value_and_gaps_part_columns() {
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
    fn a_curve_is_looked_at_again_only_when_something_is_another() {
        let kept = Kept::default();
        let at = |version: Option<u64>, values: &[f32], look: &Look| {
            kept.decimated(version.map(|version| (version, 0)), &all(values), values, look)
        };
        let first = at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 10));
        assert!(Rc::ptr_eq(&first, &at(Some(1), &[9.0, 9.0], &look(1.0, 2.0, 10))), "the version says it is the same");
        assert!(!Rc::ptr_eq(&first, &at(Some(2), &[1.0, 2.0], &look(1.0, 2.0, 10))));
        assert_ne!(first, at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 20)));
        assert_ne!(first, at(None, &[9.0, 9.0], &look(1.0, 2.0, 10)));
    }

    #[test]
    fn the_curves_of_a_chart_are_put_together_again_only_when_one_is_another() {
        let kept = Kept::default();
        let at = |versions: &[u64], colour: Color| {
            let curves = versions.iter().map(|version| ((*version, 0), colour, 0, false)).collect();
            let line = |value: f32| Rc::new(look(1.0, 2.0, 10).decimate(&[1], &[value]));
            kept.drawn(Some(DrawnKey { curves, look: look(1.0, 2.0, 10).key() }), || vec![line(1.0), line(3.0)])
        };
        let first = at(&[1, 2], Color::Red);
        assert_eq!(first.range, Some([1.0, 3.0]));
        assert!(Rc::ptr_eq(&first, &at(&[1, 2], Color::Red)));
        for other in [at(&[1, 3], Color::Red), at(&[1, 2], Color::Blue), kept.drawn(None, Vec::new)] {
            assert_ne!(first.number, other.number);
        }
    }

    #[test]
    fn samples_are_at_every_other_column_and_smoothed() {
        let (low, high) = (vec![0.0; 1000], vec![1.0; 1000]);
        let samples = Look { smoothing: 10, ..look(1.0, 1000.0, 100) }.samples(&all(&low), [&low, &high]);
        assert!((48..=52).contains(&samples.len()) && samples.iter().all(|(_, ends)| *ends == [0.0, 1.0]));
        assert_eq!(mean_up_to(&[2.0, f32::NAN, 4.0], 2, 2), 3.0);
    }

    #[test]
    fn of_a_thinned_run_each_value_stands_at_its_episode() {
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
