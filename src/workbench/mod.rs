//! Everything a person can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, a script and the command
//! line differ only in where their commands come from.

mod command;

pub use command::{Command, CommandError, VERBS, Verb};
