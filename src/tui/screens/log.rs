//! The Log screen: what happened, the latest line last.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::frame::{hint, level_style, pane};
use super::lists::select;
use crate::tui::app::App;
use crate::workbench::registry::Action;

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let inside = pane("log", area, theme, buffer);
    if facts.log.is_empty() {
        let text = "Nothing has happened yet. Everything you do and everything a run tells appears here.";
        return hint(text, inside, theme, buffer);
    }
    let width = usize::from(inside.width);
    let end = facts.log.len() - app.lists.log.min(facts.log.len() - 1);
    let wrapped = facts.log[..end].iter().rev().flat_map(|entry| {
        let (mark, style) = level_style(entry.level, theme);
        let lines = crate::tui::layers::wrap(&format!("{mark}{}", entry.text), width);
        lines.into_iter().rev().map(move |text| (text, style))
    });
    let mut lines: Vec<(String, Style)> = wrapped.take(usize::from(inside.height)).collect();
    lines.reverse();
    for (y, (text, style)) in (inside.y..inside.bottom()).zip(lines) {
        buffer.set_stringn(inside.x, y, text, width, style);
    }
}

/// What an action does on this screen: the selected line is counted from the end.
pub fn perform(app: &mut App, action: Action) {
    let last = app.desk.facts().log.len().saturating_sub(1);
    let now = last - app.lists.log.min(last);
    if let Some(selected) = select(action, now, last) {
        app.lists.log = last - selected;
    }
}
