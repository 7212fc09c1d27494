//! One line of editable text.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::columns;

/// A line of text with a cursor.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TextInput {
    text: String,
    /// Byte offset, always at a character boundary.
    cursor: usize,
}

impl TextInput {
    /// A line with an initial text and the cursor at its end.
    pub fn new(text: impl Into<String>) -> Self {
        let text = text.into();
        Self { cursor: text.len(), text }
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The text before the cursor.
    pub fn before_cursor(&self) -> &str {
        &self.text[..self.cursor]
    }

    /// Replaces the text between a byte offset and the cursor.
    pub fn replace_from(&mut self, from: usize, text: &str) {
        self.text.replace_range(from..self.cursor, text);
        self.cursor = from + text.len();
    }

    /// Number of columns before the cursor.
    pub fn cursor_column(&self) -> u16 {
        columns::width(self.before_cursor()) as u16
    }

    /// Inserts text at the cursor; line ends and other control characters become spaces.
    pub fn insert(&mut self, text: &str) {
        for c in text.chars() {
            let c = if c.is_control() { ' ' } else { c };
            self.text.insert(self.cursor, c);
            self.cursor += c.len_utf8();
        }
    }

    /// Handles a key; false if it is not an editing key.
    pub fn key(&mut self, key: KeyEvent) -> bool {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('a') if control => self.cursor = 0,
            KeyCode::Char('e') if control => self.cursor = self.text.len(),
            KeyCode::Char('u') if control => _ = self.text.drain(..std::mem::take(&mut self.cursor)),
            KeyCode::Char('w') if control => self.delete_word(),
            KeyCode::Char(_) if control || key.modifiers.contains(KeyModifiers::ALT) => return false,
            KeyCode::Char(c) => self.insert(c.encode_utf8(&mut [0; 4])),
            KeyCode::Backspace => {
                if let Some(previous) = self.previous() {
                    self.text.remove(previous);
                    self.cursor = previous;
                }
            }
            KeyCode::Delete if self.cursor < self.text.len() => _ = self.text.remove(self.cursor),
            KeyCode::Delete => {}
            KeyCode::Left => self.cursor = self.previous().unwrap_or(0),
            KeyCode::Right => self.cursor += self.text[self.cursor..].chars().next().map_or(0, char::len_utf8),
            KeyCode::Home => self.cursor = 0,
            KeyCode::End => self.cursor = self.text.len(),
            _ => return false,
        }
        true
    }

    fn previous(&self) -> Option<usize> {
        self.text[..self.cursor].char_indices().next_back().map(|(at, _)| at)
    }

    fn delete_word(&mut self) {
        let before = self.text[..self.cursor].trim_end();
        let start = before.rfind(' ').map_or(0, |at| at + 1);
        self.text.drain(start..self.cursor);
        self.cursor = start;
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
