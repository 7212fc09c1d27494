//! Everything a user can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, scripts and the command line differ
//! only in where their commands come from.

#![deny(unsafe_code)]

mod clusters;
pub mod command;
mod dry_run;
mod error;
mod export;
mod forks;
mod hand_play;
mod job;
mod jobs;
mod journal;
mod models;
mod proposals;
mod puzzles;
mod run;
mod runs;
mod saved;
mod script;
mod seeds;
mod session;
mod setup;
#[cfg(test)]
mod tests;

pub use clusters::PriorState;
pub use command::{Command, CommandError, FigureKind, Verb, verbs};
pub use error::SessionError;
pub use export::run_label;
pub use export::{DrawnFigure, FigureJob};
pub use hand_play::HandPlay;
pub use job::Job;
pub use job::Progress;
pub use models::{MODELS, saved_evaluation};
pub use run::RunView;
pub use saved::{Player, SavedAgent, SavedRun};
pub use script::{Output, Script, ScriptError, Variables};
pub use session::{FIRST_TASK, Notice, Session};

use mge_base::atomic::{self, Format, Target};
use mge_run::RunError;

/// Writes a file, creating its parent folder if needed.
fn write_file(to: &Target, bytes: &[u8], format: &Format<'_>) -> Result<(), RunError> {
    let written = atomic::create_parent(&to.path).and_then(|()| to.write(bytes, format));
    written.map_err(RunError::io("write", &to.path))
}
