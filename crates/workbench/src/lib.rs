//! Everything a user can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, scripts and the command line differ
//! only in where their commands come from. A command is a line of text that parses to what it prints.
//! A session never waits: longer work is a [`Job`], whose result [`Session::poll`] applies. A [`Script`] is checked as
//! a whole before its first command is executed, and waits where a line needs a result.
//! [`Session::to_script`] returns the session so far as a script that repeats it.
//!
//! ```
//! use mge_workbench::{FIRST_TASK, Output, Script, Session};
//!
//! let mut session = Session::on_task(FIRST_TASK, "runs".into())?;
//! let script = Script::parse("seed 7\nset ddpg.gamma 0.9\nsubgoal add 0.5 0", "my script", &[])?;
//! script.run(&mut session, |_output: Output<'_>| {})?;
//! assert_eq!(session.config().seed, 7);
//! assert!(session.is_dirty(), "the task has an unsaved subgoal");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![deny(unsafe_code)]

mod clusters;
pub mod command;
mod error;
mod export;
mod forks;
mod job;
mod journal;
pub mod listing;
mod loader;
mod models;
mod proposals;
mod run;
mod run_log;
mod runs;
mod saved;
mod script;
mod session;
mod setup;
#[cfg(test)]
mod tests;

pub use clusters::PriorState;
pub use command::{Command, CommandError, FigureKind, HandPlay, Verb, verbs};
pub use error::SessionError;
pub use export::{FigureJob, run_label};
pub use job::{Job, Progress};
pub use loader::Loader;
pub use models::MODELS;
pub use run::RunView;
pub use runs::{OF_RUN, free_name, usual_name};
pub use saved::{Player, SavedAgent, SavedRun};
pub use script::{Output, Script, ScriptError, Variables};
pub use session::{FIRST_TASK, Notice, Session};
pub use setup::check_settings;

use mge_base::atomic::{self, Format, Target};
use mge_run::RunError;

/// Writes a file, creating its parent folder if needed.
fn write_file(to: &Target, bytes: &[u8], format: &Format<'_>) -> Result<(), RunError> {
    let written = atomic::create_parent(&to.path).and_then(|()| to.write(bytes, format));
    written.map_err(RunError::io("write", &to.path))
}
