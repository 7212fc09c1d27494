//! The action clusters.

use std::path::{Path, PathBuf};

use super::arguments::{optional, quoted_path};
use super::{Awaits, Execute, Recording, Verb};
use crate::trainer::Control;
use crate::workbench::{Session, SessionError};

/// Computes the action clusters of the task anew, and saves them to a file if one is named.
#[derive(Debug, Clone, PartialEq)]
pub struct Clusters(pub Option<PathBuf>);

impl Execute for Clusters {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "clusters",
            "[FILE]",
            "compute the action clusters of the task anew, and save them to a file",
            |args| Ok(Self(args.optional_path()).into()),
        )]
    }

    fn arguments(&self) -> String {
        optional(self.0.as_deref().map(quoted_path))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.compute_clusters(self)
    }

    fn begins_work(&self) -> bool {
        self.0.is_none()
    }

    /// A file that is named is there when the next line is carried out.
    fn awaits(&self) -> Awaits {
        if self.0.is_some() { Awaits::Everything } else { Awaits::Nothing }
    }

    fn overwrites(&self) -> Option<&Path> {
        self.0.as_deref()
    }
}

/// Gives the action clusters to the running training.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide;

impl Execute for Guide {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("guide", "", "give the action clusters to the running training", |_| Ok(Self.into()))]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let prior = session.prior().ok_or(SessionError::NoClusters)?.clone();
        let run = session.run_mut().ok_or(SessionError::NoRun)?;
        let (there, here) = (run.config().task.subgoals.len(), prior.stages.len() - 1);
        if there != here {
            let message = format!("the clusters are for {here} subgoals, but the run's task has {there}");
            return Err(SessionError::Failed(message));
        }
        run.send(Control::SetPrior(prior))?;
        Ok("the training takes the clusters at its next episode".to_owned())
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::WhenEffective
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}
