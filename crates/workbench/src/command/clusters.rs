//! Commands for the action clusters.

use super::arguments::{Argument, Named, Output, Words, optional};
use super::{Command, Execute, ScriptRole, Verb, WaitFor, command};
use crate::{Session, SessionError};
use mge_base::atomic::Target;
use mge_guidance::ActionPrior;
use mge_trainer::Control;

command! {
    /// Recomputes the action clusters of the task, and saves them to a file if one is given.
    Clusters(to: Option<Target> = optional(Output(ActionPrior::FORMAT))):
        "clusters" "[FILE [force]]" "recompute the action clusters of the task, and save them to a file";
    execute = |this, session| session.compute_clusters(this);
    // A script waits until the file is written.
    script_role = |this| {
        let awaits = if this.0.is_some() { WaitFor::Everything } else { WaitFor::Work };
        ScriptRole { awaits, ..ScriptRole::default() }
    };
}

command! {
    /// Hands the action clusters to the running training.
    Guide: "guide" "" "give the action clusters to the running training";
    execute = |_, session| guide(session);
    // The journal knows later at which episode the training took them.
    script_role = |_| ScriptRole { unrecorded: true, ..ScriptRole::default() };
}

fn guide(session: &mut Session) -> Result<String, SessionError> {
    let prior = session.prior().ok_or(SessionError::NoClusters)?.clone();
    let run = session.run_mut().ok_or(SessionError::NoRun)?;
    let (there, here) = (run.config().task.subgoals.len(), prior.stages.len() - 1);
    if there != here {
        return Err(format!("the clusters are for {here} subgoals, but the run's task has {there}").into());
    }
    run.send(Control::SetPrior(prior))?;
    let number = run.number;
    session.journal.note_guide(number);
    Ok("the training takes the clusters at its next episode".to_owned())
}
