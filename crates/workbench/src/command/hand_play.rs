//! Commands for hand play: the user places the tools.

use super::arguments::{Argument, Optional, Position, Within};
use super::{Execute, Verb, syntax};
use crate::{Session, SessionError};
use mge_env::{Action, held_tool};
use mge_physics::NO_OP;

/// Places the task's tool, or the tool with this number in CREATE's catalogue, and simulates one action interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Place(pub Action, pub Option<usize>);

impl Execute for Place {
    syntax! {
        "place" "X Y [N]" "place the tool, or number N of CREATE's, and simulate one action"
            => Place { 0: Position, 1: Optional(Within("number of CREATE's catalogue", 0..=NO_OP - 1)) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let Self(place, number) = *self;
        let hand = &mut session.hand_play;
        let refusal = hand.snapshot().refusal(&held_tool(hand.task(), number), place);
        let step = hand.place(place, number)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        let placed = refusal.map_or_else(|| "placed".to_owned(), |reason| format!("not placed: {reason}"));
        Ok(format!("{placed}; reward {:.2}{end}", step.reward))
    }
}

/// Restarts the episode of hand play.
#[derive(Debug, Clone, PartialEq)]
pub struct Reset;

impl Execute for Reset {
    syntax! { "reset" "" "restart the episode played by hand" => Reset {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.restart_hand_play();
        Ok("a new episode".to_owned())
    }
}
