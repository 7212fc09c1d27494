//! JSON: parsing with errors that give the line, the column, the JSON path and the problem, and writing.

use std::collections::BTreeSet;
use std::io;

use jsonc_parser::common::Ranged as _;
use jsonc_parser::{CollectOptions, ParseOptions, ast, parse_to_ast};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_path_to_error::{Path, Segment};

use crate::atomic::{Format, Target};
use crate::text::{MAX_EXCERPT_LENGTH, excerpt, without_mark};

/// The text is not JSON, or does not have the expected form.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{origin}:{line}:{column}: {}{message}", if path == "." { String::new() } else { format!("at `{path}`: ") })]
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

/// Reads one JSON value, also after a byte-order mark; `origin` names the text in errors.
///
/// # Errors
/// When the text is not JSON or not a `T`.
pub fn parse<T: DeserializeOwned>(text: &[u8], origin: &str) -> Result<T, SyntaxError> {
    let mut deserializer = serde_json::Deserializer::from_slice(without_mark(text));
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax_error(known_path(error.path()), error.inner(), origin))?;
    deserializer.end().map_err(|error| syntax_error(".".to_owned(), &error, origin))?;
    Ok(value)
}

/// A path without a last key that is unknown, as where the text ends before a key.
pub fn known_path(path: &Path) -> String {
    let text = path.to_string();
    match path.iter().next_back() {
        Some(Segment::Unknown) => text.strip_suffix(".?").unwrap_or(".").to_owned(),
        _ => text,
    }
}

fn syntax_error(path: String, error: &serde_json::Error, origin: &str) -> SyntaxError {
    let [path, message] = [path, message(error)].map(|text| excerpt(&text, MAX_EXCERPT_LENGTH).into_owned());
    SyntaxError { origin: origin.to_owned(), line: error.line(), column: error.column(), path, message }
}

/// The message of an error without its line and column, which are shown separately.
pub fn message(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&place).unwrap_or(&message).to_owned()
}

/// Plain data, which always serialises, as indented JSON with a final line feed.
pub fn pretty(data: &impl Serialize) -> String {
    serde_json::to_string_pretty(data).expect("plain data") + "\n"
}

/// The format of results, which name the version of the program.
pub const RESULTS: Format<'static> =
    Format { name: "a file of results", is: &|found| keys(found).contains("mge_version") };

/// Writes an object of plain data, indented. Files of results and those of objects with the same keys are replaced.
///
/// # Errors
/// As for [`Target::write`].
pub fn write(to: &Target, data: &impl Serialize) -> io::Result<()> {
    let text = pretty(data);
    let own = keys(text.as_bytes());
    let is_like = |found: &[u8]| (RESULTS.is)(found) || (keys(found) == own && !own.is_empty());
    to.write(text.as_bytes(), &Format { is: &is_like, ..RESULTS })
}

/// The keys of a JSON object; none for other text.
pub fn keys(text: &[u8]) -> BTreeSet<String> {
    let entries: Option<serde_json::Map<String, Value>> = serde_json::from_slice(text).ok();
    entries.into_iter().flatten().map(|(key, _)| key).collect()
}

/// Plain data as a JSON value with numbers as in its text: 0.99 and not 0.9900000095367432.
pub fn to_value(data: &impl Serialize) -> Value {
    let text = serde_json::to_string(data).expect("plain data");
    serde_json::from_str(&text).expect("what was written can be read")
}

/// A value as text; strings, also those of a list, without their quotes.
pub fn text(value: &Value) -> String {
    let all: Option<Vec<&str>> =
        value.as_array().filter(|all| !all.is_empty()).and_then(|all| all.iter().map(Value::as_str).collect());
    let none = value.is_null().then(|| "none".to_owned());
    value.as_str().map(str::to_owned).or(none).or(all.map(|all| all.join(", "))).unwrap_or_else(|| value.to_string())
}

/// The value of a text: JSON, or a string without its quotes.
pub fn value_of(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| text.into())
}

/// The paths, such as `ddpg.gamma`, and values of everything in a JSON value that is not an object.
pub fn leaf_values(value: &Value) -> Vec<(String, &Value)> {
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

/// The value at a path as in [`leaf_values`].
pub fn at_mut<'a>(value: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    path.split('.').try_fold(value, |place, part| place.get_mut(part))
}

/// The line, from 1, on which the value at a JSON path begins, in valid JSON.
pub fn line_of(text: &[u8], path: &str) -> Option<usize> {
    let text = str::from_utf8(without_mark(text)).ok()?;
    let parsed = parse_to_ast(text, &CollectOptions::default(), &ParseOptions::default()).ok()?;
    let start = start_of(&parsed.value?, String::new(), path)?;
    Some(1 + text[..start].matches('\n').count())
}

/// Where the value at a JSON path begins, in bytes; `here` is the path of `value`.
fn start_of(value: &ast::Value<'_>, here: String, path: &str) -> Option<usize> {
    match value {
        value if here == path => Some(value.start()),
        ast::Value::Object(object) => object.properties.iter().find_map(|entry| {
            let dot = if here.is_empty() { "" } else { "." };
            start_of(&entry.value, format!("{here}{dot}{}", entry.name.as_str()), path)
        }),
        ast::Value::Array(array) => {
            let mut entries = array.elements.iter().enumerate();
            entries.find_map(|(index, entry)| start_of(entry, format!("{here}[{index}]"), path))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn where_a_text_ends_before_a_key_the_path_is_that_of_the_object() {
        type Objects = BTreeMap<String, BTreeMap<String, u64>>;
        for (text, path) in [("{", "."), ("{\"a\": {", "a"), ("{\"a\": {\"b\": x", "a.b")] {
            assert_eq!(parse::<Objects>(text.as_bytes(), "o").unwrap_err().path, path, "{text}");
        }
    }

    #[test]
    fn the_lines_of_values() {
        let text = b"{\n \"a.b\": [1,\n  \"x\\\"]\",\n 3], \"c\": {},\n \"d\": {\"e\": [\n[true]\n]}, \"f\":\n null}";
        for (path, line) in
            [("", 1), ("a.b", 2), ("a.b[1]", 3), ("a.b[2]", 4), ("c", 4), ("d.e[0]", 6), ("d.e[0][0]", 6), ("f", 8)]
        {
            assert_eq!(line_of(text, path), Some(line), "{path}");
        }
        assert_eq!(line_of(text, "g"), None);
        assert_eq!(line_of(b"\xef\xbb\xbf[{\"k\": 1},\n{\"k\": 2}]", "[1].k"), Some(2));
        for broken in [&b""[..], b"{", b"{\"a", b"[1,", b"{\"a\":"] {
            assert_eq!(line_of(broken, "a.b"), None);
        }
    }
}
