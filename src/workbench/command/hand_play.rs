//! Hand play: the person places the tools.

use super::{Execute, Verb};
use crate::env::Action;
use crate::workbench::{Session, SessionError};

/// Places the tool and lets the world run for one action.
#[derive(Debug, Clone, PartialEq)]
pub struct Place(pub Action);

impl Execute for Place {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("place", "X Y", "place the tool and let the world run for one action", |args| {
            Ok(Self(args.position()?).into())
        })]
    }

    fn arguments(&self) -> String {
        let [x, y] = self.0;
        format!(" {x} {y}")
    }

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
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("reset", "", "start the episode of hand play again", |_| Ok(Self.into()))]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.restart_hand_play();
        Ok("a new episode".to_owned())
    }
}
