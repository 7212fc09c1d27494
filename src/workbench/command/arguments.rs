//! The words after a verb, and how values are written so that they are read back.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::spelling::did_you_mean;

/// The words after a verb, taken one by one.
pub(super) struct Arguments<'a> {
    words: &'a [String],
}

impl<'a> Arguments<'a> {
    pub fn new(words: &'a [String]) -> Self {
        Self { words }
    }

    /// The next word, if there is one.
    pub fn optional(&mut self) -> Option<&'a str> {
        let (word, rest) = self.words.split_first()?;
        self.words = rest;
        Some(word)
    }

    /// The next word, which is not taken.
    pub fn peek(&self) -> Option<&'a str> {
        self.words.first().map(String::as_str)
    }

    pub fn word(&mut self, what: &str) -> Result<&'a str, String> {
        self.optional().ok_or_else(|| format!("{what} is missing"))
    }

    pub fn number<T: FromStr>(&mut self, what: &str) -> Result<T, String> {
        let word = self.word(what)?;
        word.parse().map_err(|_| format!("`{word}` is not a {what}"))
    }

    pub fn optional_number<T: FromStr>(&mut self, what: &str) -> Result<Option<T>, String> {
        self.peek().map(|_| self.number(what)).transpose()
    }

    pub fn position(&mut self) -> Result<[f32; 2], String> {
        Ok([self.number("coordinate")?, self.number("coordinate")?])
    }

    /// A number that counts from 1 in the language and from 0 inside.
    pub fn index(&mut self) -> Result<usize, String> {
        let number: usize = self.number("number")?;
        number.checked_sub(1).ok_or_else(|| "numbers count from 1".to_owned())
    }

    pub fn optional_index(&mut self) -> Result<Option<usize>, String> {
        self.peek().map(|_| self.index()).transpose()
    }

    pub fn path(&mut self, what: &str) -> Result<PathBuf, String> {
        self.word(what).map(PathBuf::from)
    }

    pub fn optional_path(&mut self) -> Option<PathBuf> {
        self.optional().map(PathBuf::from)
    }

    /// `until N`, if anything follows.
    pub fn until(&mut self) -> Result<Option<u32>, String> {
        match self.optional() {
            None => Ok(None),
            Some("until") => self.number("number of episodes").map(Some),
            Some(other) => Err(unexpected(other)),
        }
    }

    pub fn one_of<T: Copy>(&mut self, what: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
        let word = self.word(what)?;
        all.iter().copied().find(|item| name(*item) == word).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|item| name(*item)).collect();
            let hint = did_you_mean(known.iter().copied(), word);
            format!("`{word}` is not one of {}{hint}", known.join(", "))
        })
    }

    /// Nothing follows.
    pub fn end(&mut self) -> Result<(), String> {
        self.optional().map_or(Ok(()), |extra| Err(unexpected(extra)))
    }
}

fn unexpected(word: &str) -> String {
    format!("`{word}` was not expected")
}

/// A text as one word of a line.
pub(super) fn quoted(text: &str) -> String {
    shell_words::quote(text).into_owned()
}

/// A path as one word of a line.
pub(super) fn quoted_path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// A space and the value, or nothing.
pub(super) fn optional(value: Option<impl fmt::Display>) -> String {
    value.map(|value| format!(" {value}")).unwrap_or_default()
}

/// ` until N`, or nothing.
pub(super) fn until(episodes: Option<u32>) -> String {
    optional(episodes.map(|episodes| format!("until {episodes}")))
}
