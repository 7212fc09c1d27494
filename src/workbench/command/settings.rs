//! The settings of the next run.

use std::path::PathBuf;

use super::arguments::{quoted, quoted_path};
use super::{Execute, Recording, Verb};
use crate::guidance::{EpsilonSchedule, ScheduleError};
use crate::trainer::{self, Control, PriorSource};
use crate::workbench::setup::Setup;
use crate::workbench::{Session, SessionError};

/// Sets the master seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Seed(pub u64);

impl Execute for Seed {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "seed",
            "N",
            "set the master seed of the next run",
            |args| Ok(Self(args.number("seed")?).into()),
        )]
    }

    fn arguments(&self) -> String {
        format!(" {}", self.0)
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.seed = self.0;
        Ok(format!("seed {}", self.0))
    }
}

/// Chooses the algorithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Method(pub trainer::Method);

impl Execute for Method {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("method", "NAME", "choose the method of the next run", |args| {
            Ok(Self(args.word("a method")?.parse()?).into())
        })]
    }

    fn arguments(&self) -> String {
        format!(" {}", self.0)
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config = setup.config.with_method(self.0);
        Ok(format!("method {}", self.0))
    }
}

/// Sets the number of training episodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Episodes(pub u32);

impl Execute for Episodes {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("episodes", "N", "set the number of episodes of the next run", |args| {
            Ok(Self(args.number("number of episodes")?).into())
        })]
    }

    fn arguments(&self) -> String {
        format!(" {}", self.0)
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.set("episodes", &self.0.to_string())
    }
}

/// Sets the epsilon schedule, of the next run and of the one that is being trained.
#[derive(Debug, Clone, PartialEq)]
pub struct Epsilon(pub EpsilonSchedule);

impl Execute for Epsilon {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "epsilon",
            "SPEC",
            "set the epsilon schedule; a running training takes it at its next episode",
            |args| {
                let schedule = args.word("a schedule")?.parse();
                Ok(Self(schedule.map_err(|error: ScheduleError| error.to_string())?).into())
            },
        )]
    }

    fn arguments(&self) -> String {
        format!(" {}", self.0)
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.epsilon = self.0.clone();
        Ok(format!("epsilon {}", self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let report = session.change(|setup| self.prepare(setup))?;
        let Some(run) = session.run_mut() else { return Ok(report) };
        if run.send(Control::SetSchedule(self.0.clone())).is_err() {
            return Ok(report);
        }
        Ok(match run.prior() {
            Some(_) => format!("{report}, from the next episode on"),
            None => format!("{report}; the run has no action clusters to draw from: compute them, then `guide`"),
        })
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::WhenEffective
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}

/// Sets any setting of the next run by its JSON path.
#[derive(Debug, Clone, PartialEq)]
pub struct Set {
    /// The JSON path.
    pub key: String,
    /// JSON, or a text without quotes.
    pub value: String,
}

impl Execute for Set {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "set",
            "KEY VALUE",
            "set any setting by its JSON path, such as ddpg.critic_learning_rate 1e-4",
            |args| {
                let (key, value) = (args.word("a key")?.to_owned(), args.word("a value")?.to_owned());
                Ok(Self { key, value }.into())
            },
        )]
    }

    fn arguments(&self) -> String {
        format!(" {} {}", quoted(&self.key), quoted(&self.value))
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.set(&self.key, &self.value)
    }
}

/// Chooses what predicts the rollouts.
#[derive(Debug, Clone, PartialEq)]
pub struct Model(pub PriorSource);

impl Execute for Model {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "model",
            "learned|true|uniform|NAME|FILE",
            "choose what predicts the rollouts behind the clusters",
            |args| Ok(Self(PriorSource::from(args.word("a model")?.to_owned())).into()),
        )]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted(&String::from(self.0.clone())))
    }

    fn prepare(&self, setup: &mut Setup) -> Result<String, SessionError> {
        setup.config.prior = self.0.clone();
        Ok(format!("model {}", String::from(self.0.clone())))
    }
}

/// Chooses the folder for runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Out(pub PathBuf);

impl Execute for Out {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("out", "FOLDER", "choose the folder for runs", |args| Ok(Self(args.path("a folder")?).into()))]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted_path(&self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.folder.clone_from(&self.0);
        Ok(format!("runs go to {}", self.0.display()))
    }
}
