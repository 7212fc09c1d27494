//! Axes: scales, ticks, labels, and conversion between values and cells.

use ratatui::prelude::*;

use super::range::Window;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::theme::Theme;
use mge_figures::{labelled_ticks, value_labels};

/// How values map to heights.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Decimal logarithm; values of 0 and below are gaps.
    Log,
}

impl Scale {
    /// The scaled value; NaN if there is none.
    pub fn apply(self, value: f32) -> f32 {
        match self {
            Self::Linear => value,
            Self::Log if value > 0.0 => value.log10(),
            Self::Log => f32::NAN,
        }
    }

    fn invert(self, scaled: f32) -> f32 {
        match self {
            Self::Linear => scaled,
            Self::Log => 10f32.powf(scaled),
        }
    }
}

/// A plot area with its ranges; `y` is scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// Cells of the plot, without labels.
    pub plot: Rect,
    /// Values at the left and the right edge.
    pub x: Window,
    /// Scaled values at the lower and the upper edge.
    pub y: [f32; 2],
    /// How values map to heights.
    pub scale: Scale,
}

/// Width of the labels on the left, in columns.
pub(super) const GUTTER: u16 = 6;

impl Axes {
    /// Draws axes and labels into `area`. None if it is too small for a plot.
    ///
    /// The labels of the x axis count units of a size and a name, which is left of them.
    pub fn draw(
        area: Rect,
        (x, unit): (Window, (f32, &str)),
        y: [f32; 2],
        scale: Scale,
        theme: &Theme,
        buffer: &mut Buffer,
    ) -> Option<Self> {
        if area.width < GUTTER + 4 || area.height < 3 {
            return None;
        }
        let plot = Rect { x: area.x + GUTTER, y: area.y, width: area.width - GUTTER, height: area.height - 1 };
        let y = if y[1] > y[0] { y } else { [y[0] - 0.5, y[0] + 0.5] };
        let axes = Self { plot, x, y, scale };
        axes.draw_y(theme, buffer);
        axes.draw_x(unit, theme, buffer);
        Some(axes)
    }

    fn draw_y(&self, theme: &Theme, buffer: &mut Buffer) {
        let width = GUTTER - 1;
        for row in self.plot.rows() {
            buffer.set_string(row.x - 1, row.y, "│", theme.border);
        }
        let most = usize::from(self.plot.height / 2).clamp(2, 6);
        for (value, text) in value_labels(self.y, self.scale == Scale::Log, most, width.into()) {
            let row = self.row(value).unwrap_or(self.plot.y);
            let place = Rect { x: self.plot.x - GUTTER, y: row, width, height: 1 };
            Line::styled(text, theme.faint()).right_aligned().render(place, buffer);
        }
    }

    fn draw_x(&self, (unit, name): (f32, &str), theme: &Theme, buffer: &mut Buffer) {
        let room = usize::from(GUTTER + self.plot.width / 2);
        let (x, y) = (self.plot.x - GUTTER, self.plot.bottom());
        let (end, _) = buffer.set_stringn(x, y, shortened(name, room, false), room, theme.faint());
        let mut free = self.plot.x.max(end + 1);
        let most = usize::from(self.plot.width / 10).clamp(2, 8);
        for (value, text) in labelled_ticks([self.x.from / unit, self.x.to / unit], most) {
            let (Some(column), width) = (self.column(value * unit), text.len() as u16) else { continue };
            let last = self.plot.right().saturating_sub(width);
            let start = column.saturating_sub(width / 2).min(last).max(self.plot.x);
            // A label wider than the plot is left out.
            if (free..=last).contains(&start) {
                buffer.set_string(start, self.plot.bottom(), text, theme.faint());
                free = start + width + 1;
            }
        }
    }

    /// Draws a vertical line at an x value, if that is visible, behind what is drawn already.
    pub fn bar(&self, x: f32, style: Style, buffer: &mut Buffer) {
        let Some(column) = self.column(x) else { return };
        for row in self.plot.top()..self.plot.bottom() {
            if buffer[(column, row)].symbol() == " " {
                buffer.set_string(column, row, "┊", style);
            }
        }
    }

    /// The coordinates of the edges of the plot: episodes and scaled values.
    pub fn bounds(&self) -> [[f32; 2]; 2] {
        [[self.x.from, self.x.to], self.y]
    }

    /// The row of a y value, if it is visible.
    pub fn row(&self, value: f32) -> Option<u16> {
        let share = 1.0 - (self.scale.apply(value) - self.y[0]) / (self.y[1] - self.y[0]);
        place(share, self.plot.height).map(|row| self.plot.y + row)
    }

    /// The x value in the middle of a column.
    pub fn x_at(&self, column: u16) -> f32 {
        let inside = column.clamp(self.plot.x, self.plot.right() - 1) - self.plot.x;
        let share = (f32::from(inside) + 0.5) / f32::from(self.plot.width);
        self.x.from + share * (self.x.to - self.x.from)
    }

    /// The y value in the middle of a row.
    pub fn y_at(&self, row: u16) -> f32 {
        let inside = row.clamp(self.plot.y, self.plot.bottom() - 1) - self.plot.y;
        let share = 1.0 - (f32::from(inside) + 0.5) / f32::from(self.plot.height);
        self.scale.invert(self.y[0] + share * (self.y[1] - self.y[0]))
    }

    /// The column of an x value, if it is visible.
    pub fn column(&self, x: f32) -> Option<u16> {
        let share = (x - self.x.from) / (self.x.to - self.x.from).max(f32::EPSILON);
        place(share, self.plot.width).map(|column| self.plot.x + column)
    }
}

/// The cell at a share of a length, if it is inside.
fn place(share: f32, length: u16) -> Option<u16> {
    let cell = (share * f32::from(length.saturating_sub(1))).round();
    (0.0..f32::from(length)).contains(&cell).then_some(cell as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_area_has_a_plot_and_a_range_of_one_value_is_widened() {
        use crate::tui::widgets::theme::{Depth, Marker, Palette};
        let draw = |width: u16, height: u16, y: [f32; 2]| {
            let area = Rect { x: 0, y: 0, width, height };
            let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
            let x = Window { from: 0.0, to: 10.0 };
            Axes::draw(area, (x, (1.0, "")), y, Scale::Linear, &theme, &mut Buffer::empty(area))
        };
        assert!(draw(GUTTER + 3, 3, [0.0, 1.0]).is_none() && draw(GUTTER + 4, 2, [0.0, 1.0]).is_none());
        let axes = draw(GUTTER + 4, 3, [0.0, 1.0]).unwrap();
        assert_eq!((axes.plot, axes.y), (Rect { x: GUTTER, y: 0, width: 4, height: 2 }, [0.0, 1.0]));
        assert_eq!(draw(30, 10, [0.5, 0.5]).unwrap().y, [0.0, 1.0]);
    }

    #[test]
    fn labels_are_apart_and_those_wider_than_the_plot_are_left_out() {
        use crate::tui::widgets::theme::{Depth, Marker, Palette};
        let labels = |width: u16, to: f32| -> String {
            let area = Rect::new(0, 0, GUTTER + width, 5);
            let mut buffer = Buffer::empty(area);
            let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
            let x = Window { from: 1.0, to };
            assert!(Axes::draw(area, (x, (1.0, "")), [0.0, 1.0], Scale::Linear, &theme, &mut buffer).is_some());
            (GUTTER..area.right()).map(|column| buffer[(column, 4)].symbol()).collect()
        };
        assert!(!labels(4, 10_000.0).contains('1'));
        assert_eq!(labels(10, 2000.0).trim(), "1000", "2000 would follow without a space");
    }

    #[test]
    fn values_and_cells_round_trip() {
        let plot = Rect::new(10, 5, 50, 20);
        let axes = Axes { plot, x: Window { from: 1.0, to: 100.0 }, y: [0.0, 1.0], scale: Scale::Linear };
        for column in [10, 30, 59] {
            assert_eq!(axes.column(axes.x_at(column)), Some(column));
        }
        assert!(axes.y_at(5) > 0.95 && axes.y_at(24) < 0.05);
        assert_eq!(axes.column(200.0), None);
        let powers = Axes { y: [-2.0, 2.0], scale: Scale::Log, ..axes };
        assert!(powers.y_at(5) > 50.0 && powers.y_at(24) < 0.02);
        assert_eq!([axes.row(1.0), axes.row(0.0), axes.row(1.1)], [Some(5), Some(24), None]);
    }

    #[test]
    fn cells_beyond_the_plot_have_the_values_at_its_edges() {
        let plot = Rect::new(10, 5, 50, 20);
        let axes = Axes { plot, x: Window { from: 1.0, to: 100.0 }, y: [0.0, 1.0], scale: Scale::Linear };
        assert_eq!([axes.x_at(0), axes.x_at(200)], [axes.x_at(10), axes.x_at(59)]);
        assert_eq!([axes.y_at(0), axes.y_at(200)], [axes.y_at(5), axes.y_at(24)]);
        assert!(axes.x_at(10) > 1.0 && axes.x_at(59) < 100.0);
    }

    #[test]
    fn logarithms_have_gaps_at_zero_and_below() {
        assert!(Scale::Log.apply(0.0).is_nan() && Scale::Log.apply(-1.0).is_nan());
        assert_eq!(Scale::Log.apply(100.0), 2.0);
    }
}
