//! The help: all keys, grouped by context.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Position, Rect};
use ratatui::text::Span;
use ratatui::widgets::{Row, Table, Widget};

use crate::tui::actions::{Context, Entry, entries};
use crate::tui::effect::{Layer, Response};
use crate::tui::input::Keymap;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::theme::Theme;

/// Widths in columns: of the whole, of the keys and of the names.
const WIDTH: u16 = 116;
const KEYS: u16 = 16;
const NAMES: u16 = 17;

/// The help, scrolled to a line. Contexts that apply now come first.
pub struct Help {
    scroll: usize,
    /// Only entries containing this text are shown.
    filter: String,
    contexts: Vec<Context>,
}

impl Help {
    /// The help while these contexts apply. Commands that can only be typed come last.
    pub fn new(now: &[Context]) -> Self {
        let others = Context::ALL.into_iter().filter(|context| !now.contains(context));
        let mut contexts: Vec<Context> = now.iter().copied().chain(others).collect();
        contexts.sort_by_key(|context| *context == Context::Typed);
        Self { scroll: 0, filter: String::new(), contexts }
    }

    /// Lines of keys, name and description; the description wraps at `room` columns.
    fn lines(&self, keymap: &Keymap, room: usize) -> Vec<(String, &'static str, String)> {
        let mut lines = Vec::new();
        let filter = self.filter.to_lowercase();
        for context in &self.contexts {
            let words = |entry: &Entry| format!("{} {} {}", keymap.keys(entry).join(" "), entry.name, about(entry));
            let is_found = |entry: &&Entry| entry.context == *context && words(entry).to_lowercase().contains(&filter);
            let mut found = entries().iter().filter(is_found).peekable();
            if found.peek().is_none() {
                continue;
            }
            if !lines.is_empty() {
                lines.push(Default::default());
            }
            lines.push((context.name().to_uppercase(), "", String::new()));
            for entry in found {
                for (index, about) in wrap(&about(entry), room).into_iter().enumerate() {
                    let first = index == 0;
                    let keys = if first { keymap.keys(entry).join(" ") } else { String::new() };
                    lines.push((keys, if first { entry.name } else { "" }, about));
                }
            }
        }
        if lines.is_empty() {
            lines.push((String::new(), "", "no matches".to_owned()));
        }
        lines
    }
}

impl Layer for Help {
    fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Up => self.scroll = self.scroll.saturating_sub(1),
            KeyCode::Down => self.scroll = self.scroll.saturating_add(1),
            KeyCode::PageUp => self.scroll = self.scroll.saturating_sub(10),
            KeyCode::PageDown => self.scroll = self.scroll.saturating_add(10),
            KeyCode::Home => self.scroll = 0,
            KeyCode::End => self.scroll = usize::MAX,
            KeyCode::Char('?') if self.filter.is_empty() => return Response::Leave,
            KeyCode::Char(typed) => self.filter.push(typed),
            KeyCode::Backspace => _ = self.filter.pop(),
            _ => return Response::Leave,
        }
        Response::Stay
    }

    fn paste(&mut self, text: &str) {
        self.filter.push_str(text);
    }

    fn click(&mut self, _: Position) -> Response {
        Response::Leave
    }

    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let room = area.width.saturating_sub(4).min(WIDTH).saturating_sub(KEYS + NAMES + 2);
        let lines = self.lines(keymap, usize::from(room));
        let wanted = (WIDTH, lines.len() as u16);
        let title = match self.filter.as_str() {
            "" => "keys · type to search, arrows scroll, esc closes".to_owned(),
            filter => format!("keys with `{filter}` · backspace shows more, esc closes"),
        };
        let inside = frame(&title, wanted, area, theme, buffer);
        self.scroll = self.scroll.min(lines.len().saturating_sub(usize::from(inside.height)));
        let row = |(keys, name, about): (String, &'static str, String)| {
            Row::new([Span::styled(keys, theme.strong()), Span::styled(name, theme.faint()), about.into()])
        };
        let rows = lines.into_iter().skip(self.scroll).map(row);
        Table::new(rows, [Constraint::Length(KEYS), Constraint::Length(NAMES), Constraint::Fill(1)])
            .render(inside, buffer);
        None
    }
}

/// The description of an entry, with its usage if it can only be typed.
fn about(entry: &Entry) -> String {
    match entry.same_verb().filter(|_| entry.context == Context::Typed) {
        Some(verb) => format!("{}: {}", verb.usage(), verb.help),
        None => entry.about().to_owned(),
    }
}
