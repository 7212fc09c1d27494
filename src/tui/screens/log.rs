//! The Log screen: what happened, the latest line last.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::Ui;
use super::lists::{Lists, select};
use super::pane::{hint, level_style, pane};
use crate::tui::actions::Action;
use crate::tui::effect::Effect;
use crate::tui::widgets::popup::wrap;

/// Columns of the time of day and the space after it.
const TIME: usize = 9;

/// Draws the screen.
pub fn draw(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer) {
    let view = ui.view;
    let theme = ui.theme;
    let inside = pane("log", area, theme, buffer);
    if view.log.is_empty() {
        let text = "Nothing has happened yet. Everything you do and everything a run reports appears here.";
        return hint(text, inside, theme, buffer);
    }
    let width = usize::from(inside.width);
    let end = view.log.len() - lists.log.min(view.log.len() - 1);
    let wrapped = view.log[..end].iter().rev().flat_map(|entry| {
        let (mark, style) = level_style(entry.level, theme);
        let lines = wrap(&format!("{mark}{}", entry.text), width.saturating_sub(TIME));
        let times =
            std::iter::once(entry.time.strftime("%H:%M:%S").to_string()).chain(std::iter::repeat(String::new()));
        let lines: Vec<_> = times.zip(lines).collect();
        lines.into_iter().rev().map(move |(time, text)| (time, text, style))
    });
    let mut lines: Vec<(String, String, Style)> = wrapped.take(usize::from(inside.height)).collect();
    lines.reverse();
    for (y, (time, text, style)) in (inside.y..inside.bottom()).zip(lines) {
        buffer.set_stringn(inside.x, y, time, width, theme.faint());
        buffer.set_stringn(inside.x + TIME as u16, y, text, width.saturating_sub(TIME), style);
    }
}

/// What an action does on this screen: the selected line is counted from the end.
pub fn perform(lists: &mut Lists, ui: &Ui, action: Action) -> Vec<Effect> {
    let last = ui.view.log.len().saturating_sub(1);
    let now = last - lists.log.min(last);
    if let Some(selected) = select(action, now, last) {
        lists.log = last - selected;
    }
    Vec::new()
}
