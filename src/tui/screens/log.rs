//! The Log screen: what happened, the latest line last.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::Widget;

use super::Ui;
use super::lists::Lists;
use super::pane::{hint, level_style, pane};
use crate::tui::view::LogLine;
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
    let end = view.log.len() - lists.log.min(view.log.len() - 1);
    let of_entry = |entry: &LogLine| {
        let (mark, style) = level_style(entry.level, theme);
        let time = entry.time.strftime("%H:%M:%S ").to_string();
        let times = std::iter::once(time).chain(std::iter::repeat(" ".repeat(TIME)));
        let text = wrap(&format!("{mark}{}", entry.text), usize::from(inside.width).saturating_sub(TIME));
        let line = |(time, text)| Line::from(vec![Span::styled(time, theme.faint()), Span::styled(text, style)]);
        times.zip(text).map(line).collect::<Vec<Line>>().into_iter().rev()
    };
    let mut lines: Vec<Line> =
        view.log[..end].iter().rev().flat_map(of_entry).take(usize::from(inside.height)).collect();
    lines.reverse();
    Text::from(lines).render(inside, buffer);
}
