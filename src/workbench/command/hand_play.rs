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
        let step = session.hand_play.place(self.0)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        Ok(format!("{:?}, reward {:.2}{end}", step.placement, step.reward).to_lowercase())
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
