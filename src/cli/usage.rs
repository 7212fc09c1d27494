//! What is wrong with arguments, in one line each: what, where, and what to write instead.

use std::error::Error as _;
use std::num::IntErrorKind;
use std::path::Path;

use clap::Command;
use clap::error::{ContextKind, ErrorKind};

/// The line for a value that an option or argument refuses.
pub fn refused(error: &clap::Error) -> Option<String> {
    let [argument, value] = [ContextKind::InvalidArg, ContextKind::InvalidValue].map(|kind| error.get(kind));
    let (argument, value) = (argument?.to_string(), value?.to_string());
    let source = error.source().filter(|_| error.kind() == ErrorKind::ValueValidation)?;
    let reason = match source.downcast_ref::<std::num::ParseIntError>().map(std::num::ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "the number is too large".to_owned(),
        Some(_) => "write a whole number, not less than 0".to_owned(),
        None if source.is::<std::num::ParseFloatError>() => "write a number".to_owned(),
        None => {
            // A number that is out of its range; the other texts say what to write.
            let text = source.to_string();
            let range = text.split_once(" is not in ").and_then(|(_, range)| range.split_once(".."));
            let of = |(low, high): (&str, &str)| {
                format!("write a whole number from {low} to {}", high.trim_start_matches('='))
            };
            range.map(of).unwrap_or(text)
        }
    };
    let name = argument.split(' ').next().unwrap_or_default();
    Some(format!("{name} {value}: {reason}"))
}

/// The line for a setting `KEY=VALUE` that stands where a task, a file or a run belongs.
pub fn misplaced(command: &Command, words: &[String]) -> Option<String> {
    let (mut command, mut name) = (command, "mge".to_owned());
    let mut words = words.iter();
    while let Some(word) = words.next() {
        // The name of a run may be any text, and so may what follows `--`.
        if word == "--" || name == "mge rename" {
            return None;
        }
        if let Some(below) = command.find_subcommand(word) {
            (command, name) = (below, format!("{name} {word}"));
            continue;
        }
        // In a command that is not built yet, these are flags, too.
        let options: Vec<_> = command.get_opts().filter(|option| option.get_action().takes_values()).collect();
        let has = |long: &str| options.iter().any(|option| option.get_long() == Some(long));
        if word.strip_prefix("--").is_some_and(has) {
            // Its value.
            words.next();
        }
        let Some((key, value)) = word.split_once('=') else { continue };
        let is_key = key.starts_with(|c: char| c.is_ascii_lowercase()) && !key.contains('/');
        if !is_key || Path::new(word).exists() || command.has_subcommands() {
            continue;
        }
        let typed = shell_words::quote(value);
        let remedy = match () {
            () if has(key) => format!("write `--{key} {typed}`"),
            () if has("set") => format!("write `--set {key}={typed}`"),
            () if name == "mge config" => format!("write it into a file, or `mge train TASK --set {key}={typed}`"),
            () => format!("`{name} --help` tells what it takes"),
        };
        return Some(format!("`{word}` is a setting, where `{name}` expects a name or a file: {remedy}"));
    }
    None
}
