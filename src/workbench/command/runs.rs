//! Runs: begun, steered, opened, deleted.

use std::path::PathBuf;

use super::arguments::{optional, quoted_path, until};
use super::{Awaits, Execute, Recording, Verb};
use crate::trainer::Control;
use crate::workbench::dry_run::DryRun;
use crate::workbench::{Session, SessionError};

/// Starts a run with the settings of the next run, or queues it.
#[derive(Debug, Clone, PartialEq)]
pub struct Train {
    /// Its folder; without one, a new one in the folder for runs.
    pub folder: Option<PathBuf>,
    /// Pause after so many episodes.
    pub until: Option<u32>,
}

impl Execute for Train {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "train",
            "[FOLDER] [until N]",
            "start a run with the settings shown, or queue it; `until` pauses it there",
            |args| {
                let folder = if args.peek() == Some("until") { None } else { args.optional_path() };
                Ok(Self { folder, until: args.until()? }.into())
            },
        )]
    }

    fn arguments(&self) -> String {
        format!("{}{}", optional(self.folder.as_deref().map(quoted_path)), until(self.until))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.train(self.folder.as_deref(), self.until)
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.check_settings()
    }
}

/// Pauses the current run.
#[derive(Debug, Clone, PartialEq)]
pub struct Pause;

impl Execute for Pause {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("pause", "", "pause the training; the key also goes on with it", |_| Ok(Self.into()))]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.send(Control::Pause, "pausing after this episode")
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}

/// Goes on with the paused run.
#[derive(Debug, Clone, PartialEq)]
pub struct Resume {
    /// Pause again after so many episodes in all.
    pub until: Option<u32>,
}

impl Execute for Resume {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("resume", "[until N]", "go on with the paused run", |args| {
            Ok(Self { until: args.until()? }.into())
        })]
    }

    fn arguments(&self) -> String {
        until(self.until)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let done = session.run().ok_or(SessionError::NoRun)?.records().len() as u32;
        let control = match self.until {
            Some(episode) => Control::Advance(episode.saturating_sub(done)),
            None => Control::Resume,
        };
        session.send(control, "going on")
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}

/// Ends the current run; a checkpoint is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop;

impl Execute for Stop {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("stop", "", "end the training; a checkpoint is kept", |_| Ok(Self.into()))]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.stop()
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::WhenEffective
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}

/// Opens a run that is on disk.
#[derive(Debug, Clone, PartialEq)]
pub struct Open(pub PathBuf);

impl Execute for Open {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("open", "FOLDER", "open a run that is on disk", |args| {
            Ok(Self(args.path("a run's folder")?).into())
        })]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted_path(&self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.open(self)
    }

    /// A run of the session may be in another folder when the script is played.
    fn recording(&self, session: &Session) -> Recording {
        session.number_of(&self.0).map_or(Recording::Now, |number| Recording::As(Watch(number).into()))
    }

    fn awaits(&self) -> Awaits {
        Awaits::Result
    }
}

/// Acts on another run of the session, numbered from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Watch(pub usize);

impl Execute for Watch {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("watch", "N", "act on run N of the session, counted from 1 in the order they began", |args| {
            Ok(Self(args.index()?).into())
        })]
    }

    fn arguments(&self) -> String {
        format!(" {}", self.0 + 1)
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.watch(self.0)
    }
}

/// Goes on with a run from its checkpoint: the one in a folder, or the current one.
#[derive(Debug, Clone, PartialEq)]
pub struct Continue(pub Option<PathBuf>);

impl Execute for Continue {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("continue", "[FOLDER]", "go on with a run from its checkpoint", |args| {
            Ok(Self(args.optional_path()).into())
        })]
    }

    fn arguments(&self) -> String {
        optional(self.0.as_deref().map(quoted_path))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.continue_run(self)
    }

    fn awaits(&self) -> Awaits {
        Awaits::Result
    }

    fn acts_on_run(&self) -> bool {
        self.0.is_none()
    }

    fn begins_work(&self) -> bool {
        true
    }
}

/// Deletes a run from the disk, with all its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Delete(pub PathBuf);

impl Execute for Delete {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new(
            "delete",
            "FOLDER",
            "delete a run from the disk, with all its files; the key asks first",
            |args| Ok(Self(args.path("a run's folder")?).into()),
        )]
    }

    fn arguments(&self) -> String {
        format!(" {}", quoted_path(&self.0))
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.delete(self)
    }

    fn awaits(&self) -> Awaits {
        Awaits::Result
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::Never
    }
}

/// Plays the greedy policy of the current run.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluate;

impl Execute for Evaluate {
    fn verbs() -> Vec<Verb> {
        vec![Verb::new("evaluate", "", "play the greedy policy of the watched run", |_| Ok(Self.into()))]
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.evaluate()
    }

    fn recording(&self, _session: &Session) -> Recording {
        Recording::AtEpisode
    }

    fn awaits(&self) -> Awaits {
        Awaits::Result
    }

    fn acts_on_run(&self) -> bool {
        true
    }
}
