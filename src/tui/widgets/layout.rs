//! The division of the terminal.

use ratatui::layout::{Constraint, Layout, Rect};

/// The smallest terminal that shows the workbench.
pub const MIN_SIZE: (u16, u16) = (60, 20);
/// Width from which panes have room for more columns.
pub const WIDE: u16 = 100;

/// A box of a size in the middle of an area that has room for it.
pub fn centred(width: u16, height: u16, within: Rect) -> Rect {
    let (x, y) = (within.x + (within.width - width) / 2, within.y + (within.height - height) / 2);
    Rect { x, y, width, height }
}

/// Boxes of one size in rows and columns.
pub fn grid(area: Rect, columns: usize, rows: usize) -> Vec<Rect> {
    let parts = |count: usize| vec![Constraint::Fill(1); count];
    let rows = Layout::vertical(parts(rows)).split(area);
    rows.iter().flat_map(|row| Layout::horizontal(parts(columns)).split(*row).to_vec()).collect()
}

/// The area between tabs and a line for messages above the footer.
pub fn body(area: Rect) -> Rect {
    Rect { y: area.y + 1, height: area.height - 3, ..area }
}

/// A square for the scene at the left, the rest at the right.
pub fn split(area: Rect) -> [Rect; 2] {
    let rest = if area.width >= WIDE { 40 } else { 28 };
    let width = (2 * (area.height - 2) + 2).min(area.width.saturating_sub(rest));
    Layout::horizontal([Constraint::Length(width), Constraint::Fill(1)]).areas(area)
}
