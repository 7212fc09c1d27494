//! Commands for the settings of the next run.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::arguments::{Argument, Named, Number, Parsed, Place, Text, Words};
use super::{Command, Execute, Verb, command};
use crate::setup::Setup;
use crate::{Session, SessionError};
use mge_guidance::EpsilonSchedule;
use mge_trainer::{self as trainer, Control, PriorSource, RunConfig};

command! {
    /// Sets the master seed.
    Seed(seed: u64 = Number("seed")): "seed" "N" "set the master seed of the next run";
    prepare = |this, setup| {
        setup.config.seed = this.0;
        Ok(this.line())
    };
}

command! {
    /// Chooses the algorithm.
    Method(method: trainer::Method = Parsed("a method")): "method" "NAME" "choose the method of the next run";
    prepare = |this, setup| {
        setup.config = setup.config.with_method(this.0);
        Ok(this.line())
    };
}

command! {
    /// Sets the number of training episodes.
    Episodes(episodes: u32 = Number("number of episodes")):
        "episodes" "N" "set the episodes of the next run, and of a shorter one that is continued";
    prepare = |this, setup| {
        let report = setup.set("episodes", &this.0.to_string())?;
        setup.extends_to = Some(this.0);
        Ok(report)
    };
}

command! {
    /// Sets the epsilon schedule of the next run and of the current training.
    Epsilon(schedule: EpsilonSchedule = Parsed("a schedule")):
        "epsilon" "SPEC" "set the epsilon schedule; a running training takes it at its next episode";
    prepare = |this, setup| {
        setup.config.epsilon = this.0.clone();
        setup.set.insert("epsilon".to_owned());
        Ok(this.line())
    };
    execute = |this, session| {
        let report = session.change(|setup| this.prepare(setup))?;
        let Some(run) = session.run_mut() else { return Ok(report) };
        if run.send(Control::SetSchedule { schedule: this.0.clone() }).is_err() {
            return Ok(report);
        }
        let (has_prior, name, config) = (run.prior().is_some(), run.name.clone(), RunConfig::clone(run.config()));
        session.warn(&RunConfig { epsilon: this.0.clone(), ..config }, &BTreeSet::new());
        Ok(match has_prior {
            true => format!("{report} of {name}, from the next episode on, and of the runs started next"),
            false => format!("{report} of {name} and the runs started next; it has no action clusters to draw from: compute them, then `guide`"),
        })
    };
}

command! {
    /// Sets any setting of the next run by its JSON path.
    Set {
        /// The JSON path.
        key: String = Text("a key"),
        /// JSON, or a string without quotes.
        value: String = Text("a value"),
    }: "set" "KEY VALUE" "set any setting by its JSON path, such as ddpg.critic_learning_rate 1e-4";
    prepare = |this, setup| setup.set(&this.key, &this.value);
}

command! {
    /// Chooses the model that predicts the rollouts.
    Model(model: PriorSource = Text("a model")):
        "model" "trained|learned|true|rapier|uniform|NAME|FILE" "choose what predicts the rollouts behind the clusters";
    prepare = |this, setup| {
        setup.config.prior = this.0.clone().identified();
        setup.set.insert("prior".to_owned());
        Ok(format!("model {}", String::from(this.0.clone())))
    };
    execute = |this, session| {
        check_file(&this.0)?;
        session.change(|setup| this.prepare(setup))
    };
    check = |this, setup| check_file(&this.0).and_then(|()| this.prepare(setup).map(drop));
}

/// Checks that there is a model, if it is named or in a file.
fn check_file(source: &PriorSource) -> Result<(), SessionError> {
    let PriorSource::ModelFile(file) = source else { return Ok(()) };
    Ok(file.load().map(drop).map_err(|error| error.to_string())?)
}

command! {
    /// Chooses the folder for runs.
    Out(folder: PathBuf = Place("a folder", false)): "out" "FOLDER" "choose the folder for runs";
    prepare = |this, setup| {
        setup.folder.clone_from(&this.0);
        Ok(format!("runs go to {}", this.0.display()))
    };
}
