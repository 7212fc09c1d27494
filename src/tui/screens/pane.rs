//! Framed panes and the lines in them.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::widgets::Widget;

use crate::tui::view::Level;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::popup;
use crate::tui::widgets::theme::Theme;

/// From this width on there is room for full tabs and panes.
pub const WIDE: u16 = 100;

/// How a line of a level is marked and coloured; the mark says it without colour, too.
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
    let block = popup::block(theme)
        .border_style(theme.frame(false))
        .title(format!(" {} ", shortened(title, usize::from(area.width).saturating_sub(4), false)))
        .title_style(theme.strong());
    let inside = block.inner(area);
    block.render(area, buffer);
    inside
}

/// Lines of text in the middle of an area: what to press where nothing is yet.
pub fn hint(text: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let width = area.width.saturating_sub(4).min(70);
    let lines = popup::wrap(text, usize::from(width));
    let top = area.y + area.height.saturating_sub(lines.len() as u16) / 2;
    for (y, line) in (top..area.bottom()).zip(lines) {
        let x = area.x + (area.width.saturating_sub(columns::width(&line) as u16)) / 2;
        buffer.set_stringn(x, y, line, usize::from(width), theme.faint());
    }
}
