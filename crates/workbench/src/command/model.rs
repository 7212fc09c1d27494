//! Commands that train dynamics models in the background.

use super::arguments::{Argument, Changes, Named, Number, Optional, Output, Parsed, Words, is_option};
use super::{Command, Execute, ScriptRole, Verb, WaitFor, command};
use crate::{Session, SessionError};
use mge_base::atomic::Target;
use mge_dynamics::{Model, ToolSet};

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
