//! Parts of a page around the plots: legend and note.

use super::FigureError;
use super::canvas::{Canvas, Pen, Type};
use super::geometry::Rect;
use super::style::{Color, GREY, LABEL_SIZE, LINE_WIDTH, SMALL_SIZE, faded};

/// What stands before a label in a legend.
#[derive(Debug, Clone, Copy)]
pub enum Mark {
    /// A line with a band.
    Line(Color),
    /// A dashed line.
    Dashed(Color),
    /// A filled patch.
    Patch(Color),
    /// A dot.
    Dot(Color),
}

/// Space of a mark, between mark and label, and between entries.
const MARK: f64 = 12.0;
const SPACE: f64 = 4.0;
const BETWEEN: f64 = 12.0;
const ROW: f64 = 1.5 * LABEL_SIZE;

/// Draws a legend along the top of `rect`, centred, in as many rows as it needs, and
/// returns what is left below.
///
/// # Errors
/// When the backend fails.
pub fn legend(canvas: &Canvas<'_>, rect: Rect, entries: &[(Mark, String)]) -> Result<Rect, FigureError> {
    let widths: Vec<f64> = entries.iter().map(|(_, label)| MARK + SPACE + Type::LABEL.width(label)).collect();
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut used = f64::INFINITY;
    for (n, width) in widths.iter().enumerate() {
        if used + BETWEEN + width > rect.width() {
            rows.push(Vec::new());
            used = -BETWEEN;
        }
        used += BETWEEN + width;
        // A row was pushed for the first entry: nothing fits after infinity.
        rows.last_mut().expect("a row").push(n);
    }
    for (row, members) in rows.iter().enumerate() {
        let total = members.iter().map(|&n| widths[n]).sum::<f64>() + BETWEEN * (members.len() - 1) as f64;
        let mut x = rect.center()[0] - total / 2.0;
        let y = rect.top + (row as f64 + 0.5) * ROW;
        for &n in members {
            let (mark, label) = &entries[n];
            draw_mark(canvas, *mark, x, y)?;
            canvas.text([x + MARK + SPACE, y], label, Type::LABEL)?;
            x += widths[n] + BETWEEN;
        }
    }
    Ok(rect.split_top(rows.len() as f64 * ROW + if rows.is_empty() { 0.0 } else { 2.0 }).1)
}

fn draw_mark(canvas: &Canvas<'_>, mark: Mark, x: f64, y: f64) -> Result<(), FigureError> {
    let bar = |half: f64| Rect::new(x, y - half, x + MARK, y + half).corners();
    let line = [[x, y], [x + MARK, y]];
    match mark {
        Mark::Line(color) => {
            canvas.fill(&bar(3.0), faded(color, super::style::BAND_OPACITY))?;
            canvas.line(&line, Pen::new(color, 1.4 * LINE_WIDTH))
        }
        Mark::Dashed(color) => canvas.line(&line, Pen::new(color, LINE_WIDTH).dashed(2.5, 1.8)),
        Mark::Patch(color) => canvas.fill(&bar(3.0), color),
        Mark::Dot(color) => canvas.dot([x + MARK / 2.0, y], 2.2, color),
    }
}

/// Writes a note along the bottom of `rect`, broken between words, and returns what is
/// left above.
///
/// # Errors
/// When the backend fails.
pub fn note(canvas: &Canvas<'_>, rect: Rect, text: &str) -> Result<Rect, FigureError> {
    let look = Type::SMALL.color(GREY);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if look.width(&format!("{line} {word}")) <= rect.width() => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    let row = 1.35 * SMALL_SIZE;
    let (rest, foot) = rect.split_bottom(row * lines.len() as f64);
    for (n, line) in lines.iter().enumerate() {
        canvas.text([foot.left, foot.top + (n as f64 + 0.6) * row], line, look)?;
    }
    Ok(rest)
}
