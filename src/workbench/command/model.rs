//! Dynamics models, trained and measured in the background.

use std::path::{Path, PathBuf};

use super::arguments::{optional, quoted, quoted_path};
use super::{Execute, Recording, Verb};
use crate::physics::ToolKind;
use crate::workbench::dry_run::DryRun;
use crate::workbench::{Session, SessionError};

/// Trains a dynamics model of a tool set into a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelTrain {
    /// The tool types it learns.
    pub tools: Vec<ToolKind>,
    /// The file.
    pub path: PathBuf,
    /// Epochs, if not the usual number.
    pub epochs: Option<u32>,
}

impl Execute for ModelTrain {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "model train",
            "TYPE,... FILE [EPOCHS]",
            "train a dynamics model of these tool types, in the background",
            |args| {
                let tools = args.word("tool types")?.split(',').map(str::parse).collect::<Result<_, String>>()?;
                let (path, epochs) = (args.path("a file")?, args.optional_number("number of epochs")?);
                Ok(Self { tools, path, epochs }.into())
            },
        )]
    }

    fn arguments(&self) -> String {
        let tools = self.tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        format!(" {tools} {}{}", quoted_path(&self.path), optional(self.epochs))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.train_model(self)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.writes(Some(&self.path));
        Ok(())
    }

    fn begins_work(&self) -> bool {
        true
    }

    fn overwrites(&self) -> Option<&Path> {
        Some(&self.path)
    }
}

/// Measures a shipped dynamics model or one in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEvaluate(pub String);

impl Execute for ModelEvaluate {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "model evaluate",
            "FILE|NAME",
            "measure a dynamics model on fresh launches and unseen scenes",
            |args| Ok(Self(args.word("a model")?.to_owned()).into()),
        )]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted(&self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.evaluate_model(self)
    }

    fn begins_work(&self) -> bool {
        true
    }
}

/// Ends the training or evaluation of a dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStop;

impl Execute for ModelStop {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("model stop", "", "end the training or evaluation of a model; nothing of it is kept", |_| {
            Ok(Self.into())
        })]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.stop_model_work()
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }
}
