//! Curves: any number of episodes in the columns there are.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};

use super::axes::{Axes, Scale, number};
use super::range::Window;
use crate::tui::widgets::columns;
use crate::tui::widgets::raster::{Dot, Raster};
use crate::tui::widgets::theme::{Marker, Theme};

/// One line.
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: String,
    /// Its colour.
    pub colour: Color,
    /// One value an episode, from episode 1; what is not finite is a gap.
    pub values: &'a [f32],
    /// Separate points: episode and value, such as evaluations.
    pub points: &'a [(u64, f32)],
}

/// Curves over one pair of axes.
pub struct Plot<'a> {
    /// What is shown.
    pub title: &'a str,
    /// The lines, the last one in front.
    pub curves: Vec<Curve<'a>>,
    /// Episodes to show.
    pub x: Window,
    /// Values the axis shows in any case.
    pub y: Option<[f32; 2]>,
    /// How values become heights.
    pub scale: Scale,
    /// Each value is the mean of so many episodes up to it.
    pub smoothing: usize,
    /// The episode whose values are read off.
    pub crosshair: Option<f32>,
    /// What to say if there is nothing to show.
    pub empty: &'a str,
}

/// Draws title, axes and curves. Returns the axes unless the area is too small.
pub fn draw(plot: &Plot, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Axes> {
    if area.height < 2 || area.width == 0 {
        return None;
    }
    title(plot, Rect { height: 1, ..area }, theme, buffer);
    let area = Rect { y: area.y + 1, height: area.height - 1, ..area };
    let lines: Vec<Vec<(f32, f32)>> = plot.curves.iter().map(|curve| visible(curve, plot)).collect();
    let found = range(&lines, plot);
    let axes = Axes::draw(area, plot.x, found.unwrap_or([0.0, 1.0]), plot.scale, theme, buffer)?;
    if found.is_none() {
        let text = match (plot.curves.iter().any(|curve| !curve.values.is_empty()), plot.scale) {
            (false, _) => plot.empty,
            (true, Scale::Linear) => "no values here",
            (true, Scale::Log) => "no values above zero here",
        };
        let row = axes.plot.y + axes.plot.height / 2;
        let start = axes.plot.x + axes.plot.width.saturating_sub(columns::width(text) as u16) / 2;
        buffer.set_stringn(start, row, text, usize::from(axes.plot.width), theme.faint());
        return Some(axes);
    }
    let mut raster = Raster::new(axes.plot, theme.marker);
    for (line, curve) in lines.iter().zip(&plot.curves) {
        trace(line, curve.colour, &axes, &mut raster);
    }
    raster.render(buffer);
    marks(plot, &axes, theme, buffer);
    crosshair(plot, &axes, theme, buffer);
    Some(axes)
}

fn title(plot: &Plot, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let end = area.right();
    let (mut x, _) = buffer.set_stringn(area.x, area.y, plot.title, usize::from(area.width), theme.strong());
    if plot.curves.iter().all(|curve| curve.values.is_empty()) {
        return;
    }
    for curve in &plot.curves {
        let value = plot.crosshair.map_or_else(
            || curve.values.iter().rev().copied().find(|value| value.is_finite()),
            |at| curve.values.get((at.round() as usize).saturating_sub(1)).copied(),
        );
        let text = format!("  {} {}", curve.name, value.map_or_else(|| "-".to_owned(), number));
        if x + columns::width(&text) as u16 <= end {
            (x, _) = buffer.set_stringn(x, area.y, text, usize::from(end - x), Style::new().fg(curve.colour));
        }
    }
    if let Some(at) = plot.crosshair {
        buffer.set_stringn(x, area.y, format!("  episode {at:.0}"), usize::from(end - x), theme.faint());
    }
}

/// The smoothed values inside of the window, gaps as NaN.
fn visible(curve: &Curve, plot: &Plot) -> Vec<(f32, f32)> {
    let first = (plot.x.from.floor().max(1.0) as usize) - 1;
    let end = (plot.x.to.ceil().max(0.0) as usize).min(curve.values.len());
    if first >= end {
        return Vec::new();
    }
    let width = plot.smoothing.max(1);
    let mut window: std::collections::VecDeque<f32> = std::collections::VecDeque::with_capacity(width);
    let (mut sum, mut pushed) = (0.0f64, 0usize);
    let mut smooth = |value: f32| {
        if width == 1 || !value.is_finite() {
            return value;
        }
        if window.len() == width {
            sum -= f64::from(window.pop_front().unwrap_or(0.0));
        }
        window.push_back(value);
        sum += f64::from(value);
        pushed += 1;
        if pushed % width == 0 {
            // What a large value has cost in precision does not stay.
            sum = window.iter().map(|value| f64::from(*value)).sum();
        }
        (sum / window.len() as f64) as f32
    };
    // What comes before the window belongs to the means of its first values.
    for value in &curve.values[first.saturating_sub(width)..first] {
        smooth(*value);
    }
    (first..end).map(|index| ((index + 1) as f32, smooth(curve.values[index]))).collect()
}

/// Lowest and highest scaled value with a margin. None if no value is finite.
fn range(lines: &[Vec<(f32, f32)>], plot: &Plot) -> Option<[f32; 2]> {
    let points = plot.curves.iter().flat_map(|curve| curve.points.iter().map(|(_, value)| *value));
    let values = lines.iter().flatten().map(|(_, value)| *value).chain(points);
    let scaled = values.map(|value| plot.scale.apply(value)).filter(|value| value.is_finite());
    let found = scaled.fold(None, |range: Option<[f32; 2]>, value| {
        Some(range.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
    })?;
    match plot.y.filter(|_| plot.scale == Scale::Linear) {
        Some([low, high]) => Some([found[0].min(low), found[1].max(high)]),
        None => {
            let margin = ((found[1] - found[0]) * 0.05)
                .max(found[1].abs() * if found[0] == found[1] { 0.1 } else { 1e-3 })
                .max(1e-6);
            Some([found[0] - margin, found[1] + margin])
        }
    }
}

/// Draws a line: neighbours are connected, and a column of dots with many values shows
/// all heights between their least and their greatest.
fn trace(line: &[(f32, f32)], colour: Color, axes: &Axes, raster: &mut Raster) {
    let size = raster.size();
    let mut column: Option<Column> = None;
    for (x, y) in line {
        let dot = axes.dot(size, *x, *y);
        if !dot[1].is_finite() {
            if let Some(done) = column.take() {
                done.draw(colour, raster);
            }
            continue;
        }
        match &mut column {
            Some(open) if open.x == dot[0].floor() => open.add(dot),
            _ => {
                if let Some(done) = column.replace(Column::new(dot)) {
                    done.draw(colour, raster);
                    raster.line(done.last, dot, colour);
                }
            }
        }
    }
    if let Some(done) = column {
        done.draw(colour, raster);
    }
}

struct Column {
    x: f32,
    top: f32,
    bottom: f32,
    last: Dot,
}

impl Column {
    fn new(dot: Dot) -> Self {
        Self { x: dot[0].floor(), top: dot[1], bottom: dot[1], last: dot }
    }

    fn add(&mut self, dot: Dot) {
        self.top = self.top.min(dot[1]);
        self.bottom = self.bottom.max(dot[1]);
        self.last = dot;
    }

    fn draw(&self, colour: Color, raster: &mut Raster) {
        raster.line([self.x + 0.5, self.top], [self.x + 0.5, self.bottom], colour);
    }
}

fn marks(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let mark = if theme.marker == Marker::Ascii { "o" } else { "◆" };
    for curve in &plot.curves {
        for (episode, value) in curve.points {
            let Some(column) = axes.column(*episode as f32) else { continue };
            let height = f32::from(axes.plot.height);
            let [_, y] = axes.dot([1.0, height], *episode as f32, *value);
            if (0.0..height).contains(&y) {
                buffer.set_string(column, axes.plot.y + y as u16, mark, Style::new().fg(curve.colour));
            }
        }
    }
}

fn crosshair(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let Some(column) = plot.crosshair.and_then(|at| axes.column(at)) else { return };
    let bar = if theme.marker == Marker::Ascii { "|" } else { "┊" };
    for row in axes.plot.top()..axes.plot.bottom() {
        if buffer[(column, row)].symbol() == " " {
            buffer.set_string(column, row, bar, theme.faint());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::{Depth, Palette};

    fn plot<'a>(values: &'a [f32], points: &'a [(u64, f32)]) -> Plot<'a> {
        Plot {
            title: "loss",
            curves: vec![Curve { name: "a".into(), colour: Color::Red, values, points }],
            x: Window { from: 1.0, to: values.len().max(10) as f32 },
            y: None,
            scale: Scale::Linear,
            smoothing: 1,
            crosshair: None,
            empty: "press t",
        }
    }

    fn lines(plot: &Plot, marker: Marker) -> Vec<String> {
        let area = Rect::new(0, 0, 26, 6);
        let mut buffer = Buffer::empty(area);
        draw(plot, area, &Theme::new(Palette::Dark, Depth::True, marker), &mut buffer);
        let row = |y: u16| (0..area.width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        (0..area.height).map(|y| row(y).trim_end().to_owned()).collect()
    }

    #[test]
    fn a_ramp_rises_from_left_to_right() {
        let values: Vec<f32> = (0..20).map(|i| i as f32).collect();
        let lines = lines(&plot(&values, &[]), Marker::Ascii);
        assert_eq!(lines[0], "loss  a 19");
        assert!(lines[1].ends_with('*') && lines[4].contains("|***"), "{lines:#?}");
        assert_eq!(lines[5].trim_start(), "1                 20");
    }

    #[test]
    fn values_that_are_not_finite_are_gaps() {
        let mut values = vec![1.0; 20];
        values[9] = f32::NAN;
        values[10] = f32::INFINITY;
        values[0] = 2.0;
        let lines = lines(&plot(&values, &[]), Marker::Ascii);
        assert!(lines[4].contains("* ") && lines[4].ends_with("*"), "{lines:#?}");
        assert!(!lines[0].contains("inf"));
    }

    #[test]
    fn a_hundred_thousand_episodes_keep_their_single_spike() {
        let mut values = vec![0.0; 100_000];
        values[54_321] = 1.0;
        let lines = lines(&plot(&values, &[]), Marker::Ascii);
        assert!(lines[1].contains('*'), "{lines:#?}");
    }

    #[test]
    fn smoothing_is_the_mean_of_the_episodes_before() {
        let values = [0.0, 4.0, 2.0, f32::NAN, 6.0];
        let mut plot = plot(&values, &[]);
        plot.smoothing = 2;
        let smooth: Vec<f32> = visible(&plot.curves[0], &plot).iter().map(|(_, value)| *value).collect();
        assert_eq!(smooth[..3], [0.0, 2.0, 3.0]);
        assert!(smooth[3].is_nan());
        assert_eq!(smooth[4], 4.0);
    }

    #[test]
    fn an_empty_chart_says_what_to_do() {
        assert!(lines(&plot(&[], &[]), Marker::Braille).concat().contains("press t"));
        assert!(lines(&plot(&[f32::NAN; 5], &[]), Marker::Braille).concat().contains("no values here"));
    }

    #[test]
    fn evaluations_are_points_and_the_crosshair_reads_values_off() {
        let values: Vec<f32> = (0..20).map(|i| i as f32 / 20.0).collect();
        let mut plot = plot(&values, &[(10, 0.5)]);
        plot.crosshair = Some(11.0);
        let lines = lines(&plot, Marker::Braille);
        assert!(lines.concat().contains('◆') && lines.concat().contains('┊'));
        assert!(lines[0].contains("a 0.50") && lines[0].contains("episode 11"), "{}", lines[0]);
    }
}
