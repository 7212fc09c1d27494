//! Commands for the action clusters.

use super::arguments::{Argument, Optional, Output};
use super::{Awaits, Execute, InScripts, Verb, syntax};
use crate::dry_run::DryRun;
use crate::{Session, SessionError};
use mge_base::atomic::{Format, Target};
use mge_guidance::ActionPrior;
use mge_trainer::Control;

/// Recomputes the action clusters of the task, and saves them to a file if one is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Clusters(pub Option<Target>);

impl Execute for Clusters {
    syntax! {
        "clusters" "[FILE [force]]" "recompute the action clusters of the task, and save them to a file"
            => Clusters { 0: Optional(Output("a file")) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.compute_clusters(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(self.0.as_ref());
        Ok(())
    }

    /// A script waits until the file is written.
    fn in_scripts(&self) -> InScripts {
        let awaits = if self.0.is_some() { Awaits::Everything } else { Awaits::Work };
        InScripts { awaits, ..InScripts::default() }
    }

    fn output(&self) -> Option<(&Target, Format<'static>)> {
        self.0.as_ref().map(|to| (to, ActionPrior::FORMAT))
    }

    fn output_mut(&mut self) -> Option<&mut Target> {
        self.0.as_mut()
    }
}

/// Hands the action clusters to the running training.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide;

impl Execute for Guide {
    syntax! { "guide" "" "give the action clusters to the running training" => Guide {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let prior = session.prior().ok_or(SessionError::NoClusters)?.clone();
        let run = session.run_mut().ok_or(SessionError::NoRun)?;
        let (there, here) = (run.config().task.subgoals.len(), prior.stages.len() - 1);
        if there != here {
            let message = format!("the clusters are for {here} subgoals, but the run's task has {there}");
            return Err(SessionError::Failed(message));
        }
        let config = run.config();
        if !config.further_tasks.is_empty() && prior.task != config.task.name {
            let (first, other) = (&config.task.name, &prior.task);
            let message = format!("a run on several tasks takes clusters of the first, {first}: these are of {other}");
            return Err(SessionError::Failed(message));
        }
        run.send(Control::SetPrior(prior))?;
        let number = run.number();
        session.journal.note_guide(number);
        Ok("the training takes the clusters at its next episode".to_owned())
    }

    fn in_scripts(&self) -> InScripts {
        // The journal knows later at which episode the training took them.
        InScripts { unrecorded: true, ..InScripts::default() }
    }
}
