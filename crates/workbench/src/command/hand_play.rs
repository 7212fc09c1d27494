//! Commands for hand play: the user places the tools.

use super::arguments::{Argument, Named, Position, Within, Words, optional};
use super::{Command, Execute, Verb, command};
use crate::{Session, SessionError};
use mge_env::{Action, held_tool};
use mge_physics::NO_OP;

command! {
    /// Places the task's tool, or the tool with this number in CREATE's catalogue, and simulates one action interval.
    Place(position: Action = Position, number: Option<usize> = optional(Within("number of CREATE's catalogue", 0..=NO_OP - 1))):
        "place" "X Y [N]" "place the tool, or number N of CREATE's, and simulate one action";
    execute = |this, session| {
        let Self(position, number) = *this;
        let hand = &mut session.hand_play;
        let refusal = hand.snapshot().refusal(&held_tool(hand.task(), number), position);
        let step = hand.place(position, number)?;
        let end = step.end.map(|end| format!("; the episode is over: {end}")).unwrap_or_default();
        let placed = refusal.map_or_else(|| "placed".to_owned(), |reason| format!("not placed: {reason}"));
        let subgoals: String = step.subgoals.iter().map(|index| format!("; subgoal {} reached", index + 1)).collect();
        Ok(format!("{placed}{subgoals}; reward {:.2}{end}", step.reward))
    };
}

command! {
    /// Restarts the episode of hand play.
    Reset: "reset" "" "restart the episode played by hand";
    execute = |_, session| {
        session.restart_hand_play();
        Ok("a new episode".to_owned())
    };
}
