//! Text measured in the columns it takes on screen: a wide character takes two.

use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Columns of a text.
pub fn width(text: &str) -> usize {
    text.width()
}

/// As much of a text, from its beginning, as fits into `columns`, and the rest.
pub fn split(text: &str, columns: usize) -> (&str, &str) {
    let mut taken = 0;
    let too_far = |(_, character): &(usize, char)| {
        taken += character.width().unwrap_or(0);
        taken > columns
    };
    text.split_at(text.char_indices().find(too_far).map_or(text.len(), |(at, _)| at))
}

/// As much of a text, up to its end, as fits into `columns`.
pub fn end(text: &str, columns: usize) -> &str {
    let mut taken = 0;
    let fits = |(_, character): &(usize, char)| {
        taken += character.width().unwrap_or(0);
        taken <= columns
    };
    text.char_indices().rev().take_while(fits).last().map_or("", |(at, _)| &text[at..])
}

/// A text with spaces after it, up to `columns`.
pub fn padded(text: &str, columns: usize) -> String {
    format!("{text}{}", " ".repeat(columns.saturating_sub(width(text))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_characters_take_two_columns() {
        assert_eq!(width("a日本"), 5);
        assert_eq!(split("a日本", 4), ("a日", "本"));
        assert_eq!(split("ab", 4), ("ab", ""));
        assert_eq!(end("a日本", 3), "本");
        assert_eq!(end("abc", 2), "bc");
        assert_eq!(padded("日", 4), "日  ");
    }
}
