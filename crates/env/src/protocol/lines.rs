//! Streams of JSON Lines, with bounded memory and errors that give the line number.

use std::io::{self, BufRead, Read, Write};

use serde::Serialize;
use serde::de::DeserializeOwned;

use mge_base::json::{self, SyntaxError};
use mge_base::validation::ValidationError;

/// The longest line that is read, in bytes.
pub const MAX_LINE: usize = 16 << 20;

/// Why a stream of JSON Lines cannot be processed.
#[derive(Debug, thiserror::Error)]
pub enum LinesError {
    /// A line is not JSON or not of the expected form.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// A line has a value that is not allowed.
    #[error("{origin}:{line}: {error}")]
    Invalid {
        /// Name of the stream.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong in it.
        error: ValidationError,
    },
    /// A line is too long.
    #[error("{origin}:{line}: the line is longer than {} MB: write one record per line", MAX_LINE >> 20)]
    TooLong {
        /// Name of the stream.
        origin: String,
        /// Line, from 1.
        line: usize,
    },
    /// The input cannot be read.
    #[error("cannot read {origin}: {source}")]
    Read {
        /// Name of the stream.
        origin: String,
        /// What went wrong.
        source: io::Error,
    },
    /// The output cannot be written.
    #[error("cannot write the results: {0}")]
    Write(#[source] io::Error),
}

/// The non-empty lines of a stream.
pub(super) struct Lines<'a, R> {
    input: R,
    origin: &'a str,
    text: Vec<u8>,
    number: usize,
}

impl<'a, R: BufRead> Lines<'a, R> {
    /// The lines of `input`; `origin` names it in errors.
    pub fn new(input: R, origin: &'a str) -> Self {
        Self { input, origin, text: Vec::new(), number: 0 }
    }

    /// The number, from 1, and the text of the next line; None at the end of the stream.
    ///
    /// # Errors
    /// When the input cannot be read or the line is longer than [`MAX_LINE`].
    pub fn read(&mut self) -> Result<Option<(usize, &[u8])>, LinesError> {
        let origin = || self.origin.to_owned();
        loop {
            self.number += 1;
            self.text.clear();
            let mut input = self.input.by_ref().take(MAX_LINE as u64 + 1);
            let length = input
                .read_until(b'\n', &mut self.text)
                .map_err(|source| LinesError::Read { origin: origin(), source })?;
            match length {
                0 => return Ok(None),
                _ if length > MAX_LINE => return Err(LinesError::TooLong { origin: origin(), line: self.number }),
                _ if self.text.trim_ascii().is_empty() => {}
                _ => return Ok(Some((self.number, self.text.trim_ascii_end()))),
            }
        }
    }
}

/// Passes every value of a stream of JSON Lines to `each`, in order, until one fails.
///
/// # Errors
/// The first line that cannot be read, or the error of `each`, with the line number.
pub(super) fn for_each_line<T: DeserializeOwned>(
    input: impl BufRead,
    origin: &str,
    mut each: impl FnMut(T) -> Result<(), LineFailure>,
) -> Result<(), LinesError> {
    let mut lines = Lines::new(input, origin);
    while let Some((line, text)) = lines.read()? {
        let value = json::parse(text, origin).map_err(|error| SyntaxError { line, ..error })?;
        each(value).map_err(|failure| match failure {
            LineFailure::Invalid(error) => LinesError::Invalid { origin: origin.to_owned(), line, error },
            LineFailure::Write(source) => LinesError::Write(source),
        })?;
    }
    Ok(())
}

/// Why a well-formed line could not be processed.
#[derive(Debug)]
pub(super) enum LineFailure {
    /// It has a value that is not allowed.
    Invalid(ValidationError),
    /// The result cannot be written.
    Write(io::Error),
}

impl From<ValidationError> for LineFailure {
    fn from(error: ValidationError) -> Self {
        Self::Invalid(error)
    }
}

impl From<io::Error> for LineFailure {
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

/// Writes one value as a line of JSON.
///
/// # Errors
/// When the output cannot be written.
pub(super) fn write_line(mut output: impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut output, value)?;
    output.write_all(b"\n")
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    fn sum(input: impl BufRead) -> Result<u64, LinesError> {
        let mut sum = 0;
        for_each_line(input, "numbers", |number: u64| {
            sum += number;
            Ok(())
        })?;
        Ok(sum)
    }

    #[test]
    fn empty_lines_are_skipped_and_counted() {
        assert_eq!(sum(&b"\n1\n  \r\n 2 \n3"[..]).unwrap(), 6);
        assert!(sum(&b"\n\nx"[..]).unwrap_err().to_string().starts_with("numbers:3:"));
    }

    #[test]
    fn an_endless_line_is_refused_before_it_fills_the_memory() {
        let endless = BufReader::new(b"1\n".chain(io::repeat(b' ')));
        let error = sum(endless).unwrap_err();
        assert!(matches!(error, LinesError::TooLong { line: 2, .. }), "{error}");
        assert_eq!(error.to_string(), "numbers:2: the line is longer than 16 MB: write one record per line");
    }
}
