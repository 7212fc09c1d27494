//! Everything a person can do, as data: commands, session state, scripts.
//!
//! A [`Command`] is applied to a [`Session`]; the terminal, a script and the command
//! line differ only in where their commands come from.

mod command;
mod hand;
mod prior_job;
mod runs;
mod session;

pub use command::{Command, CommandError, Comparison, Expectation, FigureKind, Quantity, VERBS, Verb};
pub use hand::HandPlay;
pub use runs::{EvaluationRecord, RunView};
pub use session::{Notice, PriorState, Session, SessionError};
