//! Escaping of text for XML.

/// `text` escaped as the contents of an element. Every character that XML 1.0 forbids, such as a terminal escape,
/// becomes a replacement character.
pub fn escaped(text: &str) -> String {
    let forbidden =
        |c: char| (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{FFFE}' | '\u{FFFF}');
    text.replace(forbidden, "\u{FFFD}").replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
