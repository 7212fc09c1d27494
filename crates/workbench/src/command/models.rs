//! Commands for dynamics models and the action clusters found with them.

use super::arguments::{Argument, Changes, Named, Number, Optional, Output, Parsed, Words, is_option, optional};
use super::{Command, Execute, ScriptRole, Verb, WaitFor, command};
use crate::{Session, SessionError};
use mge_base::atomic::Target;
use mge_dynamics::{Model, ToolSet};
use mge_guidance::ActionPrior;
use mge_trainer::Control;

command! {
    /// Trains a dynamics model for a tool set and writes it to a file.
    ModelTrain {
        /// The tools that the model covers.
        tools: ToolSet = Parsed("tool types"),
        /// The file.
        to: Target = Output(Model::FORMAT),
        /// Number of epochs; None for the default.
        epochs: Option<u32> = Optional(Number("number of epochs"), is_option),
        /// Other settings and their values, by their names in a sweep file.
        settings: Vec<(String, String)> = Changes,
    }: "model train" "TYPE,... FILE [force] [EPOCHS] [KEY=VALUE]..." "train a dynamics model of these tool types, in the background";
    execute = |this, session| session.train_model(this);
    script_role = |_| ScriptRole { awaits: WaitFor::Work, ..ScriptRole::default() };
}

command! {
    /// Cancels the training of a dynamics model.
    ModelStop: "model stop" "" "end the training of a model";
    execute = |_, session| session.stop_model_work();
    script_role = |_| ScriptRole { unrecorded: true, ..ScriptRole::default() };
}

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
    execute = |_, session| {
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
    };
    // The journal knows later at which episode the training took them.
    script_role = |_| ScriptRole { unrecorded: true, ..ScriptRole::default() };
}
