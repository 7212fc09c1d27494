//! A plot: frame, ticks, labels, and data drawn inside.

use super::canvas::{Canvas, Pen, TextFormat};
use super::geometry::{Point, Rect};
use super::style::{
    BAND_OPACITY, Color, FRAME_WIDTH, GRID, INK, LABEL_SIZE, SMALL_SIZE, THIN_WIDTH, TICK_LENGTH, TITLE_SIZE, faded,
};
use mge_base::text::number as short;
use mge_stats::Estimate;

/// Width of a vertical label left of a plot.
pub const Y_LABEL: f64 = 1.5 * LABEL_SIZE;
/// Height of a label below a plot.
pub const X_LABEL: f64 = 1.4 * LABEL_SIZE;

/// One axis: what it measures, its range and its ticks.
#[derive(Debug, Clone)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis from `low` to `high` with about `count` round ticks.
    pub fn linear(label: &str, low: f64, high: f64, count: usize) -> Self {
        let places = round_ticks(low, high, count);
        let step = places.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let decimals = if step.is_finite() { (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize } else { 2 };
        let ticks = places.iter().map(|value| (*value, number(*value, decimals))).collect();
        Self::with_ticks(label, low, high, ticks)
    }

    /// An axis with the given ticks.
    pub fn with_ticks(label: &str, low: f64, high: f64, ticks: Vec<(f64, String)>) -> Self {
        Self { label: label.to_owned(), low, high, ticks }
    }

    /// A linear axis from 0 to beyond the largest finite value; [0, 1] if there are none.
    pub fn from_zero(label: &str, values: impl Iterator<Item = f64>, count: usize) -> Self {
        let high = values.filter(|value| *value <= MAX_MAGNITUDE).fold(0.0, f64::max);
        Self::linear(label, 0.0, if high > 0.0 { 1.12 * high } else { 1.0 }, count)
    }

    /// The same axis, without its label unless `is_labelled` (for inner panels of a grid).
    pub fn labelled(self, is_labelled: bool) -> Self {
        if is_labelled { self } else { Self { label: String::new(), ..self } }
    }

    /// Relative position of `value` between the ends, 0 to 1.
    fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// Largest absolute value on an axis, so that the width of any range is finite.
const MAX_MAGNITUDE: f64 = 1e300;

/// At most `most` equally spaced round values in a range: multiples of 1, 2 or 5 times a power of ten.
pub fn round_ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    if most == 0 || high <= low {
        return vec![low].into_iter().take(most).collect();
    }
    let finest = ((high - low) / most as f64).log10().floor() as i32;
    let steps = (finest..).flat_map(|power| [1.0, 2.0, 5.0].map(|factor| (factor, power)));
    let ticks = steps.map(|(factor, power)| {
        // Dividing by a power of ten is exact where multiplying by its inverse is not.
        let at = move |n: f64| if power < 0 { n * factor / 10f64.powi(-power) } else { n * factor * 10f64.powi(power) };
        let (first, last) = ((low / at(1.0) - 1e-9).ceil(), (high / at(1.0) + 1e-9).floor());
        let count = (last - first + 1.0).max(0.0) as usize;
        (0..count).map(move |n| at(first + n as f64))
    });
    // A step beyond the range leaves at most one tick, so that one is found.
    ticks.into_iter().find(|ticks| ticks.len() <= most).map(Iterator::collect).unwrap_or_default()
}

/// Labels of an axis in one notation, at most `most`, each in `width` characters: as many as differ when they are rounded
/// to that. The range of a logarithmic axis is that of the logarithms.
pub fn value_labels(range: [f32; 2], is_log: bool, most: usize, width: usize) -> Vec<(f32, String)> {
    let ticks = if is_log { powers(range, most) } else { labelled_ticks(range, most) };
    let fit = ticks.iter().all(|(_, text)| text.len() <= width);
    let written = |(value, text): (f32, String)| (value, if fit { text } else { short(value) });
    let mut labels: Vec<(f32, String)> = ticks.into_iter().map(written).collect();
    let exponents = || labels.iter().filter(|(value, _)| *value != 0.0).map(|(_, text)| text.contains('e'));
    let is_mixed = exponents().any(|has| has) && !exponents().all(|has| has);
    if is_mixed && (is_log || most <= 2) {
        let others = labels.iter_mut().filter(|(value, _)| *value != 0.0);
        others.for_each(|(value, text)| *text = format!("{value:.0e}"));
    } else if most > 2 && (is_mixed || labels.windows(2).any(|pair| pair[0].1 == pair[1].1)) {
        return value_labels(range, is_log, most - 1, width);
    }
    labels.dedup_by(|next, before| next.1 == before.1);
    labels
}

/// At most `most` round values in a range, with their labels.
pub fn labelled_ticks([low, high]: [f32; 2], most: usize) -> Vec<(f32, String)> {
    let values = round_ticks(f64::from(low), f64::from(high), most);
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1.0);
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    // Not "-0.0", and not a single value, from which no range can be read.
    let text = |value: f64| format!("{:.decimals$}", if value.abs() < step / 1e6 { 0.0 } else { value });
    match values[..] {
        [] | [_] => [low, high].map(|value| (value, short(value))).into(),
        _ => values.iter().map(|value| (*value as f32, text(*value))).collect(),
    }
}

/// At most `most` powers of ten in a range of logarithms, with their labels; if there are fewer than two, also their
/// double and fivefold values, or else round values.
fn powers([low, high]: [f32; 2], most: usize) -> Vec<(f32, String)> {
    let (first, last) = (low.ceil() as i32, high.floor() as i32);
    let factors: &[f32] = if last > first { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all = (first - 1..=last).flat_map(|power| factors.iter().map(move |factor| factor * 10f32.powi(power)));
    let values: Vec<f32> = all.filter(|value| (low - 1e-4..=high + 1e-4).contains(&value.log10())).collect();
    if values.len() < 2 {
        return labelled_ticks([low, high].map(|end| 10f32.powf(end)), most);
    }
    let every = values.len().div_ceil(most.max(1));
    values.into_iter().step_by(every).map(|value| (value, short(value))).collect()
}

/// A number with a true minus sign and thin spaces between thousands.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.*}", decimals, value.abs());
    let (whole, rest) = text.find('.').map_or((text.as_str(), ""), |dot| text.split_at(dot));
    let mut grouped = String::new();
    for (n, digit) in whole.chars().enumerate() {
        if whole.len() > 4 && n > 0 && (whole.len() - n) % 3 == 0 {
            grouped.push('\u{2009}');
        }
        grouped.push(digit);
    }
    let negative = value < 0.0 && text.chars().any(|digit| ('1'..='9').contains(&digit));
    format!("{}{grouped}{rest}", if negative { "\u{2212}" } else { "" })
}

/// A framed plot that maps data to the page.
pub struct Plot<'c> {
    canvas: &'c Canvas,
    /// The inside of the frame.
    pub rect: Rect,
    x: Axis,
    y: Axis,
}

/// Options of a plot's frame.
pub struct Frame<'t> {
    /// Bold text above the plot, at its left edge.
    pub title: &'t str,
    /// Whether horizontal grid lines are drawn at the ticks.
    pub grid: bool,
    /// Whether the inside is a square (scenes, where both axes have one scale).
    pub square: bool,
}

impl<'c> Plot<'c> {
    /// Draws frame, ticks and labels into `outer`.
    pub fn new(canvas: &'c Canvas, outer: Rect, frame: &Frame<'_>, x: Axis, y: Axis) -> Self {
        let widest = y
            .ticks
            .iter()
            .map(|(_, text)| TextFormat::SMALL.width(text))
            .fold(TextFormat::SMALL.width("0.00"), f64::max);
        let left = TICK_LENGTH + 2.0 + widest + if y.label.is_empty() { 0.0 } else { Y_LABEL };
        let below = TICK_LENGTH + 1.4 * SMALL_SIZE + if x.label.is_empty() { 0.0 } else { X_LABEL };
        let above = if frame.title.is_empty() { 0.4 * SMALL_SIZE } else { 1.6 * TITLE_SIZE };
        let mut rect = outer.cut(left, above, 0.4 * SMALL_SIZE, below);
        if frame.square {
            rect = rect.square();
        }
        let plot = Self { canvas, rect, x, y };
        plot.ticks(frame.grid);
        canvas.outline(&rect.corners(), Pen::new(INK, FRAME_WIDTH));
        let baseline = rect.top - 0.8 * TITLE_SIZE;
        canvas.text([rect.left, baseline], frame.title, TextFormat::TITLE);
        // Centred, or further left if a long label would leave the page.
        let middle = rect.center()[0].min(outer.right - 0.5 * TextFormat::LABEL.width(&plot.x.label));
        canvas.text([middle, rect.bottom + below - 0.7 * LABEL_SIZE], &plot.x.label, TextFormat::LABEL.centered());
        canvas.text(
            [rect.left - left + 0.6 * LABEL_SIZE, rect.center()[1]],
            &plot.y.label,
            TextFormat::LABEL.centered().rotated(),
        );
        plot
    }

    fn ticks(&self, grid: bool) {
        let (canvas, rect, pen) = (self.canvas, self.rect, Pen::new(INK, FRAME_WIDTH));
        for (value, text) in &self.x.ticks {
            let x = self.at(*value, self.y.low)[0];
            canvas.line(&[[x, rect.bottom], [x, rect.bottom + TICK_LENGTH]], pen);
            canvas.text([x, rect.bottom + TICK_LENGTH + 0.8 * SMALL_SIZE], text, TextFormat::SMALL.centered());
        }
        for (value, text) in &self.y.ticks {
            let y = self.at(self.x.low, *value)[1];
            if grid {
                canvas.line(&[[rect.left, y], [rect.right, y]], Pen::new(GRID, FRAME_WIDTH));
            }
            canvas.line(&[[rect.left - TICK_LENGTH, y], [rect.left, y]], pen);
            canvas.text([rect.left - TICK_LENGTH - 2.0, y], text, TextFormat::SMALL.right());
        }
    }

    /// The point of a value pair on the page; not finite if a value is not.
    pub fn at(&self, x: f64, y: f64) -> Point {
        [
            self.rect.left + self.x.fraction(x) * self.rect.width(),
            self.rect.bottom - self.y.fraction(y) * self.rect.height(),
        ]
    }

    /// A line through the points; non-finite values leave gaps, an isolated value is a dot.
    pub fn line(&self, xs: &[f64], ys: &[f64], pen: Pen) {
        for run in finite_runs(xs, &[ys]) {
            let points: Vec<Point> = run.map(|n| self.at(xs[n], ys[n])).collect();
            match points[..] {
                [lone] if self.rect.contains(lone) => self.canvas.dot(lone, pen.width, pen.color),
                _ => self.canvas.within(&self.rect, &points, |points| self.canvas.line(points, pen)),
            }
        }
    }

    /// The band around a line, with gaps where the line or either bound is not finite.
    pub fn band(&self, xs: &[f64], [ys, low, high]: [&[f64]; 3], color: Color) {
        for run in finite_runs(xs, &[ys, low, high]) {
            // One polygon per run: adjacent translucent slices would show seams.
            let (mut upper, mut lower) = (Vec::new(), Vec::new());
            for n in run {
                upper.push(self.at(xs[n], high[n]));
                lower.push(self.at(xs[n], low[n]));
            }
            upper.extend(lower.into_iter().rev());
            self.canvas.within(&self.rect, &upper, |corners| self.canvas.fill(corners, faded(color, BAND_OPACITY)));
        }
    }

    /// A bar of `width` (data units) from zero, with its interval as an error bar.
    pub fn bar(&self, x: f64, width: f64, estimate: Estimate, color: Color) {
        let ([left, zero], [right, end]) = (self.at(x - width / 2.0, 0.0), self.at(x + width / 2.0, estimate.value));
        let bar = Rect::new(left, zero.min(end), right, zero.max(end));
        self.canvas.within(&self.rect, &bar.corners(), |corners| self.canvas.fill(corners, color));
        if !estimate.has_interval() {
            return;
        }
        let pen = Pen::new(INK, THIN_WIDTH);
        let (low, high) = (self.at(x, estimate.lower), self.at(x, estimate.upper));
        self.canvas.line(&[low, high], pen);
        for [x, y] in [low, high] {
            self.canvas.line(&[[x - 1.5, y], [x + 1.5, y]], pen);
        }
    }
}

/// Maximal ranges of indices in which all columns are finite.
fn finite_runs(xs: &[f64], columns: &[&[f64]]) -> Vec<std::ops::Range<usize>> {
    let count = columns.iter().map(|column| column.len()).fold(xs.len(), usize::min);
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for n in (0..count).filter(|&n| xs[n].is_finite() && columns.iter().all(|column| column[n].is_finite())) {
        match runs.last_mut() {
            Some(run) if run.end == n => run.end = n + 1,
            _ => runs.push(n..n + 1),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_even_between_two_powers_of_ten() {
        let texts = |ticks: Vec<(f32, String)>| ticks.into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" ");
        assert_eq!(texts(labelled_ticks([0.0, 1.0], 3)), "0.0 0.5 1.0");
        assert_eq!(texts(labelled_ticks([0.0, 0.1], 3)), "0.00 0.05 0.10");
        assert_eq!(texts(labelled_ticks([1.0, 700.0], 4)), "200 400 600");
        assert_eq!(texts(powers([-2.1, 0.1], 6)), "0.010 0.10 1");
        assert_eq!(texts(powers([0.1, 0.9], 4)), "2 5");
        assert_eq!(texts(labelled_ticks([-0.3, 0.1], 5)), "-0.3 -0.2 -0.1 0.0 0.1");
        assert_eq!(texts(labelled_ticks([-0.013, 0.013], 2)), "-0.01 0.013");
        assert!(labelled_ticks([0.3, 0.3], 4).len() <= 4);
        assert_eq!(texts(powers([-1.7, -0.45], 6)), "0.020 0.050 0.10 0.20", "they are near all values");
    }

    #[test]
    fn labels_of_an_axis_do_not_repeat_where_they_are_rounded() {
        let texts =
            |y: [f32; 2]| value_labels(y, false, 6, 5).into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" ");
        assert_eq!(texts([-0.014, 0.0]), "-0.01 0.00", "one notation");
        let logarithmic = value_labels([-4.0, 0.0], true, 6, 5).into_iter().map(|(_, text)| text);
        assert_eq!(logarithmic.collect::<Vec<_>>(), ["1e-4", "1e-3", "1e-2", "1e-1", "1e0"]);
        assert_eq!(texts([0.0, 140_000.0]), "0 50k 100k");
        assert_eq!(texts([0.9991, 0.9993]), "1.00", "no room for what differs");
    }

    #[test]
    fn gaps_split_runs() {
        let xs = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(finite_runs(&xs, &[&[1.0, f64::NAN, 2.0, 3.0, f64::INFINITY]]), [0..1, 2..4]);
    }

    #[test]
    fn numbers_are_formatted_for_reading() {
        assert_eq!(number(-0.25, 2), "\u{2212}0.25");
        assert_eq!(number(-0.001, 1), "0.0");
        assert_eq!(number(12_500.0, 0), "12\u{2009}500");
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::linear("", 0.0, 103.0, 6);
        assert!(axis.ticks.iter().all(|(value, _)| (0.0..=103.0).contains(value) && value % 20.0 == 0.0), "{axis:?}");
        assert!(axis.ticks.len() >= 4);
    }
}
