//! Commands that train and evaluate dynamics models in the background.

use super::arguments::{Argument, Number, Optional, Output, Parsed, Text};
use super::{Awaits, Execute, InScripts, Verb, syntax};
use crate::dry_run::DryRun;
use crate::{Session, SessionError};
use mge_base::atomic::{Format, Target};
use mge_dynamics::{Model, ToolSet};

/// Trains a dynamics model for a tool set and writes it to a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelTrain {
    /// The tools that the model covers.
    pub tools: ToolSet,
    /// The file.
    pub to: Target,
    /// Number of epochs; None for the default.
    pub epochs: Option<u32>,
}

impl Execute for ModelTrain {
    syntax! {
        "model train" "TYPE,... FILE [force] [EPOCHS]" "train a dynamics model of these tool types, in the background"
            => ModelTrain { tools: Parsed("tool types"), to: Output("a file"), epochs: Optional(Number("number of epochs")) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.train_model(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(Some(&self.to));
        Ok(())
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { awaits: Awaits::Work, ..InScripts::default() }
    }

    fn output(&self) -> Option<(&Target, Format<'static>)> {
        Some((&self.to, Model::FORMAT))
    }

    fn output_mut(&mut self) -> Option<&mut Target> {
        Some(&mut self.to)
    }
}

/// Evaluates a dynamics model, shipped or from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEvaluate(pub String);

impl Execute for ModelEvaluate {
    syntax! {
        "model evaluate" "FILE|NAME" "evaluate a dynamics model on fresh launches and unseen scenes"
            => ModelEvaluate { 0: Text("a model") };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.evaluate_model(self)
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { awaits: Awaits::Work, ..InScripts::default() }
    }
}

/// Cancels the training or evaluation of a dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStop;

impl Execute for ModelStop {
    syntax! { "model stop" "" "end the training or evaluation of a model; a checkpoint is kept" => ModelStop {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.stop_model_work()
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, ..InScripts::default() }
    }
}
