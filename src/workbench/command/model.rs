//! Dynamics models, trained and measured in the background.

use std::fmt;
use std::path::{Path, PathBuf};

use super::arguments::{optional, quoted, quoted_path};
use super::{Execute, Recording, Verb};
use crate::physics::ToolKind;
use crate::workbench::dry_run::DryRun;
use crate::workbench::model_job::ModelJob;
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
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "model train",
            arguments: "TYPE,... FILE [EPOCHS]",
            help: "train a dynamics model of these tool types, in the background",
            read: |args| {
                let tools = args.word("tool types")?.split(',').map(str::parse).collect::<Result<_, String>>()?;
                let (path, epochs) = (args.path("a file")?, args.optional_number("number of epochs")?);
                Ok(Self { tools, path, epochs }.into())
            },
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tools = self.tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        write!(f, "model train {tools} {}{}", quoted_path(&self.path), optional(self.epochs))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let job = ModelJob::train(&self.tools, &self.path, self.epochs, session.config().seed);
        session.begin_model_job(job)
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
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "model evaluate",
            arguments: "FILE|NAME",
            help: "measure a dynamics model on fresh launches and unseen scenes",
            read: |args| Ok(Self(args.word("a model")?.to_owned()).into()),
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "model evaluate {}", quoted(&self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let job = ModelJob::evaluate(&self.0, session.config().seed);
        session.begin_model_job(job)
    }

    fn begins_work(&self) -> bool {
        true
    }
}

/// Ends the training or evaluation of a dynamics model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStop;

impl Execute for ModelStop {
    fn verbs() -> &'static [Verb] {
        &[Verb {
            name: "model stop",
            arguments: "",
            help: "end the training or evaluation of a model; nothing of it is kept",
            read: |_| Ok(Self.into()),
        }]
    }

    fn write(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("model stop")
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.end_model_job()
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }
}
