//! A list of rows with a selection.

use ratatui::prelude::*;
use ratatui::widgets::{Row, Table, TableState};

use super::theme::Theme;

/// Draws as many of `count` rows as fit, including the selected one; only these are built with `row`. Returns
/// the area and index of each.
pub fn draw<'a>(
    count: usize,
    selected: Option<usize>,
    row: impl Fn(usize) -> Row<'a>,
    columns: &[Constraint],
    area: Rect,
    theme: &Theme,
    buffer: &mut Buffer,
) -> Vec<(Rect, usize)> {
    let height = usize::from(area.height);
    let first = selected.map_or(0, |selected| (selected + 1).saturating_sub(height).min(selected));
    let shown = first..count.min(first + height);
    let mut state = TableState::new().with_selected(selected.map(|selected| selected - first));
    let table = Table::new(shown.clone().map(row), columns).row_highlight_style(theme.selected().fg(Color::Reset));
    StatefulWidget::render(table, area, buffer, &mut state);
    (area.y..).zip(shown).map(|(y, index)| (Rect { y, height: 1, ..area }, index)).collect()
}

/// What is drawn at a position, if there is one.
pub fn hit<T: Copy>(drawn: &[(Rect, T)], at: Position) -> Option<T> {
    drawn.iter().find(|(area, _)| area.contains(at)).map(|(_, found)| *found)
}
