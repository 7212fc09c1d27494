//! Commands for the settings of the next run.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::arguments::{Argument, Number, Parsed, Place, Text};
use super::{Execute, Verb, syntax};
use crate::dry_run::DryRun;
use crate::setup::Setup;
use crate::{Session, SessionError};
use mge_guidance::EpsilonSchedule;
use mge_trainer::{self as trainer, Control, PriorSource, RunConfig};

/// Sets the master seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Seed(pub u64);

impl Execute for Seed {
    syntax! { "seed" "N" "set the master seed of the next run" => Seed { 0: Number("seed") }; }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.seed = self.0;
        Ok(self.line())
    }
}

/// Chooses the algorithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Method(pub trainer::Method);

impl Execute for Method {
    syntax! { "method" "NAME" "choose the method of the next run" => Method { 0: Parsed("a method") }; }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config = setup.config.with_method(self.0);
        Ok(self.line())
    }
}

/// Sets the number of training episodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Episodes(pub u32);

impl Execute for Episodes {
    syntax! {
        "episodes" "N" "set the episodes of the next run, and of a shorter one that is continued"
            => Episodes { 0: Number("number of episodes") };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.set("episodes", &self.0.to_string())
    }
}

/// Sets the epsilon schedule of the next run and of the current training.
#[derive(Debug, Clone, PartialEq)]
pub struct Epsilon(pub EpsilonSchedule);

impl Execute for Epsilon {
    syntax! {
        "epsilon" "SPEC" "set the epsilon schedule; a running training takes it at its next episode"
            => Epsilon { 0: Parsed("a schedule") };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.epsilon = self.0.clone();
        setup.set.insert("epsilon".to_owned());
        Ok(self.line())
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let report = session.change(|setup| self.prepare(setup))?;
        let Some(run) = session.run_mut() else { return Ok(report) };
        if run.send(Control::SetSchedule(self.0.clone())).is_err() {
            return Ok(report);
        }
        let (has_prior, config) = (run.prior().is_some(), RunConfig::clone(run.config()));
        session.warn(&RunConfig { epsilon: self.0.clone(), ..config }, &BTreeSet::new());
        Ok(match has_prior {
            true => format!("{report}, from the next episode on"),
            false => format!("{report}; the run has no action clusters to draw from: compute them, then `guide`"),
        })
    }
}

/// Sets any setting of the next run by its JSON path.
#[derive(Debug, Clone, PartialEq)]
pub struct Set {
    /// The JSON path.
    pub key: String,
    /// JSON, or a string without quotes.
    pub value: String,
}

impl Execute for Set {
    syntax! {
        "set" "KEY VALUE" "set any setting by its JSON path, such as ddpg.critic_learning_rate 1e-4"
            => Set { key: Text("a key"), value: Text("a value") };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.set(&self.key, &self.value)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.set(&self.key, &self.value)
    }
}

/// Chooses the model that predicts the rollouts.
#[derive(Debug, Clone, PartialEq)]
pub struct Model(pub PriorSource);

impl Execute for Model {
    syntax! {
        "model" "learned|true|uniform|NAME|FILE" "choose what predicts the rollouts behind the clusters"
            => Model { 0: Text("a model") };
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.prior = self.0.clone().identified();
        setup.set.insert("prior".to_owned());
        Ok(format!("model {}", String::from(self.0.clone())))
    }
}

/// Chooses the folder for runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Out(pub PathBuf);

impl Execute for Out {
    syntax! { "out" "FOLDER" "choose the folder for runs" => Out { 0: Place("a folder") }; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.runs.folder.clone_from(&self.0);
        Ok(format!("runs go to {}", self.0.display()))
    }
}
