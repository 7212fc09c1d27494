//! Makes text from files and users safe to display; counts in words; sorts texts with numbers.

use std::borrow::Cow;
use std::fmt::{Display, Write};

use unicode_properties::{GeneralCategory, UnicodeGeneralCategory};

/// One line of text without anything a terminal would interpret: what [`is_unsafe`] is written as escapes such as
/// `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    escape(text, is_unsafe)
}

/// Like [`printable`], but keeps line breaks and tabs.
pub fn printable_lines(text: &str) -> Cow<'_, str> {
    escape(text, |c| is_unsafe(c) && c != '\n' && c != '\t')
}

/// Whether a terminal would interpret a character instead of showing it: control characters (C0, DEL, C1), line
/// separators and all format controls, such as those of bidirectional text.
pub fn is_unsafe(c: char) -> bool {
    use GeneralCategory::{Control, Format, LineSeparator, ParagraphSeparator};
    matches!(c.general_category(), Control | Format | LineSeparator | ParagraphSeparator)
}

/// The bytes of a text without a byte-order mark.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

fn escape(text: &str, is_unsafe: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_unsafe) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_unsafe(c) {
            escaped.extend(c.escape_default());
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

/// A count with its noun, which gets an s unless the count is 1.
pub fn counted<N: Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let ending = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// A key by which texts are sorted so that the numbers in them count as numbers: `seed2` is before `seed10`, and `0.05`
/// before `0.1`.
pub fn natural_key(text: &str) -> (Vec<(String, u64)>, String) {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let (mut parts, mut rest) = (Vec::new(), text);
    while !rest.is_empty() {
        let (before, from) = rest.split_at(rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len()));
        let mut end = digits(from);
        for mark in [".", "e-", "e"] {
            let further = from[end..].strip_prefix(mark).map_or(0, digits);
            end += if further > 0 { mark.len() + further } else { 0 };
        }
        // The bits of positive numbers have their order.
        let number: f64 = from[..end].parse().unwrap_or_default();
        parts.push((before.to_owned(), number.to_bits()));
        rest = &from[end..];
    }
    (parts, text.to_owned())
}

/// Maximum number of characters of a value that an error message shows.
pub const MAX_EXCERPT_LENGTH: usize = 300;

/// Shortens a text to `most` characters by cutting out the middle; a note in its place counts the characters removed.
pub fn excerpt(text: &str, most: usize) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= most {
        return Cow::Borrowed(text);
    }
    let (first, last) = (most - most / 4, most / 4);
    let mut short: String = text.chars().take(first).collect();
    // Writing to a string cannot fail.
    let _ = write!(short, " [{} characters] ", count - first - last);
    short.extend(text.chars().skip(count - last));
    Cow::Owned(short)
}

/// A span of time as `12 s`, `3:05` or `1:02:30`.
pub fn span(seconds: f64) -> String {
    let whole = seconds.clamp(0.0, 3.6e6).round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, 0) if seconds > 0.0 => "under 1 s".to_owned(),
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

/// A number for people, in at most five characters: with decimals as long as these tell it, else with an exponent.
pub fn number(value: f32) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "-".to_owned()
    } else if size == 0.0 {
        "0".to_owned()
    } else if (999_500.0..999.5e6).contains(&size) {
        let millions = value / 1e6;
        if millions.abs() < 99.95 { format!("{millions:.1}M") } else { format!("{millions:.0}M") }
    } else if !(9.5e-4..999_500.0).contains(&size) {
        // Negative values with exponents such as e-10 do not fit; they are shown as 0.
        Some(format!("{value:.0e}")).filter(|text| text.len() <= 5).unwrap_or_else(|| "0".to_owned())
    } else if size >= 1e4 {
        format!("{:.0}k", value / 1e3)
    } else {
        let wanted = match size {
            _ if value.fract() == 0.0 => 0,
            ..0.1 => 3,
            ..10.0 => 2,
            ..100.0 => 1,
            _ => 0,
        };
        // As many decimals as fit, provided that a significant digit remains.
        let short = (0..=wanted).rev().map(|decimals| format!("{value:.decimals$}")).find(|text| text.len() <= 5);
        let short = short.filter(|text| text.contains(|c| ('1'..='9').contains(&c)));
        short.unwrap_or_else(|| format!("{value:.0e}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_interpret_is_escaped() {
        let hostile = "a\u{1b}]52;c;eA==\u{7}b\u{9b}2Jc\u{202e}d\u{7f}\ne\tf";
        let shown = printable(hostile);
        assert_eq!(shown, "a\\u{1b}]52;c;eA==\\u{7}b\\u{9b}2Jc\\u{202e}d\\u{7f}\\ne\\tf");
        assert!(printable_lines(hostile).ends_with("\\u{7f}\ne\tf"));
        for c in "\u{61c}\u{200b}\u{200f}\u{202a}\u{2028}\u{2066}\u{feff}\u{ad}\u{e0041}".chars() {
            assert_eq!(printable(&c.to_string()), c.escape_unicode().to_string());
        }
        assert!(matches!(printable("plain Ünïcode te\u{301}xt, 日本語 😀"), Cow::Borrowed(_)));
    }

    #[test]
    fn a_long_text_keeps_its_beginning_and_its_end() {
        assert_eq!(excerpt("short", 5), "short");
        let text = format!("begin{}end", "é".repeat(1000));
        let short = excerpt(&text, 40);
        assert!(
            short.starts_with("begin") && short.ends_with("end") && short.contains(" [968 characters] "),
            "{short}"
        );
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.25, "0.25"),
            (-0.05, "-0.05"),
            (-12.34, "-12.3"),
            (-0.004, "-4e-3"),
            (0.012, "0.012"),
            (12.34, "12.3"),
            (1234.0, "1234"),
            (12_345.0, "12k"),
            (0.0001, "1e-4"),
            (0.000_98, "0.001"),
            (0.000_9, "9e-4"),
            (1.5e6, "1.5M"),
            (-320e6, "-320M"),
            (99_950_000.0, "100M"),
            (3.2e9, "3e9"),
            (-999_600.0, "-1.0M"),
            (-1e-10, "0"),
            (-3e38, "-3e38"),
            (f32::NAN, "-"),
        ] {
            assert_eq!(number(value), text);
            assert!(number(value).len() <= 5);
        }
    }

    #[test]
    fn numbers_in_texts_are_sorted_as_numbers() {
        let sorted = ["a-1e-5-seed3", "a-0.05-seed0", "a-0.1-seed2", "a-0.1-seed10", "a-2", "a-16", "b", "b1e5", "é7"];
        let mut texts = sorted.to_vec();
        texts.reverse();
        texts.sort_by_cached_key(|text| natural_key(text));
        assert_eq!(texts, sorted);
    }
}
