//! A prompt for one line of text, checked on enter.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::Widget;

use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::input::Keymap;
use crate::tui::widgets::columns;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
use mge_workbench::Command;

/// Parses an answer into an effect, or says what is wrong with it.
type Reader = dyn Fn(&str) -> Result<Effect, String>;

/// A question with a line for the answer.
pub struct Prompt {
    /// The question.
    title: String,
    /// What may be entered.
    hint: String,
    /// The answer.
    input: TextInput,
    read: Box<Reader>,
    /// Why the latest answer was refused.
    error: Option<String>,
}

impl Prompt {
    /// A prompt that starts with `text`; `read` parses the answer into an effect, or says what is wrong with it.
    pub fn new(
        title: impl Into<String>,
        hint: impl Into<String>,
        text: impl Into<String>,
        read: impl Fn(&str) -> Result<Effect, String> + 'static,
    ) -> Self {
        let (title, hint, input) = (title.into(), hint.into(), TextInput::new(text));
        Self { title, hint, input, read: Box::new(read), error: None }
    }

    /// A prompt for the arguments of a verb.
    pub fn arguments(
        verb: &'static str,
        title: impl Into<String>,
        hint: impl Into<String>,
        text: impl Into<String>,
    ) -> Self {
        Self::new(title, hint, text, move |answer| match Command::parse(&format!("{verb} {answer}")) {
            Ok(Some(command)) => Ok(Effect::apply(command)),
            Ok(None) => Err("nothing entered".to_owned()),
            Err(error) => Err(error.to_string()),
        })
    }
}

impl Layer for Prompt {
    fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Esc => return Response::Leave,
            KeyCode::Enter => match (self.read)(self.input.text().trim()) {
                Ok(effect) => return Response::Try(effect),
                Err(error) => self.error = Some(error),
            },
            _ => {}
        }
        if self.input.key(key) {
            self.error = None;
        }
        Response::Stay
    }

    fn paste(&mut self, text: &str) {
        self.input.insert(text);
    }

    fn refuse(&mut self, reason: String) {
        self.error = Some(reason);
    }

    fn draw(&mut self, area: Rect, _: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let width = area.width.saturating_sub(8).min(64);
        let (about, style) = match &self.error {
            Some(error) => (error, Style::new().fg(theme.bad)),
            None => (&self.hint, theme.faint()),
        };
        let about = wrap(about, usize::from(width));
        let title = format!("{} · enter: done   esc: close", self.title);
        let inside = frame(&title, (width, 2 + about.len() as u16), area, theme, buffer);
        Text::from_iter([String::new(), String::new()].into_iter().chain(about)).style(style).render(inside, buffer);
        Some(line(&self.input, "> ", inside, theme, buffer))
    }
}

/// Draws an input line, scrolled so that the cursor is visible. Returns the position of the cursor.
pub fn line(input: &TextInput, prefix: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Position {
    let start = area.x + prefix.len() as u16;
    let hidden = input.cursor_column().saturating_sub(area.right().saturating_sub(start + 1));
    let (_, shown) = columns::split(input.text(), usize::from(hidden));
    let text = Line::from(vec![Span::styled(prefix, theme.strong()), Span::styled(shown, Style::reset())]);
    text.render(Rect { width: area.width.saturating_sub(1), height: area.height.min(1), ..area }, buffer);
    Position::new((start + input.cursor_column()).min(area.right().saturating_sub(1)), area.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::{Depth, Marker, Palette};

    #[test]
    fn the_cursor_is_after_the_text_and_stays_on_the_line() {
        let area = Rect::new(10, 5, 20, 1);
        let at = |text: &str| {
            let (theme, mut buffer) = (Theme::new(Palette::Dark, Depth::True, Marker::Braille), Buffer::empty(area));
            line(&TextInput::new(text), "> ", area, &theme, &mut buffer)
        };
        assert_eq!(at(""), Position::new(12, 5));
        assert_eq!(at("abc"), Position::new(15, 5));
        assert_eq!(at(&"abc".repeat(20)), Position::new(29, 5));
        assert_eq!(at(&"日本".repeat(20)), Position::new(29, 5));
    }
}
