//! Escaping of text for XML.

use std::borrow::Cow;

/// `text` with every character that XML 1.0 forbids, such as a terminal escape, replaced by a replacement character.
pub fn characters(text: &str) -> Cow<'_, str> {
    let forbidden =
        |c: char| (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{FFFE}' | '\u{FFFF}');
    if text.contains(forbidden) { Cow::Owned(text.replace(forbidden, "\u{FFFD}")) } else { Cow::Borrowed(text) }
}

/// `text` escaped as the contents of an element.
pub fn escaped(text: &str) -> String {
    characters(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
