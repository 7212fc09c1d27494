//! Keys in text form: `q`, `ctrl-s`, `shift-left`, `space`, `f2`.

use std::str::FromStr;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

/// A key with its modifiers, in canonical form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd)]
pub struct Key {
    code: KeyCode,
    modifiers: KeyModifiers,
}

/// A text that is not a key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown key `{0}`: write a character, or space, enter, esc, tab, left, f1 and so on, with ctrl-, alt- or shift- before it"
)]
pub struct KeyError(String);

const NAMED: [(&str, KeyCode); 15] = [
    ("space", KeyCode::Char(' ')),
    ("enter", KeyCode::Enter),
    ("esc", KeyCode::Esc),
    ("tab", KeyCode::Tab),
    ("backtab", KeyCode::BackTab),
    ("backspace", KeyCode::Backspace),
    ("delete", KeyCode::Delete),
    ("left", KeyCode::Left),
    ("right", KeyCode::Right),
    ("up", KeyCode::Up),
    ("down", KeyCode::Down),
    ("home", KeyCode::Home),
    ("end", KeyCode::End),
    ("pageup", KeyCode::PageUp),
    ("pagedown", KeyCode::PageDown),
];

/// The modifiers, which are written before a key, each with a hyphen.
const MODIFIERS: [(&str, KeyModifiers); 3] =
    [("ctrl", KeyModifiers::CONTROL), ("alt", KeyModifiers::ALT), ("shift", KeyModifiers::SHIFT)];

impl Key {
    /// The canonical form, without shift for characters: it makes letters upper case. With control it has no effect,
    /// because most terminals send the same bytes with and without it.
    pub fn new(code: KeyCode, modifiers: KeyModifiers) -> Self {
        let code = match code {
            KeyCode::Char(c)
                if modifiers.contains(KeyModifiers::SHIFT) && !modifiers.contains(KeyModifiers::CONTROL) =>
            {
                let mut upper = c.to_uppercase();
                KeyCode::Char(upper.next().filter(|_| upper.next().is_none()).unwrap_or(c))
            }
            _ => code,
        };
        let kept = match code {
            KeyCode::Char(_) | KeyCode::BackTab => KeyModifiers::CONTROL | KeyModifiers::ALT,
            _ => KeyModifiers::CONTROL | KeyModifiers::ALT | KeyModifiers::SHIFT,
        };
        Self { code, modifiers: modifiers & kept }
    }

    /// The key as an event.
    pub fn event(self) -> KeyEvent {
        KeyEvent::new(self.code, self.modifiers)
    }
}

impl From<KeyEvent> for Key {
    fn from(event: KeyEvent) -> Self {
        Self::new(event.code, event.modifiers)
    }
}

impl FromStr for Key {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let mut modifiers = KeyModifiers::NONE;
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('-').filter(|(_, after)| !after.is_empty())
            && let Some((_, modifier)) = MODIFIERS.iter().find(|(name, _)| *name == before)
        {
            modifiers |= *modifier;
            rest = after;
        }
        let mut characters = rest.chars();
        let code = match (characters.next(), characters.next()) {
            (Some(c), None) => Some(KeyCode::Char(c)),
            (Some('f'), Some('0'..='9')) => rest[1..].parse().ok().filter(|n| (1..=12).contains(n)).map(KeyCode::F),
            _ => NAMED.into_iter().find(|(name, _)| *name == rest).map(|(_, code)| code),
        };
        code.map(|code| Self::new(code, modifiers)).ok_or_else(|| KeyError(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_read_as_they_are_written_in_the_help() {
        let (plain, control) = (KeyModifiers::NONE, KeyModifiers::CONTROL);
        for (text, code, modifiers) in [
            ("q", KeyCode::Char('q'), plain),
            ("Q", KeyCode::Char('Q'), plain),
            ("-", KeyCode::Char('-'), plain),
            ("ctrl--", KeyCode::Char('-'), control),
            ("ctrl-s", KeyCode::Char('s'), control),
            ("shift-left", KeyCode::Left, KeyModifiers::SHIFT),
            ("alt-enter", KeyCode::Enter, KeyModifiers::ALT),
            ("space", KeyCode::Char(' '), plain),
            ("f12", KeyCode::F(12), plain),
            ("backtab", KeyCode::BackTab, plain),
        ] {
            assert_eq!(text.parse::<Key>().unwrap().event(), KeyEvent::new(code, modifiers), "{text}");
        }
    }

    #[test]
    fn a_shifted_character_is_that_character() {
        let typed = KeyEvent::new(KeyCode::Char('?'), KeyModifiers::SHIFT);
        assert_eq!(Key::from(typed), "?".parse().unwrap());
        assert_eq!("shift-t".parse::<Key>(), "T".parse::<Key>());
    }

    #[test]
    fn mistakes_are_named() {
        for text in ["", "f13", "f0", "ctrl-", "hyper-x", "enterr"] {
            let error = text.parse::<Key>().unwrap_err().to_string();
            assert!(error.contains(&format!("unknown key `{text}`")), "{error}");
        }
    }
}
