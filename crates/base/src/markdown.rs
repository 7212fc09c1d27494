//! Markdown with untrusted text escaped: names, settings and messages can neither change the structure of a document
//! nor put control characters into it.

use std::fmt::Write as _;

use crate::atomic::Format;
use crate::text::printable;

/// The format of reports: they have a paragraph that begins as [`made_by`].
pub const REPORT: Format<'static> = Format { name: "a report", is: &is_report };

fn is_report(found: &[u8]) -> bool {
    // Reports of ablations of earlier versions do not tell the version.
    let is_made_here =
        |line: &str| line.starts_with("Made by `") && (line.contains("` with mge ") || line.contains("`mge "));
    str::from_utf8(found).is_ok_and(|text| text.lines().take(5).any(is_made_here))
}

/// How the first paragraph of a report begins: the command and the version of the program that made it.
pub fn made_by(command: &str, version: &str) -> String {
    format!("Made by {} with mge {version}", code(command))
}

/// Escapes text for a paragraph, a list item or a table cell.
pub fn text(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' | '`' | '*' | '<' | '|' => escaped.extend(['\\', c]),
            // Brackets alone are plain text, and intervals contain them; only `](` makes a link.
            '(' if escaped.ends_with(']') => escaped.push_str("\\("),
            c => escaped.push(c),
        }
    }
    printable(&escaped).into_owned()
}

/// A code span for a paragraph or a list item.
pub fn code(text: &str) -> String {
    format!("`{}`", printable(text).replace('`', "'"))
}

/// A table row; each cell is escaped by [`text()`].
pub fn row<S: AsRef<str>>(cells: impl IntoIterator<Item = S>) -> String {
    let mut line = String::from("|");
    for cell in cells {
        // Writing to a string does not fail.
        let _ = write!(line, " {} |", text(cell.as_ref()));
    }
    line + "\n"
}

/// The header row of a table and the separator line.
pub fn header<S: AsRef<str>>(cells: impl IntoIterator<Item = S>) -> String {
    let cells: Vec<S> = cells.into_iter().collect();
    format!("{}|{}\n", row(&cells), "---|".repeat(cells.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_recognised() {
        let report = |paragraph: &str| (REPORT.is)(format!("# Title\n\n{paragraph}. More.\n").as_bytes());
        assert!(report(&made_by("mge report runs", "0.1.0")) && report(&made_by("mge.write_report()", "0.1.0")));
        assert!(!report("Made by me with `mge report`") && !report("Notes"));
    }

    #[test]
    fn untrusted_text_is_escaped() {
        assert_eq!(
            text("DDPG-MGE, epsilon 0.5 to 0, model_replay.rollouts 2"),
            "DDPG-MGE, epsilon 0.5 to 0, model_replay.rollouts 2"
        );
        assert_eq!(text("a|b\n# c <script> [x](y) *z* \\"), "a\\|b\\n# c \\<script> [x]\\(y) \\*z\\* \\\\");
        assert_eq!(text("0.36 [0.31, 0.41]"), "0.36 [0.31, 0.41]");
        assert_eq!(text("\u{1b}[2J\u{7}\u{9b}\u{202e}"), "\\u{1b}[2J\\u{7}\\u{9b}\\u{202e}");
    }

    #[test]
    fn code_ends_where_its_text_ends() {
        assert_eq!(code("mge report runs"), "`mge report runs`");
        assert_eq!(code("a `` b"), "`a '' b`");
        assert_eq!(code("a\nb"), "`a\\nb`");
    }

    #[test]
    fn tables_keep_their_columns() {
        assert_eq!(header(["a", "b"]), "| a | b |\n|---|---|\n");
        assert_eq!(row(["1|2", ""]), "| 1\\|2 |  |\n");
    }
}
