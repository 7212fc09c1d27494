//! Arguments of verbs: each kind of argument has a parser and a printer, and names the files and runs in it.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

use mge_base::atomic::{Format, Target};
use mge_base::paths::expanded;
use mge_results::Composition;
use mge_task::Values;

/// The words after a verb, consumed one by one.
pub(super) struct Words<'a>(pub &'a [String]);

impl<'a> Words<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.0.first().map(String::as_str)
    }

    fn next(&mut self, what: &str) -> Result<&'a str, String> {
        let (word, rest) = self.0.split_first().ok_or_else(|| format!("{what} is missing"))?;
        self.0 = rest;
        Ok(word)
    }

    /// Whether the next word is a keyword, which is then consumed.
    fn take(&mut self, keyword: &str) -> bool {
        let is_next = self.peek() == Some(keyword);
        self.0 = &self.0[usize::from(is_next)..];
        is_next
    }

    /// The words up to the next of some keywords, each KEY=VALUE.
    fn pairs(&mut self, keywords: &[&str]) -> Result<Vec<(&'a str, &'a str)>, String> {
        let mut pairs = Vec::new();
        while let Some(word) = self.peek().filter(|word| !keywords.contains(word)) {
            pairs.push(word.split_once('=').ok_or_else(|| format!("`{word}` is not KEY=VALUE"))?);
            self.next(word)?;
        }
        Ok(pairs)
    }

    /// Fails if a word is left.
    pub fn end(&self) -> Result<(), String> {
        self.peek().map_or(Ok(()), |extra| Err(format!("`{extra}` was not expected")))
    }
}

/// A file or folder in a command.
pub(crate) enum Named<'a> {
    /// A file that the command writes, and its format.
    Output(&'a mut Target, &'a Format<'static>),
    /// The folder of a run.
    Run(&'a mut PathBuf),
}

/// A kind of argument, with values of type `T`.
pub(super) trait Argument<T> {
    /// Parses the next words.
    fn read(&self, words: &mut Words<'_>) -> Result<T, String>;

    /// The words that parse to the value, each preceded by a space.
    fn write(&self, value: &T) -> String;

    /// Passes the files and runs that the value names to `visit`.
    fn visit(&self, _value: &mut T, _visit: &mut dyn FnMut(Named<'_>)) {}
}

fn quoted(text: &str) -> String {
    format!(" {}", shell_words::quote(text))
}

/// Any text, or a type converted from and to one.
pub(super) struct Text(pub &'static str);

impl<T: From<String> + Clone> Argument<T> for Text
where
    String: From<T>,
{
    fn read(&self, words: &mut Words<'_>) -> Result<T, String> {
        Ok(words.next(self.0)?.to_owned().into())
    }

    fn write(&self, value: &T) -> String {
        quoted(&String::from(value.clone()))
    }
}

/// All words that are left, as one text.
pub(super) struct Rest(pub &'static str);

impl Argument<String> for Rest {
    fn read(&self, words: &mut Words<'_>) -> Result<String, String> {
        let text = words.0.join(" ");
        words.next(self.0)?;
        words.0 = &[];
        Ok(text)
    }

    fn write(&self, value: &String) -> String {
        quoted(value)
    }
}

/// The path of a file or folder, and whether it is the folder of a run.
pub(super) struct Place(pub &'static str, pub bool);

/// The folder of a run.
pub(super) const RUN: Place = Place("a run's folder", true);

impl Place {
    /// Whether a word would rather be an option.
    fn is_confused(&self, word: &str) -> bool {
        !self.1 && is_option(word) && !word.contains('/')
    }
}

impl Argument<PathBuf> for Place {
    fn read(&self, words: &mut Words<'_>) -> Result<PathBuf, String> {
        let word = words.next(self.0)?;
        match self.is_confused(word) {
            true => Err(format!("`{word}` is not {}: write its name alone, or `./{word}` if that is its name", self.0)),
            false => Ok(expanded(word)),
        }
    }

    fn write(&self, value: &PathBuf) -> String {
        let path = value.display().to_string();
        quoted(&if self.is_confused(&path) { format!("./{path}") } else { path })
    }

    fn visit(&self, value: &mut PathBuf, visit: &mut dyn FnMut(Named<'_>)) {
        if self.1 {
            visit(Named::Run(value));
        }
    }
}

/// The folders of one run or several.
pub(super) struct RunFolders;

impl Argument<Vec<PathBuf>> for RunFolders {
    fn read(&self, words: &mut Words<'_>) -> Result<Vec<PathBuf>, String> {
        let mut folders = vec![RUN.read(words)?];
        while words.peek().is_some() {
            folders.push(RUN.read(words)?);
        }
        Ok(folders)
    }

    fn write(&self, value: &Vec<PathBuf>) -> String {
        value.iter().map(|folder| RUN.write(folder)).collect()
    }

    fn visit(&self, value: &mut Vec<PathBuf>, visit: &mut dyn FnMut(Named<'_>)) {
        value.iter_mut().for_each(|folder| visit(Named::Run(folder)));
    }
}

/// The path of a file to write, of a format. Followed by `force`, it replaces a file of any format.
pub(super) struct Output(pub Format<'static>);

const FILE: Place = Place("a file", false);

impl Argument<Target> for Output {
    fn read(&self, words: &mut Words<'_>) -> Result<Target, String> {
        Ok(Target { path: FILE.read(words)?, force: words.take(FORCE) })
    }

    fn write(&self, value: &Target) -> String {
        let force = if value.force { format!(" {FORCE}") } else { String::new() };
        FILE.write(&value.path) + &force
    }

    fn visit(&self, value: &mut Target, visit: &mut dyn FnMut(Named<'_>)) {
        visit(Named::Output(value, &self.0));
    }
}

const FORCE: &str = "force";

/// A number.
pub(super) struct Number(pub &'static str);

impl<T: FromStr + Display> Argument<T> for Number {
    fn read(&self, words: &mut Words<'_>) -> Result<T, String> {
        let word = words.next(self.0)?;
        word.parse().map_err(|_| format!("`{word}` is not a {}", self.0))
    }

    fn write(&self, value: &T) -> String {
        format!(" {value}")
    }
}

/// A whole number within a range.
pub(super) struct Within<T>(pub &'static str, pub RangeInclusive<T>);

impl<T: FromStr + Display + PartialOrd + Copy> Argument<T> for Within<T> {
    fn read(&self, words: &mut Words<'_>) -> Result<T, String> {
        let (what, range) = (self.0, &self.1);
        let count: T = Number(what).read(words)?;
        let wrong = || format!("`{count}` is not a {what} from {} to {}", range.start(), range.end());
        range.contains(&count).then_some(count).ok_or_else(wrong)
    }

    fn write(&self, value: &T) -> String {
        Number(self.0).write(value)
    }
}

/// An index, counted from 1 in the language and from 0 in the program.
pub(super) struct Index;

impl Argument<usize> for Index {
    fn read(&self, words: &mut Words<'_>) -> Result<usize, String> {
        let number: usize = Number("number").read(words)?;
        number.checked_sub(1).ok_or_else(|| "numbers count from 1".to_owned())
    }

    fn write(&self, value: &usize) -> String {
        format!(" {}", value + 1)
    }
}

/// A normalised position: x and y.
pub(super) struct Position;

impl Argument<[f32; 2]> for Position {
    fn read(&self, words: &mut Words<'_>) -> Result<[f32; 2], String> {
        Ok([Number("coordinate").read(words)?, Number("coordinate").read(words)?])
    }

    fn write(&self, [x, y]: &[f32; 2]) -> String {
        format!(" {x} {y}")
    }
}

/// A value parsed by its type, whose error message is shown.
pub(super) struct Parsed(pub &'static str);

impl<T: FromStr<Err: Display> + Display> Argument<T> for Parsed {
    fn read(&self, words: &mut Words<'_>) -> Result<T, String> {
        words.next(self.0)?.parse().map_err(|error: T::Err| error.to_string())
    }

    fn write(&self, value: &T) -> String {
        format!(" {value}")
    }
}

/// An optional argument, absent if there is no further word or the next one is for another argument.
pub(super) struct Optional<W>(pub W, pub fn(&str) -> bool);

/// An optional last argument.
pub(super) const fn optional<W>(argument: W) -> Optional<W> {
    Optional(argument, |_| false)
}

impl<T, W: Argument<T>> Argument<Option<T>> for Optional<W> {
    fn read(&self, words: &mut Words<'_>) -> Result<Option<T>, String> {
        words.peek().filter(|word| !(self.1)(word)).map(|_| self.0.read(words)).transpose()
    }

    fn write(&self, value: &Option<T>) -> String {
        value.as_ref().map(|value| self.0.write(value)).unwrap_or_default()
    }

    fn visit(&self, value: &mut Option<T>, visit: &mut dyn FnMut(Named<'_>)) {
        value.iter_mut().for_each(|value| self.0.visit(value, visit));
    }
}

/// Whether a word is a KEY=VALUE option.
pub(super) fn is_option(word: &str) -> bool {
    word.contains('=')
}

/// An argument after a keyword, if that follows.
pub(super) struct Keyword<W>(pub &'static str, pub W);

impl<T, W: Argument<T>> Argument<Option<T>> for Keyword<W> {
    fn read(&self, words: &mut Words<'_>) -> Result<Option<T>, String> {
        words.take(self.0).then(|| self.1.read(words)).transpose()
    }

    fn write(&self, value: &Option<T>) -> String {
        value.as_ref().map(|value| format!(" {}{}", self.0, self.1.write(value))).unwrap_or_default()
    }
}

/// The composition of a figure of learning curves, as KEY=VALUE options.
pub(super) struct Composed;

impl Argument<Composition> for Composed {
    fn read(&self, words: &mut Words<'_>) -> Result<Composition, String> {
        Composition::default().with_options(words.pairs(&[])?)
    }

    fn write(&self, value: &Composition) -> String {
        value.options().iter().map(|(key, value)| format!(" {key}={}", shell_words::quote(value))).collect()
    }

    fn visit(&self, value: &mut Composition, visit: &mut dyn FnMut(Named<'_>)) {
        value.runs.iter_mut().for_each(|run| visit(Named::Run(run)));
    }
}

/// Properties of a tool as `KEY=VALUE`: at least this many.
pub(super) struct Properties(pub usize);

impl Argument<Values> for Properties {
    fn read(&self, words: &mut Words<'_>) -> Result<Values, String> {
        let pairs = words.pairs(&[])?;
        if pairs.len() < self.0 {
            words.next("KEY=VALUE")?;
        }
        let number = |(key, value): (&str, &str)| {
            let number = value.parse::<f64>().map_err(|_| format!("`{value}` is not a number for {key}"))?;
            Ok((key.parse()?, number))
        };
        pairs.into_iter().map(number).collect()
    }

    fn write(&self, value: &Values) -> String {
        value.iter().map(|(property, value)| format!(" {property}={value}")).collect()
    }
}

/// Settings as `KEY=VALUE`, up to the keyword `in` or `until`.
pub(super) struct Changes;

impl Argument<Vec<(String, String)>> for Changes {
    fn read(&self, words: &mut Words<'_>) -> Result<Vec<(String, String)>, String> {
        let pairs = words.pairs(&["in", "until"])?.into_iter();
        Ok(pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect())
    }

    fn write(&self, value: &Vec<(String, String)>) -> String {
        let quote = |text| shell_words::quote(text);
        value.iter().map(|(key, value)| format!(" {}={}", quote(key), quote(value))).collect()
    }
}
