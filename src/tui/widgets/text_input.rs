//! One line of editable text.

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};
use tui_input::backend::crossterm::to_input_request;
use tui_input::{Input, InputRequest};

/// A line of text with a cursor.
#[derive(Debug, Clone, Default)]
pub struct TextInput(Input);

impl TextInput {
    /// A line with an initial text and the cursor at its end.
    pub fn new(text: impl Into<String>) -> Self {
        Self(Input::new(text.into()))
    }

    /// The text.
    pub fn text(&self) -> &str {
        self.0.value()
    }

    /// The text before the cursor.
    pub fn before_cursor(&self) -> &str {
        let after = self.text().char_indices().nth(self.0.cursor());
        after.map_or(self.text(), |(at, _)| &self.text()[..at])
    }

    /// Replaces the text between a byte offset and the cursor.
    pub fn replace_from(&mut self, from: usize, text: &str) {
        let (before, after) = self.text().split_at(self.before_cursor().len());
        let before = before[..from].to_owned() + text;
        self.0 = Input::new(before.clone() + after).with_cursor(before.chars().count());
    }

    /// Number of columns before the cursor.
    pub fn cursor_column(&self) -> u16 {
        self.0.visual_cursor() as u16
    }

    /// Inserts text at the cursor; line ends and other control characters become spaces.
    pub fn insert(&mut self, text: &str) {
        self.replace_from(self.before_cursor().len(), &text.replace(char::is_control, " "));
    }

    /// Handles a key; false if it is not an editing key.
    pub fn key(&mut self, mut key: KeyEvent) -> bool {
        // Characters have it in them, and it does nothing for other keys.
        key.modifiers.remove(KeyModifiers::SHIFT);
        let request = match key.code {
            KeyCode::Char('u') if key.modifiers == KeyModifiers::CONTROL => Some(InputRequest::DeleteFromStart),
            // Words end at spaces, as in a shell.
            KeyCode::Char('w') if key.modifiers == KeyModifiers::CONTROL => {
                self.replace_from(self.before_cursor().trim_end().rfind(' ').map_or(0, |at| at + 1), "");
                return true;
            }
            _ => to_input_request(&Event::Key(key)),
        };
        request.map(|request| self.0.handle(request)).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(start: &str, keys: &[KeyEvent], end: &str, column: u16) {
        let mut input = TextInput::new(start);
        for key in keys {
            assert!(input.key(*key), "{key:?}");
        }
        assert_eq!((input.text(), input.cursor_column()), (end, column));
    }

    fn plain(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    fn control(c: char) -> KeyEvent {
        KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL)
    }

    #[test]
    fn keys_edit_the_line() {
        check("ab", &[plain(KeyCode::Char('c'))], "abc", 3);
        check("ab", &[plain(KeyCode::Left), plain(KeyCode::Backspace)], "b", 0);
        check("äb", &[plain(KeyCode::Home), plain(KeyCode::Delete)], "b", 0);
        check("a日b", &[plain(KeyCode::Left)], "a日b", 3);
        check("subgoal move", &[control('w')], "subgoal ", 8);
        check("subgoal move ", &[control('w')], "subgoal ", 8);
        check("ab", &[plain(KeyCode::Home), plain(KeyCode::Right), plain(KeyCode::Delete)], "a", 1);
        check("ab", &[plain(KeyCode::Home), plain(KeyCode::End)], "ab", 2);
        assert!(!TextInput::new("a").key(KeyEvent::new(KeyCode::Char('x'), KeyModifiers::ALT)));
        check("subgoal move", &[control('a'), control('e'), control('u')], "", 0);
        check("", &[plain(KeyCode::Backspace), plain(KeyCode::Delete), plain(KeyCode::Left)], "", 0);
    }

    #[test]
    fn pasted_line_ends_become_spaces() {
        let mut input = TextInput::default();
        input.insert("a\nb\tc");
        assert_eq!(input.text(), "a b c");
    }
}
