//! Hand play: the person places the tools.

use super::words::{Position, Word};
use super::{Execute, Verb, syntax};
use crate::env::Action;
use crate::workbench::{Session, SessionError};

/// Places the tool and lets the world run for one action.
#[derive(Debug, Clone, PartialEq)]
pub struct Place(pub Action);

impl Execute for Place {
    syntax! { "place" "X Y" "place the tool and let the world run for one action" => Place { 0: Position }; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let refusal = session.hand_play.snapshot().refusal(session.hand_play.task(), self.0);
        let step = session.hand_play.place(self.0)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        let placed = refusal.map_or_else(|| "placed".to_owned(), |reason| format!("not placed: {reason}"));
        Ok(format!("{placed}; reward {:.2}{end}", step.reward))
    }
}

/// Starts the episode of hand play again.
#[derive(Debug, Clone, PartialEq)]
pub struct Reset;

impl Execute for Reset {
    syntax! { "reset" "" "start the episode of hand play again" => Reset {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.restart_hand_play();
        Ok("a new episode".to_owned())
    }
}
