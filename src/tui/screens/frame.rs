//! The whole picture: tabs, the screen, message, footer, layers.

use ratatui::Frame;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::widgets::Widget;

use super::{Hits, Tab};
use crate::tui::actions::Action;
use crate::tui::app::App;
use crate::tui::columns;
use crate::tui::facts::Level;
use crate::tui::theme::{Marker, Theme};

/// The smallest terminal that shows the workbench.
const LEAST: (u16, u16) = (60, 20);
/// From this width on there is room for full tabs and panes.
pub const WIDE: u16 = 100;

/// Draws everything.
pub fn draw(app: &mut App, frame: &mut Frame) {
    let area = frame.area();
    let mut hits = Hits::default();
    let buffer = frame.buffer_mut();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let text = format!("a little larger, please: {}x{} of 60x20", area.width, area.height);
        buffer.set_stringn(area.x, area.y, text, usize::from(area.width), Style::new());
        app.hits = hits;
        return;
    }
    tabs(app, Rect { height: 1, ..area }, buffer, &mut hits);
    let body = Rect { y: area.y + 1, height: area.height - 2, ..area };
    match app.tab {
        Tab::Scene => super::workbench::draw(app, body, buffer, &mut hits),
        Tab::Edit => super::workbench::draw_edit(app, body, buffer, &mut hits),
        Tab::Schedule => super::schedule::draw(app, body, buffer, &mut hits),
        Tab::Training => super::training::draw(app, body, buffer, &mut hits),
        Tab::Runs => super::runs::draw(app, body, buffer, &mut hits),
        Tab::Models => super::models::draw(app, body, buffer, &mut hits),
        Tab::Figures => super::figures::draw(app, body, buffer, &mut hits),
        Tab::Log => super::log::draw(app, body, buffer),
    }
    footer(app, Rect { y: area.bottom() - 1, height: 1, ..area }, buffer, &mut hits);
    app.hits = hits;
    if let Some(cursor) = app.draw_layers(area, frame.buffer_mut()) {
        frame.set_cursor_position(cursor);
    }
    if app.theme.marker == Marker::Ascii {
        plain_signs(frame.buffer_mut());
    }
}

/// Puts signs that every terminal has in the place of our own; names stay as they are.
fn plain_signs(buffer: &mut Buffer) {
    for cell in &mut buffer.content {
        match cell.symbol() {
            "·" => _ = cell.set_char('-'),
            "›" => _ = cell.set_char('>'),
            _ => {}
        }
    }
}

fn tabs(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let theme = &app.theme;
    let mut x = area.x;
    for (index, tab) in Tab::ALL.into_iter().enumerate() {
        let number = index + 1;
        let text = if area.width >= WIDE || tab == app.tab {
            format!(" {number} {} ", tab.title())
        } else if area.width >= 80 {
            format!(" {number} {:.3} ", tab.title())
        } else {
            format!(" {number} ")
        };
        let style = if tab == app.tab { theme.strong().add_modifier(Modifier::REVERSED) } else { theme.faint() };
        let (end, _) = buffer.set_stringn(x, area.y, &text, usize::from(area.right() - x), style);
        hits.tabs.push((Rect { x, width: end - x, ..area }, tab));
        x = end;
    }
    let facts = app.desk.facts();
    let mark = if facts.dirty { " (edited)" } else { "" };
    let text = format!("{}{mark} ", facts.task.name);
    let width = columns::width(&text) as u16;
    if x + width < area.right() {
        buffer.set_string(area.right() - width, area.y, text, Style::new().add_modifier(Modifier::BOLD));
    }
}

fn footer(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let theme = &app.theme;
    if let Some(notice) = &app.notice {
        let (mark, style) = level_style(notice.level, theme);
        let text = format!("{mark}{}", notice.text);
        buffer.set_stringn(area.x, area.y, text, usize::from(area.width), style);
        return;
    }
    let mut put = |x: u16, key: &str, word: &str, action: Action| {
        let (after, _) = buffer.set_stringn(x, area.y, key, usize::from(area.right() - x), theme.strong());
        buffer.set_stringn(after + 1, area.y, word, word.len(), theme.faint());
        hits.hints.push((Rect { x, width: hint_width(key, word) - 2, ..area }, action));
    };
    // Whoever is lost needs the help: it always has its place, at the right.
    let (always, others): (Vec<_>, Vec<_>) =
        app.keymap.hints(&app.contexts()).into_iter().partition(|(.., action)| *action == Action::Help);
    let mut end = area.right();
    for (key, word, action) in always {
        end = end.saturating_sub(hint_width(&key, word) - 2).max(area.x);
        put(end, &key, word, action);
    }
    let mut x = area.x;
    for (key, word, action) in others {
        let width = hint_width(&key, word);
        if x + width > end {
            break;
        }
        put(x, &key, word, action);
        x += width;
    }
}

/// Columns of a key and its word, with the space after them.
fn hint_width(key: &str, word: &str) -> u16 {
    (key.chars().count() + word.len() + 3) as u16
}

/// As many of the parts, the first ones, as fit into a width.
pub fn fitting(parts: &[String], width: usize) -> String {
    let mut text = String::new();
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let more = if text.is_empty() { part.clone() } else { format!(" · {part}") };
        if columns::width(&text) + columns::width(&more) > width {
            break;
        }
        text += &more;
    }
    text
}

/// A text that fits into a width; what is left out at its end, or at its beginning if
/// `end` matters more, is marked.
pub fn shortened(text: &str, width: usize, end: bool) -> String {
    if columns::width(text) <= width {
        return text.to_owned();
    }
    let room = width.saturating_sub(2);
    if end { format!("..{}", columns::end(text, room)) } else { format!("{}..", columns::split(text, room).0) }
}

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
    let block = crate::tui::layers::block(theme)
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
    let lines = crate::tui::layers::wrap(text, usize::from(width));
    let top = area.y + area.height.saturating_sub(lines.len() as u16) / 2;
    for (y, line) in (top..area.bottom()).zip(lines) {
        let x = area.x + (area.width.saturating_sub(columns::width(&line) as u16)) / 2;
        buffer.set_stringn(x, y, line, usize::from(width), theme.faint());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_lose_whole_parts_and_names_say_what_is_missing() {
        let parts = ["training", "", "a run", "12.5/s"].map(str::to_owned);
        assert_eq!(fitting(&parts, 30), "training · a run · 12.5/s");
        assert_eq!(fitting(&parts, 24), "training · a run");
        assert_eq!(shortened("task1-ddpg-seed0", 16, true), "task1-ddpg-seed0");
        assert_eq!(shortened("task1-ddpg-seed0", 10, true), "..pg-seed0");
        assert_eq!(shortened("linear:0.8:0:10", 10, false), "linear:0..");
    }
}
