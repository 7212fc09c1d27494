//! Runs the `mge` program and checks how it ended.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The program built with the tests.
pub const MGE: &str = env!("CARGO_BIN_EXE_mge");

/// The cache of the program's models, instead of the user's.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");

/// The program with arguments, to be started in a folder without input.
pub fn command(folder: impl AsRef<Path>, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Command {
    let mut command = Command::new(MGE);
    command.args(arguments).current_dir(folder).env("XDG_CACHE_HOME", CACHE).stdin(Stdio::null());
    command
}

/// Runs the program in a folder, without input.
pub fn mge(folder: impl AsRef<Path>, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

/// The text that a program wrote.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The standard output of a program that must have succeeded.
#[track_caller]
pub fn succeed(output: Output) -> String {
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// The error message of a program that must have failed with status 1 and one short line without control characters,
/// which contains `expected`.
#[track_caller]
pub fn fail(output: Output, expected: &str) -> String {
    let message = String::from_utf8(output.stderr).expect("messages are UTF-8");
    assert_eq!(output.status.code(), Some(1), "{message:.2000}");
    assert!(message.starts_with("error: ") && message.contains(expected), "{message:.2000}");
    assert_eq!(message.matches('\n').count(), 1, "{message:.2000}");
    assert!(message.len() < 3000, "{} bytes: {message:.200}", message.len());
    assert!(!message.trim_end().contains(char::is_control), "{message:?}");
    message
}
