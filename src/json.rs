//! JSON whose errors a person can act on: where in the text, at which path, what is wrong.

use std::fmt::Display;
use std::io::{self, BufRead};

use serde::de::DeserializeOwned;
use serde_json::Value;

/// A text is not JSON, or not of the expected form.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{origin}:{line}:{column}: at `{path}`: {message}")]
pub struct SyntaxError {
    /// Name of the file or stream.
    pub origin: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// JSON path, such as `tools[1].size`; `.` is the whole text.
    pub path: String,
    /// What is wrong.
    pub message: String,
}

/// Well-formed JSON says something that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {message}")]
pub struct Problem {
    /// JSON path, such as `tools[1].size`.
    pub path: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl Problem {
    /// A problem at a JSON path.
    pub fn new(path: impl Display, message: impl Display) -> Self {
        Self { path: path.to_string(), message: message.to_string() }
    }

    /// The same problem of a part, seen from the whole: `parent` goes before the path.
    pub fn within(self, parent: impl Display) -> Self {
        let Self { path, message } = self;
        let path = match path.as_str() {
            "." => parent.to_string(),
            _ if path.starts_with('[') => format!("{parent}{path}"),
            _ => format!("{parent}.{path}"),
        };
        Self { path, message }
    }
}

/// Whether a number is finite and in `[low, high]`.
///
/// # Errors
/// When it is not.
pub fn in_range(value: f32, path: impl Display, low: f32, high: f32) -> Result<(), Problem> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Problem::new(path, format_args!("is {value}, but must be a number from {low} to {high}")))
}

/// Reads one JSON value; `origin` names the text in errors.
///
/// # Errors
/// When the text is not JSON or not a `T`.
pub fn parse<T: DeserializeOwned>(text: &[u8], origin: &str) -> Result<T, SyntaxError> {
    let mut deserializer = serde_json::Deserializer::from_slice(text);
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax_error(error.path().to_string(), error.inner(), origin))?;
    deserializer.end().map_err(|error| syntax_error(".".to_owned(), &error, origin))?;
    Ok(value)
}

fn syntax_error(path: String, error: &serde_json::Error, origin: &str) -> SyntaxError {
    let (line, column) = (error.line(), error.column());
    let message = error.to_string();
    let message = message.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&message).to_owned();
    SyntaxError { origin: origin.to_owned(), line, column, path, message }
}

/// Why a stream of JSON Lines cannot be worked through.
#[derive(Debug, thiserror::Error)]
pub enum LinesError {
    /// A line is not JSON or not of the expected form.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// A line says something that cannot be used.
    #[error("{origin}:{line}: {problem}")]
    Invalid {
        /// Name of the stream.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong in it.
        problem: Problem,
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

/// Hands every value of a stream of JSON Lines to `each`, in order, until one fails.
/// Empty lines are skipped.
///
/// # Errors
/// The first line that cannot be read, with its number, or the error of `each`.
pub fn for_each_line<T: DeserializeOwned>(
    mut input: impl BufRead,
    origin: &str,
    mut each: impl FnMut(T) -> Result<(), LineFailure>,
) -> Result<(), LinesError> {
    let mut text = Vec::new();
    for line in 1.. {
        text.clear();
        let length = input
            .read_until(b'\n', &mut text)
            .map_err(|source| LinesError::Read { origin: origin.to_owned(), source })?;
        if length == 0 {
            break;
        }
        let content = text.trim_ascii_end();
        if content.is_empty() {
            continue;
        }
        let value = parse(content, origin).map_err(|error| SyntaxError { line, ..error })?;
        each(value).map_err(|failure| match failure {
            LineFailure::Invalid(problem) => LinesError::Invalid { origin: origin.to_owned(), line, problem },
            LineFailure::Write(source) => LinesError::Write(source),
        })?;
    }
    Ok(())
}

/// Why a well-formed line could not be worked on.
#[derive(Debug)]
pub enum LineFailure {
    /// It says something that cannot be used.
    Invalid(Problem),
    /// The result cannot be written.
    Write(io::Error),
}

impl From<Problem> for LineFailure {
    fn from(problem: Problem) -> Self {
        Self::Invalid(problem)
    }
}

impl From<io::Error> for LineFailure {
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

/// The paths and values of everything in a JSON value that is not an object itself, such as
/// `ddpg.gamma`.
pub fn leaves(value: &Value) -> Vec<(String, &Value)> {
    fn walk<'a>(value: &'a Value, path: &str, leaves: &mut Vec<(String, &'a Value)>) {
        let Value::Object(entries) = value else { return leaves.push((path.to_owned(), value)) };
        for (name, value) in entries {
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            walk(value, &path, leaves);
        }
    }
    let mut leaves = Vec::new();
    walk(value, "", &mut leaves);
    leaves
}

/// The value at a path as in [`leaves`].
pub fn at_mut<'a>(value: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    path.split('.').try_fold(value, |place, part| place.get_mut(part))
}

/// The known name that is most like what was typed, if any is like it.
pub fn nearest<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> Option<&'a str> {
    let closeness = |name: &str| strsim::jaro_winkler(name, typed);
    let best = known.into_iter().max_by(|a, b| closeness(a).total_cmp(&closeness(b)));
    best.filter(|name| closeness(name) > 0.75)
}

/// `: did you mean X?` with the [`nearest`] known name; nothing if none is like it.
pub fn did_you_mean<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> String {
    nearest(known, typed).map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

/// The line, from 1, on which the value at a JSON path begins, in a text that is JSON.
pub fn line_of(text: &[u8], path: &str) -> Option<usize> {
    let mut places = Places { text, at: 0, found: Vec::new() };
    places.value(String::new());
    let (_, at) = places.found.into_iter().find(|(known, _)| known == path)?;
    Some(1 + text.iter().take(at).filter(|byte| **byte == b'\n').count())
}

/// Walks through JSON and notes where the values begin.
struct Places<'t> {
    text: &'t [u8],
    at: usize,
    found: Vec<(String, usize)>,
}

impl Places<'_> {
    /// Goes on over bytes like these.
    fn skip(&mut self, like: impl Fn(u8) -> bool) {
        self.at += self.text.iter().skip(self.at).take_while(|byte| like(**byte)).count();
    }

    /// The next byte that is not white space; at the end one that ends everything.
    fn next(&mut self) -> u8 {
        self.skip(|byte| byte.is_ascii_whitespace());
        self.text.get(self.at).copied().unwrap_or(b'}')
    }

    /// Reads the string that begins here, without its quotes.
    fn string(&mut self) -> String {
        let start = self.at + 1;
        self.at = start;
        while let Some(byte) = self.text.get(self.at).filter(|byte| **byte != b'"') {
            self.at += if *byte == b'\\' { 2 } else { 1 };
        }
        self.at += 1;
        String::from_utf8_lossy(self.text.get(start..self.at - 1).unwrap_or_default()).into_owned()
    }

    fn value(&mut self, path: String) {
        let first = self.next();
        self.found.push((path.clone(), self.at));
        match first {
            b'"' => _ = self.string(),
            b'{' | b'[' => self.entries(&path, first == b'{'),
            _ => self.skip(|byte| !b",]} \t\r\n".contains(&byte)),
        }
    }

    fn entries(&mut self, path: &str, named: bool) {
        for index in 0.. {
            self.at += 1;
            if [b'}', b']'].contains(&self.next()) {
                break;
            }
            let path = match named {
                true if path.is_empty() => self.string(),
                true => format!("{path}.{}", self.string()),
                false => format!("{path}[{index}]"),
            };
            if named {
                self.next();
                self.at += 1;
            }
            self.value(path);
            if self.next() != b',' {
                break;
            }
        }
        self.at += 1;
    }
}

/// Writes one value as a line of JSON.
///
/// # Errors
/// When the output cannot be written.
pub fn write_line(mut output: impl io::Write, value: &impl serde::Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut output, value)?;
    output.write_all(b"\n")
}

#[cfg(test)]
mod tests {
    use super::line_of;

    #[test]
    fn the_lines_of_values() {
        let text = b"{\n \"a.b\": [1,\n  \"x\\\"]\",\n 3], \"c\": {},\n \"d\": {\"e\": [\n[true]\n]}, \"f\":\n null}";
        for (path, line) in
            [("", 1), ("a.b", 2), ("a.b[1]", 3), ("a.b[2]", 4), ("c", 4), ("d.e[0]", 6), ("d.e[0][0]", 6), ("f", 8)]
        {
            assert_eq!(line_of(text, path), Some(line), "{path}");
        }
        assert_eq!(line_of(text, "g"), None);
        assert_eq!(line_of(b"[{\"k\": 1},\n{\"k\": 2}]", "[1].k"), Some(2));
        for broken in [&b""[..], b"{", b"{\"a", b"[1,", b"{\"a\":"] {
            assert_eq!(line_of(broken, "a.b"), None);
        }
    }
}
