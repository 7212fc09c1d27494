//! All output of the program: results to standard output, messages to standard error.

use std::fmt::Display;
use std::io::{self, BufWriter, IsTerminal, Write};

use serde::Serialize;

use mge_base::atomic::{self, Format, Target};
use mge_base::json;
use mge_base::text::{excerpt, printable, printable_lines};
use mge_run::RunError;

/// Maximum length of a message, in characters.
const MAX_MESSAGE_LENGTH: usize = 2000;

/// The result of a command: nothing, or an error shown as one line.
pub type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// Standard output cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to standard output: {0}")]
pub struct OutputError(#[from] io::Error);

/// Writes a line of results.
///
/// # Errors
/// When standard output is closed or full.
pub fn line(text: impl Display) -> Result<(), OutputError> {
    lines(format_args!("{text}\n"))
}

/// Writes results that include their line ends.
///
/// # Errors
/// When standard output is closed or full.
pub fn lines(text: impl Display) -> Result<(), OutputError> {
    let mut out = io::stdout().lock();
    let text = text.to_string();
    // Control characters are escaped for terminals only: other programs need file names unchanged.
    let shown = if out.is_terminal() { printable_lines(&text) } else { text.into() };
    out.write_all(shown.as_bytes())?;
    Ok(out.flush()?)
}

/// Writes data as indented JSON.
///
/// # Errors
/// When standard output is closed or full.
pub fn json(data: &impl Serialize) -> Outcome {
    Ok(lines(json::pretty(data))?)
}

/// Writes a table of results, with aligned columns.
///
/// # Errors
/// When standard output is closed or full.
pub fn table<const N: usize>(rows: &[[String; N]]) -> Outcome {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let line = |row: &[String; N]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    Ok(lines(rows.iter().map(line).collect::<String>())?)
}

/// Standard output for streams of JSON Lines.
pub fn stream() -> impl Write {
    BufWriter::new(io::stdout().lock())
}

/// Checks before the work on it that a result can be written to a file.
///
/// # Errors
/// When its folder does not exist, or as for [`Target::check`].
pub fn check_target(to: &Target, format: &Format<'_>) -> Outcome {
    let folder = atomic::parent_of(&to.path);
    if !folder.is_dir() {
        return Err(format!("{}: the folder {} does not exist", to.path.display(), folder.display()).into());
    }
    Ok(to.check(format).map_err(RunError::io("write", &to.path))?)
}

/// Writes a message of one line to standard error.
pub fn message(text: impl Display) {
    message_lines(&shown(&text.to_string()));
}

/// Writes warnings, one line each, to standard error.
pub fn warnings(warnings: Vec<String>) {
    warnings.iter().for_each(|warning| message(format_args!("warning: {warning}")));
}

/// Writes a message that may have several lines to standard error.
pub fn message_lines(text: &str) {
    // Writing fails if the terminal is closed.
    let _ = writeln!(io::stderr(), "{}", shown_lines(text).trim_end());
}

/// A message for display: one line, without control characters, of bounded length.
pub fn shown(text: &str) -> String {
    printable(&excerpt(text, MAX_MESSAGE_LENGTH)).into_owned()
}

/// [`shown`] for a message of several lines.
pub fn shown_lines(text: &str) -> String {
    printable_lines(&excerpt(text, MAX_MESSAGE_LENGTH)).into_owned()
}
