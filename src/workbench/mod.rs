//! Everything a person can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, a script and the command
//! line differ only in where their commands come from.

mod command;
mod editing;
mod error;
mod export;
mod hand;
mod journal;
mod model_job;
mod prior_job;
mod proposal_job;
mod rehearsal;
mod runs;
mod script;
mod session;
mod training;

pub use command::{Command, CommandError, Comparison, Expectation, FigureKind, Quantity, Verb, verbs};
pub use error::SessionError;
pub use hand::HandPlay;
pub use runs::RunView;
pub use script::{Script, ScriptError, Told, Variables};
pub use session::{Notice, PriorState, Session};
