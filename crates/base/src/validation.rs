//! Checks of values: one error type that names the value by its JSON path.

use std::fmt::{self, Display};

use serde::Serialize;
use serde_json::Value;

use crate::json;
use crate::text::{MAX_EXCERPT_LENGTH, excerpt};

/// A well-formed value that is not allowed: its place and the reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {message}")]
pub struct ValidationError {
    /// JSON path, such as `tools[1].size`.
    pub path: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl ValidationError {
    /// An error about the value at a JSON path.
    pub fn new(path: impl Display, message: impl Display) -> Self {
        let [path, message] = [path.to_string(), message.to_string()];
        let short = |text: String| excerpt(&text, MAX_EXCERPT_LENGTH).into_owned();
        Self { path: short(path), message: short(message) }
    }

    /// The same error with `parent` prepended to the path.
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

/// Results of checks of a part of a whole.
pub trait Within {
    /// The same result for the whole, in which the part is at `parent`: see [`ValidationError::within`].
    fn within(self, parent: impl Display) -> Self;
}

impl<T> Within for Result<T, ValidationError> {
    fn within(self, parent: impl Display) -> Self {
        self.map_err(|problem| problem.within(parent))
    }
}

/// Checks the entries of the list at `path`.
///
/// # Errors
/// The first problem, with the entry's index.
pub fn check_each<T>(
    entries: &[T],
    path: impl Display,
    check: impl Fn(&T) -> Result<(), ValidationError>,
) -> Result<(), ValidationError> {
    let mut entries = entries.iter().enumerate();
    entries.try_for_each(|(index, entry)| check(entry).within(format_args!("{path}[{index}]")))
}

/// Whether a number is finite and in `[low, high]`.
///
/// # Errors
/// When it is not.
pub fn in_range<T: PartialOrd + Display + Copy>(
    value: T,
    path: impl Display,
    low: T,
    high: T,
) -> Result<(), ValidationError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ValidationError::new(path, format_args!("is {value}, but must be a number from {low} to {high}")))
}

/// A number of a configuration: its range and its meaning. Tables of settings validate configurations and are printed
/// in the manual.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// JSON path within the configuration, such as `ou.theta`.
    pub path: &'static str,
    /// Its allowed values.
    pub range: Range,
    /// A description in one line.
    pub about: &'static str,
}

/// The range of a number, both ends included.
#[derive(Debug, Clone, Copy, derive_more::Display, PartialEq)]
pub enum Range {
    /// A whole number.
    #[display("a whole number from {_0} to {_1}")]
    Count(u64, u64),
    /// Any number.
    #[display("a number from {} to {}", Short(*_0), Short(*_1))]
    Number(f32, f32),
    /// A list of numbers.
    #[display("numbers from {} to {}", Short(*_0), Short(*_1))]
    Numbers(f32, f32),
    /// A whole number, or null for none.
    #[display("a whole number from {_0} to {_1}, or none")]
    CountOrNull(u64, u64),
    /// Any number, or null for none.
    #[display("a number from {} to {}, or none", Short(*_0), Short(*_1))]
    NumberOrNull(f32, f32),
    /// Two numbers in increasing order, or null for none.
    #[display("two numbers from {} to {}, the lower first, or none", Short(*_0), Short(*_1))]
    IntervalOrNull(f32, f32),
}

impl Setting {
    /// A number with this range.
    pub const fn new(path: &'static str, range: Range, about: &'static str) -> Self {
        Self { path, range, about }
    }

    /// A whole number from `low` to `high`.
    pub const fn count(path: &'static str, low: u64, high: u64, about: &'static str) -> Self {
        Self::new(path, Range::Count(low, high), about)
    }

    /// A number from `low` to `high`.
    pub const fn number(path: &'static str, low: f32, high: f32, about: &'static str) -> Self {
        Self::new(path, Range::Number(low, high), about)
    }
}

/// The shortest text of a number, with an exponent where it has many zeros.
struct Short(f32);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.abs() {
            size if size == 0.0 || (1e-4..1e7).contains(&size) => write!(f, "{}", self.0),
            _ => write!(f, "{:e}", self.0),
        }
    }
}

impl Range {
    fn contains(self, value: &Value) -> bool {
        let within = |low: f32, high: f32, value: &Value| {
            value.as_f64().is_some_and(|value| (low..=high).contains(&(value as f32)))
        };
        match self {
            Self::Count(low, high) => value.as_u64().is_some_and(|value| (low..=high).contains(&value)),
            Self::Number(low, high) => within(low, high, value),
            Self::Numbers(low, high) => {
                value.as_array().is_some_and(|values| values.iter().all(|value| within(low, high, value)))
            }
            Self::CountOrNull(low, high) => value.is_null() || Self::Count(low, high).contains(value),
            Self::NumberOrNull(low, high) => value.is_null() || within(low, high, value),
            Self::IntervalOrNull(low, high) => match value.as_array().map(Vec::as_slice) {
                Some([first, second]) => {
                    within(low, high, first) && within(low, high, second) && first.as_f64() < second.as_f64()
                }
                _ => value.is_null(),
            },
        }
    }
}

/// Checks the numbers of a configuration against their table. Settings that the configuration does not contain, such
/// as those of another enum variant, are skipped.
///
/// # Errors
/// The first number that is out of its range.
pub fn check_settings(config: &impl Serialize, settings: &[Setting]) -> Result<(), ValidationError> {
    // Infinite numbers and NaN become null.
    let config = json::to_value(config);
    for Setting { path, range, .. } in settings {
        let place = path.split('.').try_fold(&config, |value, name| value.get(name));
        if let Some(value) = place.filter(|value| !range.contains(value)) {
            let value = if value.is_null() { "not a number".to_owned() } else { shortest(value) };
            return Err(ValidationError::new(path, format_args!("is {value}, but must be {range}")));
        }
    }
    Ok(())
}

/// The text of a value; numbers in their shortest single-precision form.
fn shortest(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or_else(String::new, |x| Short(x as f32).to_string())
        }
        Value::Array(values) => format!("[{}]", values.iter().map(shortest).collect::<Vec<_>>().join(", ")),
        _ => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn numbers_are_checked_against_their_table() {
        let settings = [
            Setting::count("a.n", 1, 10, ""),
            Setting::number("a.x", 0.0, 0.1, ""),
            Setting { path: "kept", range: Range::CountOrNull(0, 5), about: "" },
            Setting { path: "clamp", range: Range::IntervalOrNull(-10.0, 10.0), about: "" },
            Setting::count("other.variant", 1, 2, ""),
        ];
        let check = |config: Value| check_settings(&config, &settings).map_err(|error| error.to_string());
        let right = json!({"a": {"n": 10, "x": 0.1f32}, "kept": null, "clamp": [-1, 2.5]});
        assert_eq!(check(right.clone()), Ok(()));
        for (pointer, value, message) in [
            ("/a/n", json!(0), "a.n: is 0, but must be a whole number from 1 to 10"),
            ("/a/n", json!(11), "a.n: is 11, but must be a whole number from 1 to 10"),
            ("/a/n", json!(1.5), "a.n: is 1.5, but must be a whole number from 1 to 10"),
            ("/a/x", json!(0.11), "a.x: is 0.11, but must be a number from 0 to 0.1"),
            ("/a/x", json!(f32::NAN), "a.x: is not a number, but must be a number from 0 to 0.1"),
            ("/kept", json!(6), "kept: is 6, but must be a whole number from 0 to 5, or none"),
            (
                "/clamp",
                json!([2, 1]),
                "clamp: is [2, 1], but must be two numbers from -10 to 10, the lower first, or none",
            ),
            (
                "/clamp",
                json!([1, 11]),
                "clamp: is [1, 11], but must be two numbers from -10 to 10, the lower first, or none",
            ),
        ] {
            let mut wrong = right.clone();
            *wrong.pointer_mut(pointer).unwrap() = value;
            assert_eq!(check(wrong), Err(message.to_owned()));
        }
    }
}
