//! Page layout: panels of equal plots, legend above, note below.

use super::axes::{X_LABEL, Y_LABEL};
use super::canvas::{Canvas, Pen, TextFormat};
use super::geometry::Rect;
use super::style::{BAND_OPACITY, Color, GAP, GREY, LABEL_SIZE, MARGIN, SMALL_SIZE, Series, faded};

/// A cell of a grid whose plots have equal insides: outer cells are larger by the axis labels that only they have.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    /// Where the plot goes, labels included.
    pub cell: Rect,
    /// Whether the y axis is labelled (first column).
    pub y_label: bool,
    /// Whether the x axis is labelled (last cell of its column).
    pub x_label: bool,
}

/// `count` panels, row by row in `columns`.
pub fn panels(rect: Rect, count: usize, columns: usize) -> Vec<Panel> {
    let inner = rect.cut(Y_LABEL, 0.0, 0.0, X_LABEL);
    let cells = inner.grid(count.div_ceil(columns), columns, GAP);
    let panel = |(n, cell): (usize, Rect)| {
        let (y_label, x_label) = (n % columns == 0, n + columns >= count);
        let (left, below) = (if y_label { Y_LABEL } else { 0.0 }, if x_label { X_LABEL } else { 0.0 });
        Panel { cell: cell.cut(-left, 0.0, 0.0, -below), y_label, x_label }
    };
    cells.into_iter().enumerate().take(count).map(panel).collect()
}

/// Height of a page of this width on which [`panels`] are squares, plus `extra` for legend and note.
pub fn squares_height(width: f64, count: usize, columns: usize, extra: f64) -> f64 {
    /// Ticks left of and below a plot, its title above.
    const BESIDE: f64 = 25.0;
    const AROUND: f64 = 25.0;
    let gaps = |n: usize| GAP * (n - 1) as f64;
    let side = (width - 2.0 * MARGIN - Y_LABEL - gaps(columns)) / columns as f64 - BESIDE;
    let rows = count.div_ceil(columns).max(1);
    rows as f64 * (side + AROUND) + gaps(rows) + X_LABEL + 2.0 * MARGIN + extra
}

/// Height of a legend of one row.
pub const LEGEND: f64 = ROW + 2.0;
/// Height of a line of a note.
pub const NOTE: f64 = 1.35 * SMALL_SIZE;

/// The mark before a label in a legend.
#[derive(Debug, Clone, Copy)]
pub enum Mark {
    /// A line.
    Line(Pen),
    /// A line with a band.
    Band(Pen),
    /// A filled patch.
    Patch(Color),
    /// A dot.
    Dot(Color),
}

impl Series {
    /// A pen of this width in its style.
    pub fn pen(&self, width: f64) -> Pen {
        Pen::new(self.color, width).dashed(self.dash)
    }
}

/// Width of a mark, gap between mark and label, gap between entries.
const MARK: f64 = 12.0;
const SPACE: f64 = 4.0;
const BETWEEN: f64 = 12.0;
const ROW: f64 = 1.5 * LABEL_SIZE;

/// The entries of a legend of this width, row by row, and the width of each.
fn legend_rows(width: f64, entries: &[(Mark, String)]) -> (Vec<Vec<usize>>, Vec<f64>) {
    let widths: Vec<f64> =
        entries.iter().map(|(_, label)| (MARK + SPACE + TextFormat::LABEL.width(label)).min(width)).collect();
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut used = f64::INFINITY;
    for (n, own) in widths.iter().enumerate() {
        if used + BETWEEN + own > width {
            rows.push(Vec::new());
            used = -BETWEEN;
        }
        used += BETWEEN + own;
        // The first entry always pushes a row, since `used` starts at infinity.
        rows.last_mut().expect("a row").push(n);
    }
    (rows, widths)
}

/// Height of a legend of this width.
pub fn legend_height(width: f64, entries: &[(Mark, String)]) -> f64 {
    match legend_rows(width, entries).0.len() {
        0 => 0.0,
        rows => rows as f64 * ROW + 2.0,
    }
}

/// Draws a legend along the top of `rect`, centred, in as many rows as it needs, and returns the rectangle below.
pub fn legend(canvas: &Canvas, rect: Rect, entries: &[(Mark, String)]) -> Rect {
    let (rows, widths) = legend_rows(rect.width(), entries);
    for (row, members) in rows.iter().enumerate() {
        let total = members.iter().map(|&n| widths[n]).sum::<f64>() + BETWEEN * (members.len() - 1) as f64;
        let mut x = rect.center()[0] - total / 2.0;
        let y = rect.top + (row as f64 + 0.5) * ROW;
        for &n in members {
            let (mark, label) = &entries[n];
            draw_mark(canvas, *mark, x, y);
            canvas.text(
                [x + MARK + SPACE, y],
                &fitted(label, TextFormat::LABEL, widths[n] - MARK - SPACE),
                TextFormat::LABEL,
            );
            x += widths[n] + BETWEEN;
        }
    }
    rect.split_top(legend_height(rect.width(), entries)).1
}

/// A label, truncated with an ellipsis to fit the width.
pub(super) fn fitted(label: &str, kind: TextFormat, width: f64) -> String {
    let fits = |text: &str| kind.width(text) <= width + 1e-9;
    if fits(label) {
        return label.to_owned();
    }
    let ends = label.char_indices().rev().map(|(end, _)| format!("{}\u{2026}", label[..end].trim_end()));
    ends.into_iter().find(|text| fits(text)).unwrap_or_default()
}

fn draw_mark(canvas: &Canvas, mark: Mark, x: f64, y: f64) {
    let bar = |half: f64| Rect::new(x, y - half, x + MARK, y + half);
    let line = [[x, y], [x + MARK, y]];
    match mark {
        Mark::Line(pen) => canvas.line(&line, pen),
        Mark::Band(pen) => {
            canvas.fill(&bar(3.0).corners(), faded(pen.color, BAND_OPACITY));
            canvas.line(&line, pen);
        }
        Mark::Patch(color) => canvas.fill(&bar(3.0).corners(), color),
        Mark::Dot(color) => canvas.dot([x + MARK / 2.0, y], 2.2, color),
    }
}

/// Draws what is around the panels of a figure, the note below and the legend above them, and returns the rectangle
/// between these. A figure without data has only the message `empty`, and no such rectangle.
pub fn around_panels(
    canvas: &Canvas,
    page: Rect,
    empty: Option<&str>,
    text: &str,
    marks: &[(Mark, String)],
) -> Option<Rect> {
    if let Some(message) = empty {
        canvas.placeholder(page, message);
        return None;
    }
    Some(legend(canvas, note(canvas, page, text), marks))
}

/// Wraps a note at word boundaries.
fn note_lines(width: f64, text: &str) -> Vec<String> {
    let text = text.replace(" %", "\u{a0}%");
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if TextFormat::SMALL.width(&format!("{line} {word}")) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Height of a note on a page of this width.
pub fn note_height(page_width: f64, text: &str) -> f64 {
    NOTE * note_lines(page_width - 2.0 * MARGIN, text).len() as f64
}

/// Writes a wrapped note along the bottom of `rect` and returns the rectangle above.
pub fn note(canvas: &Canvas, rect: Rect, text: &str) -> Rect {
    let look = TextFormat::SMALL.color(GREY);
    let lines = note_lines(rect.width(), text);
    let (rest, foot) = rect.split_bottom(NOTE * lines.len() as f64);
    for (n, line) in lines.iter().enumerate() {
        canvas.text([foot.left, foot.top + (n as f64 + 0.6) * NOTE], line, look);
    }
    rest
}
