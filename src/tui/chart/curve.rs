//! Draws charts of curves, with any number of episodes in the columns available.

use std::rc::Rc;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::text::Text;
use ratatui::widgets::Widget;

use super::axes::{Axes, Scale};
use super::cache::{ChartCache, Drawn, DrawnKey, PictureKey};
use super::decimated::{Column, Decimated, Look, union};
use super::legend::legend;
use super::plot::{Curve, Plot};
use crate::tui::widgets::columns;
use crate::tui::widgets::popup::wrap;
use crate::tui::widgets::raster::{self, Dot, Raster};
use crate::tui::widgets::theme::Theme;

/// Draws title, legend, axes and curves, reusing what the cache holds. Returns the axes unless the area is
/// too small.
pub fn draw(plot: &Plot, cache: &ChartCache, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Axes> {
    if area.height < 2 || area.width == 0 {
        return None;
    }
    let legend = legend(plot, area, theme);
    let height = Constraint::Length(legend.len() as u16);
    let [above, area] = Layout::vertical([height, Constraint::Fill(1)]).areas(area);
    Text::from(legend).render(above, buffer);
    let look = Look {
        x: plot.x,
        scale: plot.scale,
        smoothing: plot.smoothing,
        columns: Axes::width_of_plot(area) * theme.marker.dots()[0],
    };
    let drawn = cache.drawn(drawn_key(plot, &look), || lines(plot, cache, &look));
    let found = range(&drawn, plot);
    let axes = Axes::draw(area, plot.x, found.unwrap_or([0.0, 1.0]), plot.scale, theme, buffer)?;
    if found.is_none() {
        let text = match (plot.curves.iter().any(|curve| !curve.values.is_empty()), plot.scale) {
            (false, _) => plot.empty,
            (true, Scale::Linear) => "no values here",
            (true, Scale::Log) => "no values above zero here",
        };
        let lines = wrap(text, usize::from(axes.plot.width));
        let height = (lines.len() as u16).min(axes.plot.height);
        let middle = Rect { y: axes.plot.y + (axes.plot.height - height) / 2, height, ..axes.plot };
        Text::from_iter(lines).style(theme.faint()).centered().render(middle, buffer);
        return Some(axes);
    }
    let paint = |area: Rect, buffer: &mut Buffer| {
        raster::draw(area, theme.marker, buffer, |raster| {
            for curve in &plot.curves {
                shade(curve, &look, &axes, raster);
            }
            for (line, curve) in drawn.lines.iter().zip(&plot.curves) {
                trace(line, curve, &axes, raster);
            }
        });
    };
    match drawn.number {
        Some(number) => {
            let range = found.unwrap_or_default().map(f32::to_bits);
            let key =
                PictureKey { number, range, size: [axes.plot.width, axes.plot.height], dots: theme.marker.dots() };
            let place = Rect { x: 0, y: 0, ..axes.plot };
            let draw = || {
                let mut picture = Buffer::empty(place);
                paint(place, &mut picture);
                picture
            };
            overlay(&cache.picture(key, draw), axes.plot, buffer);
        }
        None => paint(axes.plot, buffer),
    }
    points(plot, &axes, theme, buffer);
    marks(plot, &axes, theme, buffer);
    crosshair(plot, &axes, theme, buffer);
    Some(axes)
}

/// The cache key of the curves of a chart. None if one of them has no version.
fn drawn_key(plot: &Plot, look: &Look) -> Option<DrawnKey> {
    let curve = |curve: &Curve| Some((curve.version?, curve.colour, curve.partial, curve.band.is_some()));
    let curves = plot.curves.iter().map(curve).collect::<Option<Vec<_>>>()?;
    Some(DrawnKey { curves, look: look.key() })
}

/// The decimated curves.
fn lines(plot: &Plot, cache: &ChartCache, look: &Look) -> Vec<Rc<Decimated>> {
    plot.curves.iter().map(|curve| cache.decimated(curve.version, curve.episodes, curve.values, look)).collect()
}

/// Copies a picture onto an area; cells without a dot stay as they are.
fn overlay(picture: &Buffer, area: Rect, buffer: &mut Buffer) {
    for (from, position) in picture.content.iter().zip(area.positions()) {
        if from.symbol() != " " {
            let cell = &mut buffer[position];
            cell.set_symbol(from.symbol()).set_fg(from.fg);
            if from.bg != Color::Reset {
                cell.set_bg(from.bg);
            }
        }
    }
}

/// The range of the y axis: lowest and highest scaled value with a margin, or at least `plot.y`. None if no value
/// is finite.
fn range(drawn: &Drawn, plot: &Plot) -> Option<[f32; 2]> {
    let points = plot.curves.iter().flat_map(|curve| curve.points.iter().map(|(_, value)| plot.scale.apply(*value)));
    let points = points.filter(|value| value.is_finite()).map(|value| [value; 2]);
    let ranges = drawn.range.into_iter().chain(points);
    let found = ranges.reduce(union)?;
    match plot.y.filter(|_| plot.scale == Scale::Linear) {
        Some(least) => Some(union(found, least)),
        None => {
            let margin = ((found[1] - found[0]) * 0.05)
                .max(found[1].abs() * if found[0] == found[1] { 0.1 } else { 1e-3 })
                .max(1e-6);
            Some([found[0] - margin, found[1] + margin])
        }
    }
}

/// Shades the band around a curve with sparse dots, so that the lines over it remain visible.
fn shade(curve: &Curve, look: &Look, axes: &Axes, raster: &mut Raster) {
    let Some(ends) = curve.band else { return };
    let size = raster.size();
    let mut dots = Vec::new();
    for (column, [low, high]) in look.samples(curve.episodes, ends) {
        let [bottom, top] = [low, high].map(|value| axes.height(size, value));
        let rows = top.floor().max(0.0) as usize..=bottom.floor().clamp(0.0, size[1]) as usize;
        let shift = usize::from(column) / 2 % 2;
        dots.extend(rows.filter(|row| row % 2 == shift).map(|row| [f32::from(column) + 0.5, row as f32]));
    }
    raster.points(dots, curve.colour);
}

/// Draws a line: neighbouring columns are connected, and a column with several values covers
/// their whole range.
fn trace(line: &Decimated, curve: &Curve, axes: &Axes, raster: &mut Raster) {
    let size = raster.size();
    let dot = |column: &Column, value: f32| -> Dot { [f32::from(column.x) + 0.5, axes.height(size, value)] };
    for (place, column) in line.columns.iter().enumerate() {
        if column.last <= curve.partial {
            let last = [dot(column, column.ends[1])];
            raster.points(last.into_iter().filter(|_| column.x % 3 == 0), curve.colour);
            continue;
        }
        let [bottom, top] = column.range.map(|value| dot(column, value));
        raster.line(top, bottom, curve.colour);
        if let Some(next) = line.columns.get(place + 1).filter(|next| !next.after_gap) {
            raster.line(dot(column, column.ends[1]), dot(next, next.ends[0]), curve.colour);
        }
    }
}

/// Draws the marks along the lower edge, and beside the crosshair the descriptions of the marks there.
fn marks(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let sign = theme.symbol("▲", "^");
    let row = axes.plot.bottom() - 1;
    for (episode, colour, _) in &plot.marks {
        if let Some(column) = axes.column(*episode as f32) {
            buffer.set_string(column, row, sign, Style::new().fg(*colour));
        }
    }
    let Some(column) = plot.crosshair.and_then(|at| axes.column(at)) else { return };
    let here = plot.marks.iter().filter(|(episode, ..)| axes.column(*episode as f32) == Some(column));
    let texts: Vec<&str> = here.map(|(.., text)| *text).collect();
    let text = columns::shortened(&texts.join(", "), usize::from(axes.plot.width), false);
    if !text.is_empty() && axes.plot.height > 2 {
        let last = axes.plot.right().saturating_sub(columns::width(&text) as u16).max(axes.plot.x);
        buffer.set_string((column + 2).min(last), row - 1, text, theme.strong());
    }
}

fn points(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let mark = theme.symbol("◆", "o");
    for curve in &plot.curves {
        for (episode, value) in curve.points {
            if let (Some(column), Some(row)) = (axes.column(*episode as f32), axes.row(*value)) {
                buffer.set_string(column, row, mark, Style::new().fg(curve.colour));
            }
        }
    }
}

fn crosshair(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let Some(column) = plot.crosshair.and_then(|at| axes.column(at)) else { return };
    let bar = theme.symbol("┊", "|");
    for row in axes.plot.top()..axes.plot.bottom() {
        if buffer[(column, row)].symbol() == " " {
            buffer.set_string(column, row, bar, theme.faint());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;
    use crate::tui::chart::Window;
    use crate::tui::widgets::theme::{Depth, Marker, Palette};

    static EPISODES: std::sync::LazyLock<Vec<u64>> = std::sync::LazyLock::new(|| (1..=100_000).collect());

    fn curve<'a>(name: &str, values: &'a [f32], points: &'a [(u64, f32)]) -> Curve<'a> {
        let (name, episodes) = (Cow::Owned(name.to_owned()), &EPISODES[..values.len()]);
        Curve { name, colour: Color::Red, episodes, values, version: None, band: None, partial: 0, points }
    }

    fn plot<'a>(values: &'a [f32], points: &'a [(u64, f32)]) -> Plot<'a> {
        Plot {
            title: "loss",
            curves: vec![curve("a", values, points)],
            x: Window { from: 1.0, to: values.len().max(10) as f32 },
            y: None,
            scale: Scale::Linear,
            smoothing: 1,
            crosshair: None,
            marks: Vec::new(),
            shortenings: &[],
            empty: "press t",
        }
    }

    fn lines(plot: &Plot, marker: Marker) -> Vec<String> {
        let area = Rect::new(0, 0, 26, 6);
        let mut buffer = Buffer::empty(area);
        draw(plot, &ChartCache::default(), area, &Theme::new(Palette::Dark, Depth::True, marker), &mut buffer);
        let row = |y: u16| (0..area.width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        (0..area.height).map(|y| row(y).trim_end().to_owned()).collect()
    }

    #[test]
    fn a_ramp_rises_from_left_to_right() {
        let values: Vec<f32> = (0..20).map(|i| i as f32).collect();
        let lines = lines(&plot(&values, &[]), Marker::Ascii);
        assert_eq!(lines[0], "loss  a 19");
        assert!(lines[1].ends_with('*') && lines[4].contains("|***"), "{lines:#?}");
        assert_eq!(lines[5].trim_start(), "10        20");
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
    fn a_single_spike_in_a_hundred_thousand_episodes_is_visible() {
        let mut values = vec![0.0; 100_000];
        values[54_321] = 1.0;
        let lines = lines(&plot(&values, &[]), Marker::Ascii);
        assert!(lines[1].contains('*'), "{lines:#?}");
    }

    #[test]
    fn smoothing_is_a_trailing_mean_over_finite_values() {
        let values = [0.0, 4.0, 2.0, f32::NAN, 6.0];
        let look = Look { x: Window { from: 1.0, to: 5.0 }, scale: Scale::Linear, smoothing: 2, columns: 50 };
        let smooth: Vec<f32> =
            look.decimate(&EPISODES[..5], &values).columns.iter().map(|column| column.ends[0]).collect();
        assert_eq!(smooth, [0.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn values_of_an_unfilled_window_are_dotted() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        plot.curves[0].partial = 10;
        let lines = lines(&plot, Marker::Ascii);
        let drawn = lines.iter().find(|line| line.contains('*')).unwrap();
        assert!(drawn.contains("* ") && drawn.ends_with("*********"), "{lines:#?}");
    }

    #[test]
    fn a_band_is_dots_between_its_ends_and_moves_neither_line_nor_axis() {
        let (values, low, high) = ([0.5; 40], [0.0; 40], [1.0; 40]);
        let mut plot = plot(&values, &[]);
        plot.y = Some([0.0, 1.0]);
        let without = lines(&plot, Marker::Ascii);
        plot.curves[0].band = Some([&low, &high]);
        let with = lines(&plot, Marker::Ascii);
        let dots = |lines: &[String]| lines.concat().matches('*').count();
        assert!(dots(&with) > dots(&without) + 10, "{with:#?}");
        assert_eq!(with[0], without[0]);
        plot.curves[0].band = Some([&[f32::NAN; 40], &high]);
        assert_eq!(lines(&plot, Marker::Ascii), without, "a band without bounds is not drawn");
    }

    #[test]
    fn curves_without_room_in_the_legend_are_counted() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        let names = ["one", "two", "three", "four", "five", "six", "seven", "eight"];
        plot.curves = names.map(|name| curve(name, &values, &[])).into();
        assert_eq!(lines(&plot, Marker::Ascii)[..2], ["loss  one 1  two 1", "  three 1  +5 more"]);
    }

    #[test]
    fn names_are_shortened_before_curves_are_left_out() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        plot.curves = ["first of all the names"].map(|name| curve(name, &values, &[])).into();
        plot.shortenings = &[16, 12, 8];
        assert_eq!(lines(&plot, Marker::Ascii)[0], "loss  first of all t.. 1");
        plot.crosshair = Some(3.0);
        assert_eq!(lines(&plot, Marker::Ascii)[0], "loss  at 3  first .. 1");
    }

    #[test]
    fn an_empty_chart_says_what_to_do() {
        let mut long = plot(&[], &[]);
        long.empty = "no episodes yet: t trains";
        let text = lines(&long, Marker::Ascii).join(" ");
        assert!(["no episodes yet: t", "trains"].iter().all(|part| text.contains(part)), "{text}");
        assert!(lines(&plot(&[], &[]), Marker::Braille).concat().contains("press t"));
        assert!(lines(&plot(&[f32::NAN; 5], &[]), Marker::Braille).concat().contains("no values here"));
    }

    #[test]
    fn interventions_are_marked_and_named_at_the_crosshair() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        plot.marks = vec![(10, Color::Red, "epsilon 0.1")];
        let without = lines(&plot, Marker::Ascii);
        assert!(without[4].contains('^') && !without.concat().contains("epsilon"), "{without:#?}");
        plot.crosshair = Some(10.0);
        assert!(lines(&plot, Marker::Ascii)[3].contains("epsilon 0.1"));
        plot.crosshair = Some(17.0);
        assert_eq!(lines(&plot, Marker::Ascii).concat().matches("epsilon").count(), 0);
        (plot.marks, plot.crosshair) = (vec![(3, Color::Red, "epsilon 0.1")], Some(3.0));
        let early = lines(&plot, Marker::Ascii);
        let column = early[4].find('^').unwrap();
        assert_eq!(early[3].find("epsilon 0.1"), Some(column + 2), "{early:#?}");
    }

    /// The characters of a chart of this height.
    fn of_height(plot: &Plot, height: u16) -> String {
        let area = Rect::new(0, 0, 26, height);
        let mut buffer = Buffer::empty(area);
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Ascii);
        draw(plot, &ChartCache::default(), area, &theme, &mut buffer);
        buffer.content.iter().map(|cell| cell.symbol()).collect()
    }

    #[test]
    fn a_low_chart_leaves_out_the_names_of_marks_then_the_plot_then_everything() {
        let values: Vec<f32> = (0..20).map(|i| i as f32).collect();
        let mut plot = plot(&values, &[]);
        (plot.marks, plot.crosshair) = (vec![(3, Color::Red, "epsilon 0.1")], Some(3.0));
        assert!(of_height(&plot, 5).contains("epsilon 0.1"));
        let low = of_height(&plot, 4);
        assert!(low.contains('^') && !low.contains("epsilon"), "{low}");
        let title = of_height(&plot, 2);
        assert!(title.contains("loss") && !title.contains('*'), "{title}");
        assert_eq!(of_height(&plot, 1).trim(), "");
    }

    #[test]
    fn a_cached_picture_is_the_same_as_one_that_is_not_cached() {
        let ramp: Vec<f32> = (0..20).map(|i| i as f32 / 20.0).collect();
        let drawn = |marker: Marker, is_cached: bool| {
            let mut plot = plot(&[0.0; 20], &[]);
            plot.curves.push(Curve { colour: Color::Blue, ..curve("b", &ramp, &[]) });
            for (index, curve) in plot.curves.iter_mut().enumerate() {
                curve.version = Some((7, index)).filter(|_| is_cached);
            }
            let area = Rect::new(0, 0, 26, 6);
            let mut buffer = Buffer::empty(area);
            draw(&plot, &ChartCache::default(), area, &Theme::new(Palette::Dark, Depth::True, marker), &mut buffer);
            buffer
        };
        for marker in [Marker::Braille, Marker::HalfBlock, Marker::Ascii] {
            assert_eq!(drawn(marker, true), drawn(marker, false), "{marker:?}");
        }
        let halves = drawn(Marker::HalfBlock, true);
        assert!(halves.content.iter().any(|cell| cell.bg == Color::Red), "a cell with dots of both curves");
    }

    #[test]
    fn the_title_is_shortened_only_if_more_curves_fit() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        plot.curves = vec![curve("a curve with a long name", &values, &[])];
        plot.crosshair = Some(3.0);
        assert_eq!(lines(&plot, Marker::Ascii)[0], "loss  episode 3");
    }

    #[test]
    fn evaluations_are_points_and_the_legend_shows_values_at_the_crosshair() {
        let values: Vec<f32> = (0..20).map(|i| i as f32 / 20.0).collect();
        let mut plot = plot(&values, &[(10, 0.5)]);
        plot.crosshair = Some(11.0);
        let lines = lines(&plot, Marker::Braille);
        assert!(lines.concat().contains('◆') && lines.concat().contains('┊'));
        assert!(lines[0].contains("a 0.50") && lines[0].contains("episode 11"), "{}", lines[0]);
    }
}
