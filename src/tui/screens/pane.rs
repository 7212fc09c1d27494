//! Framed panes and the lines in them.

use ratatui::prelude::*;

use super::Ui;
use crate::tui::view::Level;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::popup;
use crate::tui::widgets::theme::Theme;

/// Mark and colour of a message by its level; the mark shows the level without colour, too.
pub fn level_style(level: Level, theme: &Theme) -> (&'static str, Style) {
    match level {
        Level::Info => ("", Style::new()),
        Level::Good => ("", Style::new().fg(theme.good)),
        Level::Warning => ("! ", Style::new().fg(theme.warn)),
        Level::Error => ("error: ", Style::new().fg(theme.bad)),
    }
}

/// Draws a framed pane with a title and returns its inside.
pub fn pane(title: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Rect {
    let block = popup::block()
        .border_style(theme.border)
        .title(format!(" {} ", shortened(title, usize::from(area.width).saturating_sub(4), false)))
        .title_style(theme.strong());
    let inside = block.inner(area);
    block.render(area, buffer);
    inside
}

/// A text wrapped to `width` columns, in a style.
pub fn lines(text: &str, width: u16, style: Style) -> impl Iterator<Item = Line<'static>> + use<> {
    popup::wrap(text, usize::from(width)).into_iter().map(move |line| Line::styled(line, style))
}

/// The lines that fit into the rows; if some do not, the last row says how many, and what shows them.
pub fn fitted(ui: &Ui, mut text: Vec<Line<'static>>, rows: u16, shown_by: &str) -> Vec<Line<'static>> {
    // The space below the last section.
    if text.last().is_some_and(|line| line.width() == 0) {
        text.pop();
    }
    let rows = usize::from(rows);
    if text.len() > rows {
        let shown = rows.saturating_sub(1);
        let more = format!("+{} more lines{}", text.len() - shown, ui.text(shown_by));
        text.truncate(shown);
        text.push(Line::styled(more, ui.theme.faint()));
    }
    text
}

/// Draws a hint in the middle of an empty area, such as which key to press.
pub fn hint(text: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let width = area.width.saturating_sub(4).min(70);
    let text = Text::from_iter(lines(text, width, theme.faint())).centered();
    let height = Constraint::Length(text.height() as u16);
    text.render(area.centered_vertically(height), buffer);
}
