//! A line to be typed, checked when it is given.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::popup::{frame, wrap};
use super::{Deed, Wish};
use crate::tui::columns;
use crate::tui::text_input::TextInput;
use crate::tui::theme::Theme;

/// A question with a line for the answer.
pub struct Prompt {
    /// What is asked.
    pub title: String,
    /// What may be written.
    pub hint: String,
    /// The answer.
    pub input: TextInput,
    /// What becomes of it.
    pub then: Then,
    /// Why the latest answer was refused.
    pub error: Option<String>,
}

/// What becomes of an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Then {
    /// It follows the words of a command.
    Command(String),
    /// It is a path that follows the words of a command.
    Path(String),
    /// It filters the list of runs.
    Filter,
}

impl Prompt {
    /// A prompt that starts with `text`.
    pub fn new(title: impl Into<String>, hint: impl Into<String>, text: impl Into<String>, then: Then) -> Self {
        Self { title: title.into(), hint: hint.into(), input: TextInput::new(text), then, error: None }
    }

    pub(super) fn key(&mut self, key: KeyEvent) -> Wish {
        match key.code {
            KeyCode::Esc => return Wish::Leave,
            KeyCode::Enter => return Wish::Try(self.deed()),
            _ => {}
        }
        if self.input.key(key) {
            self.error = None;
        }
        Wish::Stay
    }

    fn deed(&self) -> Deed {
        let text = self.input.text().trim();
        match &self.then {
            Then::Command(words) => Deed::Line(format!("{words} {text}")),
            Then::Path(words) => Deed::Line(format!("{words} {}", shell_words::quote(text))),
            Then::Filter => Deed::Filter(text.to_owned()),
        }
    }

    pub(super) fn draw(&self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> (u16, u16) {
        let width = area.width.saturating_sub(8).min(64);
        let (about, style) = match &self.error {
            Some(error) => (error, Style::new().fg(theme.bad)),
            None => (&self.hint, theme.faint()),
        };
        let about = wrap(about, usize::from(width));
        let inside = frame(&self.title, (width, 2 + about.len() as u16), area, theme, buffer);
        let cursor = line(&self.input, "> ", inside, theme, buffer);
        for (row, text) in (inside.y + 2..inside.bottom()).zip(&about) {
            buffer.set_stringn(inside.x, row, text, usize::from(inside.width), style);
        }
        cursor
    }
}

/// Draws an input line, scrolled so that the cursor is seen; where the cursor is.
pub fn line(input: &TextInput, prefix: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) -> (u16, u16) {
    buffer.set_stringn(area.x, area.y, prefix, usize::from(area.width), theme.strong());
    let start = area.x + prefix.len() as u16;
    let room = area.right().saturating_sub(start + 1);
    let hidden = input.cursor_column().saturating_sub(room);
    let (before, shown) = columns::split(input.text(), usize::from(hidden));
    // Half of a wide character cannot be hidden: all of it is shown then.
    let hidden = columns::width(before) as u16;
    buffer.set_stringn(start, area.y, shown, usize::from(room), Style::new());
    ((start + input.cursor_column() - hidden).min(area.right().saturating_sub(1)), area.y)
}
