//! Text in XML.

/// `text` in which every character that XML 1.0 forbids, such as a terminal escape, is a replacement character.
pub fn characters(text: &str) -> String {
    let forbidden =
        |c: char| (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{FFFE}' | '\u{FFFF}');
    text.replace(forbidden, "\u{FFFD}")
}

/// `text` escaped as the contents of an element.
pub fn escaped(text: &str) -> String {
    characters(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
