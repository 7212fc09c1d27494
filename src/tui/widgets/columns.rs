//! Text measured in screen columns: a wide character takes two.

use std::collections::BTreeSet;

use mge_results::short_label;
use unicode_truncate::UnicodeTruncateStr;
use unicode_width::UnicodeWidthStr;

/// Least room of a task and method that are cut.
const METHOD: usize = 8;

/// Width of a text in columns.
pub fn width(text: &str) -> usize {
    text.width()
}

/// Splits a text after the longest prefix that fits into `columns`.
pub fn split(text: &str, columns: usize) -> (&str, &str) {
    text.split_at(text.unicode_truncate(columns).0.len())
}

/// The longest suffix of a text that fits into `columns`.
pub fn end(text: &str, columns: usize) -> &str {
    text.unicode_truncate_start(columns).0
}

/// As many of the first parts as fit into `columns`, joined; empty parts are skipped.
pub fn fitting(parts: &[String], columns: usize) -> String {
    let mut text = String::new();
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let more = if text.is_empty() { part.clone() } else { format!(" · {part}") };
        if width(&text) + width(&more) > columns {
            break;
        }
        text += &more;
    }
    text
}

/// Shortens a text to `columns` at its end, or in its middle with `keep_end`; `..` marks the omission.
pub fn shortened(text: &str, columns: usize, keep_end: bool) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let room = columns.saturating_sub(2);
    let kept = if keep_end { room / 2 } else { 0 };
    format!("{}..{}", split(text, room - kept).0, end(text, kept))
}

/// Shortens the label of a run or group, one of `all`, to `columns`: what most of them have is left out, then the method is
/// cut rather than the settings after it.
pub fn shortened_label(label: &str, all: &BTreeSet<&str>, columns: usize) -> String {
    let label = short_label(label, all, |label| width(label) <= columns);
    let (method, settings) = label.split_at(label.find(", ").unwrap_or(label.len()));
    match columns.saturating_sub(width(settings)) {
        room if room >= METHOD => shortened(method, room, true) + settings,
        _ => shortened(&label, columns, true),
    }
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
    }

    #[test]
    fn titles_lose_whole_parts_and_names_mark_what_is_missing() {
        let parts = ["training", "", "a run", "12.5/s"].map(str::to_owned);
        assert_eq!(fitting(&parts, 30), "training · a run · 12.5/s");
        assert_eq!(fitting(&parts, 24), "training · a run");
        assert_eq!(fitting(&parts, 16), "training · a run", "a part that just fits");
        assert_eq!(shortened("task1-ddpg-seed0", 16, true), "task1-ddpg-seed0");
        assert_eq!(shortened("task1-ddpg-seed0", 10, true), "task..eed0");
        assert_eq!(shortened("linear:0.8:0:10", 10, false), "linear:0..");
        let label = |columns| shortened_label("task3: adaptive DDPG-MGE, episodes 1200", &BTreeSet::new(), columns);
        assert_eq!([label(34), label(20)], ["task3: ad..DDPG-MGE, episodes 1200", "task3: ad..odes 1200"]);
    }
}
