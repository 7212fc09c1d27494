//! Streams of JSON Lines, with bounded memory and errors that give the line number.

use std::io::{self, BufRead, Read, Write};

use serde::Serialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use mge_base::json::{self, SyntaxError};
use mge_base::validation::ValidationError;

/// The longest line that is read, in bytes.
pub const MAX_LINE: usize = 16 << 20;

const TOO_LONG: &str = "is longer than 16 MB: write one record per line";

/// A value of a record that is accepted and not read, such as a result of a recording.
pub(super) type Ignored = Option<IgnoredAny>;

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

/// The records of a stream, one on each line that is not empty.
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

    /// The next record; None at the end of the stream.
    ///
    /// # Errors
    /// When the input cannot be read, or the line is longer than [`MAX_LINE`] or not a record.
    pub fn read<T: DeserializeOwned>(&mut self) -> Result<Option<T>, LinesError> {
        loop {
            let origin = || self.origin.to_owned();
            self.number += 1;
            let line = self.number;
            self.text.clear();
            let mut input = self.input.by_ref().take(MAX_LINE as u64 + 1);
            let length = input
                .read_until(b'\n', &mut self.text)
                .map_err(|source| LinesError::Read { origin: origin(), source })?;
            match self.text.trim_ascii_end() {
                _ if length > MAX_LINE => return Err(self.invalid(ValidationError::new("line", TOO_LONG))),
                [] if length == 0 => return Ok(None),
                [] => {}
                text => {
                    return Ok(Some(json::parse(text, self.origin).map_err(|error| SyntaxError { line, ..error })?));
                }
            }
        }
    }

    /// Passes each record to `act`, in order.
    ///
    /// # Errors
    /// As [`read`](Self::read), and when `act` refuses a record.
    pub fn each<T: DeserializeOwned>(
        mut self,
        mut act: impl FnMut(T) -> Result<(), ValidationError>,
    ) -> Result<(), LinesError> {
        while let Some(record) = self.read()? {
            act(record).map_err(|error| self.invalid(error))?;
        }
        Ok(())
    }

    /// Writes the answer to each record, in order.
    ///
    /// # Errors
    /// As [`read`](Self::read), when `answer` refuses a record, and when the output cannot be written.
    pub fn answer<T: DeserializeOwned, A: Serialize>(
        mut self,
        mut output: impl Write,
        mut answer: impl FnMut(T) -> Result<A, ValidationError>,
    ) -> Result<(), LinesError> {
        while let Some(record) = self.read()? {
            let answer = answer(record).map_err(|error| self.invalid(error))?;
            write_line(&mut output, &answer).map_err(LinesError::Write)?;
        }
        output.flush().map_err(LinesError::Write)
    }

    /// The latest record is not allowed.
    fn invalid(&self, error: ValidationError) -> LinesError {
        LinesError::Invalid { origin: self.origin.to_owned(), line: self.number, error }
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
        Lines::new(input, "numbers").each(|number: u64| {
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
        assert!(matches!(error, LinesError::Invalid { line: 2, .. }), "{error}");
        assert_eq!(error.to_string(), "numbers:2: line: is longer than 16 MB: write one record per line");
    }
}
