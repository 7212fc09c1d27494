//! Everything a person can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, a script and the command
//! line differ only in where their commands come from.

pub mod command;
mod dry_run;
mod error;
mod export;
mod hand_play;
mod journal;
mod model_job;
mod prior_job;
mod proposal_job;
mod proposals;
mod run;
mod runs;
mod script;
mod session;
mod setup;

pub use command::{Command, CommandError, FigureKind, Verb, verbs};
pub use error::SessionError;
pub use hand_play::HandPlay;
pub use run::RunView;
pub use script::{Output, Script, ScriptError, Variables};
pub use session::{FIRST_TASK, Notice, PriorState, Session};
