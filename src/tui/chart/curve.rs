//! Draws charts of curves, with any number of episodes in the columns available.

use ratatui::prelude::*;
use ratatui::widgets::canvas::Context;

use super::axes::{Axes, GUTTER, Scale};
use super::decimated::{Look, union};
use super::legend::legend;
use super::plot::{Curve, Plot};
use crate::tui::widgets::canvas::{self, Point};
use crate::tui::widgets::popup::wrap;
use crate::tui::widgets::theme::Theme;

/// Draws title, legend, axes and curves. Returns the axes unless the area is too small.
pub fn draw(plot: &Plot, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Axes> {
    if area.height < 2 || area.width == 0 {
        return None;
    }
    let legend = legend(plot, area, theme);
    let evaluated: Vec<&Curve> = plot.curves.iter().filter(|curve| !curve.evaluations.is_empty()).collect();
    let heights = [legend.len() as u16, (area.height / 5).min(evaluated.len() as u16)].map(Constraint::Length);
    let [above, area, below] = Layout::vertical([heights[0], Constraint::Fill(1), heights[1]]).areas(area);
    Text::from(legend).render(above, buffer);
    // Braille has two columns of dots in each cell.
    let columns = (2 * area.width.saturating_sub(GUTTER)).max(2);
    let look = |curve: &Curve| Look { x: plot.x, scale: plot.scale, smoothing: curve.smoothing, columns };
    let lines: Vec<Vec<Point>> = plot.curves.iter().map(|one| look(one).decimate(one.episodes, one.values)).collect();
    let found = range(&lines, plot);
    let axes = Axes::draw(area, (plot.x, plot.unit), found.unwrap_or([0.0, 1.0]), plot.scale, theme, buffer)?;
    if found.is_none() {
        nothing(plot, &axes, theme, buffer);
        return Some(axes);
    }
    canvas::draw(axes.plot, theme.marker, axes.bounds(), buffer, |context| {
        plot.curves.iter().for_each(|curve| shade(curve, &look(curve), &axes, context));
        plot.curves.iter().zip(&lines).for_each(|(curve, line)| trace(curve, line, context));
    });
    plot.crosshair.into_iter().for_each(|[x, _]| axes.bar(x, theme.faint(), buffer));
    evaluated.iter().zip(below.rows()).for_each(|(curve, row)| evaluations(curve, row, &axes, theme, buffer));
    Some(axes)
}

/// Says why there is no curve.
fn nothing(plot: &Plot, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    let text = match (plot.curves.iter().any(|curve| !curve.values.is_empty()), plot.scale) {
        (false, _) => plot.empty,
        (true, Scale::Linear) => "no values here",
        (true, Scale::Log) => "no values above zero here",
    };
    let lines = wrap(text, usize::from(axes.plot.width));
    let height = Constraint::Length(lines.len() as u16);
    let middle = axes.plot.centered_vertically(height);
    Text::from_iter(lines).style(theme.faint()).centered().render(middle, buffer);
}

/// The range of the y axis: lowest and highest scaled value with a margin, or at least `plot.y`. None if no value
/// is finite.
fn range(lines: &[Vec<Point>], plot: &Plot) -> Option<[f32; 2]> {
    let values = lines.iter().flatten().map(|point| point[1]);
    let found = values.filter(|value| value.is_finite()).map(|value| [value; 2]).reduce(union)?;
    match plot.y.filter(|_| plot.scale == Scale::Linear) {
        Some(least) => Some(union(found, least)),
        None => {
            let margin =
                ((found[1] - found[0]) * 0.05).max(found[1].abs() * if found[0] == found[1] { 0.1 } else { 1e-3 });
            Some([found[0] - margin, found[1] + margin])
        }
    }
}

/// Shades the band around a curve with sparse dots, so that the lines over it remain visible.
fn shade(curve: &Curve, look: &Look, axes: &Axes, context: &mut Context) {
    let Some(band) = curve.band else { return };
    let every_other = Look { columns: (look.columns / 2).max(2), ..*look };
    let [low, high] = band.map(|end| every_other.decimate(curve.episodes, end));
    // Braille has four rows of dots in each cell.
    let row = (axes.y[1] - axes.y[0]) / f32::from(4 * axes.plot.height);
    let ends = low.iter().zip(&high).enumerate().filter(|(_, (low, high))| low[1].is_finite() && high[1].is_finite());
    let dots = ends.flat_map(|(index, (low, high))| {
        let [first, last] = [low[1].max(axes.y[0]), high[1].min(axes.y[1])].map(|value| (value / row) as i64);
        let rows = (first..=last).filter(move |row| (row + index as i64) % 2 == 0);
        rows.map(move |place| [low[0], place as f32 * row])
    });
    canvas::dots(context, dots, curve.colour);
}

/// Draws a curve; its first part, of means over an unfilled window, as dots.
fn trace(curve: &Curve, line: &[Point], context: &mut Context) {
    let (partial, whole) = line.split_at(line.partition_point(|point| point[0] <= curve.partial as f32));
    canvas::dots(context, partial.iter().copied().step_by(3), curve.colour);
    canvas::path(context, whole, curve.colour);
}

/// Marks the evaluations of a curve in a row of their own: filled if all attempts succeeded, hollow if none did.
fn evaluations(curve: &Curve, row: Rect, axes: &Axes, theme: &Theme, buffer: &mut Buffer) {
    buffer.set_string(row.x, row.y, "greedy", theme.faint());
    let placed = curve.evaluations.iter().filter_map(|(episode, value)| Some((axes.column(*episode as f32)?, *value)));
    for marks in placed.collect::<Vec<_>>().chunk_by(|a, b| a.0 == b.0) {
        let mark = match marks.iter().map(|(_, value)| value).sum::<f32>() / marks.len() as f32 {
            1.0.. => "●",
            0.0 => "○",
            _ => "◐",
        };
        buffer.set_string(marks[0].0, row.y, mark, Style::new().fg(curve.colour));
    }
}

#[cfg(test)]
mod tests {
    use ratatui::style::Color;

    use super::*;
    use crate::tui::chart::Window;
    use crate::tui::widgets::theme::{ASCII, Depth, Marker, Palette};

    static EPISODES: std::sync::LazyLock<Vec<u64>> = std::sync::LazyLock::new(|| (1..=100_000).collect());

    fn curve<'a>(name: &'a str, values: &'a [f32], evaluations: &'a [(u64, f32)]) -> Curve<'a> {
        let episodes = &EPISODES[..values.len()];
        Curve { name, colour: Color::Red, episodes, values, band: None, smoothing: 1, partial: 0, evaluations }
    }

    fn plot<'a>(values: &'a [f32], points: &'a [(u64, f32)]) -> Plot<'a> {
        Plot {
            title: "loss",
            curves: vec![curve("a", values, points)],
            x: Window { from: 1.0, to: values.len().max(10) as f32 },
            y: None,
            scale: Scale::Linear,
            unit: (1.0, "episode"),
            crosshair: None,
            more: "more",
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
        let lines = lines(&plot(&values, &[]), ASCII);
        assert_eq!(lines[0], "loss  a: 19");
        assert!(lines[1].ends_with('*') && lines[4].contains("│***"), "{lines:#?}");
        assert_eq!(lines[5], "episode       10        20");
    }

    #[test]
    fn values_that_are_not_finite_are_gaps() {
        let mut values = vec![1.0; 20];
        values[9] = f32::NAN;
        values[10] = f32::INFINITY;
        values[0] = 2.0;
        let lines = lines(&plot(&values, &[]), ASCII);
        assert!(lines[4].contains("* ") && lines[4].ends_with("*"), "{lines:#?}");
        assert!(!lines[0].contains("inf"));
    }

    #[test]
    fn a_single_spike_in_a_hundred_thousand_episodes_is_visible() {
        let mut values = vec![0.0; 100_000];
        values[54_321] = 1.0;
        let lines = lines(&plot(&values, &[]), ASCII);
        assert!(lines[1].contains('*'), "{lines:#?}");
    }

    #[test]
    fn values_of_an_unfilled_window_are_dotted() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        plot.curves[0].partial = 10;
        let lines = lines(&plot, ASCII);
        let drawn = lines.iter().find(|line| line.contains('*')).unwrap();
        assert!(drawn.contains("* ") && drawn.ends_with("*********"), "{lines:#?}");
    }

    #[test]
    fn a_band_is_dots_between_its_ends_and_moves_neither_line_nor_axis() {
        let (values, low, high) = ([0.5; 40], [0.0; 40], [1.0; 40]);
        let mut plot = plot(&values, &[]);
        plot.y = Some([0.0, 1.0]);
        let without = lines(&plot, ASCII);
        plot.curves[0].band = Some([&low, &high]);
        let with = lines(&plot, ASCII);
        let dots = |lines: &[String]| lines.concat().matches('*').count();
        assert!(dots(&with) > dots(&without) + 10, "{with:#?}");
        assert_eq!(with[0], without[0]);
        plot.curves[0].band = Some([&[f32::NAN; 40], &high]);
        assert_eq!(lines(&plot, ASCII), without, "a band without bounds is not drawn");
    }

    #[test]
    fn curves_without_room_in_the_legend_are_counted() {
        let values = [1.0; 20];
        let mut plot = plot(&values, &[]);
        let names = ["one", "two", "three", "four", "five", "six", "seven", "eight"];
        plot.curves = names.map(|name| curve(name, &values, &[])).into();
        let small = lines(&plot, ASCII);
        assert_eq!(small[..2], ["loss  1  1  1  1  1  1  1", "  1"], "their values in their colours");
        assert!(of_height(&plot, 11).contains("six: 1") && of_height(&plot, 11).contains("+2 more"));
        assert!(of_height(&plot, 14).contains("eight: 1") && !of_height(&plot, 14).contains("more"));
    }

    #[test]
    fn a_name_is_cut_only_where_there_is_no_room_for_it() {
        let values = [1.0; 20];
        let name = "longer than half of the width of a chart";
        let shown = |count: usize| {
            let area = Rect::new(0, 0, 60, 12);
            let plot = Plot { curves: vec![curve(name, &values, &[]); count], ..plot(&values, &[]) };
            let lines = legend(&plot, area, &Theme::new(Palette::Dark, Depth::True, ASCII));
            lines.iter().filter(|line| line.to_string().contains(name)).count()
        };
        assert_eq!([shown(1), shown(9)], [1, 0]);
    }

    #[test]
    fn an_empty_chart_says_what_to_do() {
        let mut long = plot(&[], &[]);
        long.empty = "no episodes yet: t trains";
        let text = lines(&long, ASCII).join(" ");
        assert!(["no episodes yet: t", "trains"].iter().all(|part| text.contains(part)), "{text}");
        assert!(lines(&plot(&[], &[]), Marker::Braille).concat().contains("press t"));
        assert!(lines(&plot(&[f32::NAN; 5], &[]), Marker::Braille).concat().contains("no values here"));
    }

    /// The characters of a chart of this height.
    fn of_height(plot: &Plot, height: u16) -> String {
        let area = Rect::new(0, 0, 26, height);
        let mut buffer = Buffer::empty(area);
        let theme = Theme::new(Palette::Dark, Depth::True, ASCII);
        draw(plot, area, &theme, &mut buffer);
        buffer.content.iter().map(|cell| cell.symbol()).collect()
    }

    #[test]
    fn a_low_chart_leaves_out_the_plot_then_everything() {
        let values: Vec<f32> = (0..20).map(|i| i as f32).collect();
        let plot = plot(&values, &[]);
        let title = of_height(&plot, 2);
        assert!(title.contains("loss") && !title.contains('*'), "{title}");
        assert_eq!(of_height(&plot, 1).trim(), "");
    }

    #[test]
    fn evaluations_have_a_row_of_their_own_and_the_legend_shows_values_at_the_crosshair() {
        let values: Vec<f32> = (0..20).map(|i| i as f32 / 20.0).collect();
        let mut plot = plot(&values, &[(1, 0.0), (10, 0.5), (20, 1.0)]);
        plot.crosshair = Some([11.0; 2]);
        let lines = lines(&plot, Marker::Braille);
        assert_eq!(lines.last().unwrap(), "greedy○        ◐         ●");
        assert!(lines.concat().contains('┊') && lines[4].starts_with("episode"), "{lines:#?}");
        assert!(lines[0].contains("a: 0.50") && lines[0].contains("episode 11"), "{}", lines[0]);
    }
}
