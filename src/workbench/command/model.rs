//! Dynamics models, trained and measured in the background.

use std::path::{Path, PathBuf};

use super::words::{Maybe, Number, Parsed, Place, Text, Word};
use super::{Execute, InScripts, Recording, Verb, syntax};
use crate::dynamics::ToolSet;
use crate::workbench::dry_run::DryRun;
use crate::workbench::{Session, SessionError};

/// Trains a dynamics model of a tool set into a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelTrain {
    /// The tools it learns.
    pub tools: ToolSet,
    /// The file.
    pub path: PathBuf,
    /// Epochs, if not the usual number.
    pub epochs: Option<u32>,
}

impl Execute for ModelTrain {
    syntax! {
        "model train" "TYPE,... FILE [EPOCHS]" "train a dynamics model of these tool types, in the background"
            => ModelTrain { tools: Parsed("tool types"), path: Place("a file"), epochs: Maybe(Number("number of epochs")) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.train_model(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(Some(&self.path));
        Ok(())
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { begins_work: true, ..InScripts::default() }
    }

    fn overwrites(&self) -> Option<&Path> {
        Some(&self.path)
    }
}

/// Measures a shipped dynamics model or one in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEvaluate(pub String);

impl Execute for ModelEvaluate {
    syntax! {
        "model evaluate" "FILE|NAME" "measure a dynamics model on fresh launches and unseen scenes"
            => ModelEvaluate { 0: Text("a model") };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.evaluate_model(self)
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { begins_work: true, ..InScripts::default() }
    }
}

/// Ends the training or evaluation of a dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStop;

impl Execute for ModelStop {
    syntax! { "model stop" "" "end the training or evaluation of a model; nothing of it is kept" => ModelStop {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.stop_model_work()
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { recording: Recording::Never, ..InScripts::default() }
    }
}
