//! Commands that start, control, open and delete runs.

use std::path::{Path, PathBuf};

use super::arguments::{
    Argument, Changes, Index, Keyword, List, Number, Optional, OptionalUnless, Or, Parsed, Place, Rest, Within,
};
use super::{Awaits, DependsOn, Execute, InScripts, Verb, syntax};
use crate::dry_run::DryRun;
use crate::{Session, SessionError};
use mge_run::{CheckpointName, Notes, RunDirectory};
use mge_trainer::Control;

/// Commands that control the current run. The journal derives them from the run's state or event log.
const CONTROLS_RUN: InScripts = InScripts { unrecorded: true, depends_on: DependsOn::Nothing, awaits: Awaits::Nothing };

/// The number of episodes after which a run pauses.
const UNTIL: Keyword<Number> = Keyword("until", Number("number of episodes"));

/// Starts or queues a run with the current settings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Train {
    /// Its folder; None for a new one in the folder for runs. With several seeds, each run has a subfolder.
    pub folder: Option<PathBuf>,
    /// Number of runs, with consecutive seeds starting at the seed set; None for a single run.
    pub seeds: Option<u32>,
    /// Pause after this many episodes.
    pub until: Option<u32>,
}

impl Execute for Train {
    syntax! {
        "train" "[FOLDER] [seeds N] [until N]" "start a run, or queue it, or one for each of N seeds; `until` pauses there"
            => Train {
                folder: OptionalUnless(Place("a folder"), |word| ["seeds", "until"].contains(&word)),
                seeds: Keyword("seeds", Within("number of seeds", 1..=1000)), until: UNTIL
            };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        match self.seeds {
            None => session.train(self.folder.as_deref(), self.until),
            Some(seeds) => session.train_seeds(seeds, self.folder.as_deref(), self.until),
        }
    }

    fn in_scripts(&self) -> InScripts {
        // With several seeds, each run is recorded on its own.
        InScripts { unrecorded: self.seeds.is_some(), ..InScripts::default() }
    }

    fn check(&self, dry_run: &mut DryRun) -> Result<(), SessionError> {
        dry_run.check_settings()
    }
}

/// Pauses the current run.
#[derive(Debug, Clone, PartialEq)]
pub struct Pause;

impl Execute for Pause {
    syntax! { "pause" "" "pause the training; the key also resumes it" => Pause {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.send(Control::Pause, "pausing after this episode")
    }

    fn in_scripts(&self) -> InScripts {
        CONTROLS_RUN
    }
}

/// Resumes the paused run.
#[derive(Debug, Clone, PartialEq)]
pub struct Resume {
    /// Pause again after this many episodes in total.
    pub until: Option<u32>,
}

impl Execute for Resume {
    syntax! { "resume" "[until N]" "resume the paused run" => Resume { until: UNTIL }; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        let control = self.until.map_or(Control::Resume, |episode| Control::PauseAt(episode.into()));
        session.send(control, "resumed")
    }

    fn in_scripts(&self) -> InScripts {
        CONTROLS_RUN
    }
}

/// Stops the current run, keeping a checkpoint.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop;

impl Execute for Stop {
    syntax! { "stop" "" "end the training; a checkpoint is kept" => Stop {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.stop()
    }

    fn in_scripts(&self) -> InScripts {
        CONTROLS_RUN
    }
}

/// Opens a run on disk.
#[derive(Debug, Clone, PartialEq)]
pub struct Open(pub PathBuf);

impl Execute for Open {
    syntax! { "open" "FOLDER" "open a run that is on disk" => Open { 0: Place("a run's folder") }; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.open(self)
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { awaits: Awaits::Result, ..InScripts::default() }
    }
}

/// Makes another run of the session, numbered from 0, the current one.
#[derive(Debug, Clone, PartialEq)]
pub struct Watch(pub usize);

impl Execute for Watch {
    syntax! {
        "watch" "N" "act on run N, from 1 as they began; elsewhere `%N` stands for its folder" => Watch { 0: Index };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.watch(self.0)
    }
}

/// Continues a run from its checkpoint: the one in a folder, or the current one.
#[derive(Debug, Clone, PartialEq)]
pub struct Continue {
    /// Its folder; None for the current run.
    pub folder: Option<PathBuf>,
    /// Pause after this many episodes in total.
    pub until: Option<u32>,
}

impl Execute for Continue {
    syntax! {
        "continue" "[FOLDER] [until N]" "continue a run from its checkpoint"
            => Continue { folder: OptionalUnless(Place("a folder"), |word| word == "until"), until: UNTIL };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.continue_run(self)
    }

    fn in_scripts(&self) -> InScripts {
        let depends_on = if self.folder.is_none() { DependsOn::Run } else { DependsOn::Nothing };
        InScripts { depends_on, awaits: Awaits::Result, ..InScripts::default() }
    }
}

/// Creates and trains a run that branches off the current one at an episode, with other settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Fork {
    /// Number of episodes of the current run that the new one shares.
    pub episode: u32,
    /// Settings to change, and their values.
    pub changes: Vec<(String, String)>,
    /// The new run's folder; None for a new one in the folder for runs.
    pub folder: Option<PathBuf>,
    /// Pause after this many episodes.
    pub until: Option<u32>,
}

impl Execute for Fork {
    syntax! {
        "fork" "EPISODE [KEY=VALUE]... [in FOLDER] [until N]" "train a new run from an episode of the watched one, with other settings"
            => Fork {
                episode: Number("number of episodes"), changes: Changes, folder: Keyword("in", Place("a folder")), until: UNTIL
            };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.fork(self)
    }

    fn in_scripts(&self) -> InScripts {
        // It is recorded once the new run has its number.
        InScripts { unrecorded: true, awaits: Awaits::Result, ..InScripts::default() }
    }
}

/// Moves a run, with all its files, to the trash beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Delete(pub PathBuf);

impl Execute for Delete {
    syntax! {
        "delete" "FOLDER" "move a run, with all its files, to the trash beside it; the key asks first"
            => Delete { 0: Place("a run's folder") };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.delete(self)
    }
}

/// Brings back the run deleted from a folder, or else the run deleted last.
#[derive(Debug, Clone, PartialEq)]
pub struct Restore(pub Option<PathBuf>);

impl Execute for Restore {
    syntax! {
        "restore" "[FOLDER]" "bring back the run deleted last, or the one deleted from a folder"
            => Restore { 0: Optional(Place("a run's folder")) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.restore(self.0.as_deref())
    }
}

/// Removes the runs in the trash of a folder of runs for good.
#[derive(Debug, Clone, PartialEq)]
pub struct EmptyTrash(pub Option<PathBuf>);

impl Execute for EmptyTrash {
    syntax! {
        "empty-trash" "[FOLDER]" "remove the deleted runs of the folder for runs, or of another one, for good"
            => EmptyTrash { 0: Optional(Place("a folder of runs")) };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.empty_trash(self.0.as_deref())
    }
}

/// Plays the greedy policy of the current run.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluate;

impl Execute for Evaluate {
    syntax! { "evaluate" "" "play the greedy policy of the watched run" => Evaluate {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.evaluate()
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { depends_on: DependsOn::Checkpoint, awaits: Awaits::Result, ..InScripts::default() }
    }
}

/// Chooses the checkpoint of the current run whose agent plays.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint(pub CheckpointName);

impl Execute for Checkpoint {
    syntax! {
        "checkpoint" "last|best|EPISODE" "choose the checkpoint whose agent `evaluate` and `figure episode` play"
            => Checkpoint { 0: Parsed("a checkpoint") };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.choose_checkpoint(self.0)
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { depends_on: DependsOn::Checkpoint, ..InScripts::default() }
    }
}

/// Replaces the note on a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// The run's folder.
    pub folder: PathBuf,
    /// The note; empty removes it.
    pub text: String,
}

impl Execute for Note {
    syntax! {
        "note" "FOLDER TEXT" "write a note on a run, kept in its folder; an empty text removes it"
            => Note { folder: Place("a run's folder"), text: Rest("a text") };
    }

    fn execute(&self, _: &mut Session) -> Result<String, SessionError> {
        annotate(&self.folder, |notes| notes.note.clone_from(&self.text))
    }
}

/// Replaces the tags of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Tag {
    /// The run's folder.
    pub folder: PathBuf,
    /// The tags; empty removes all.
    pub tags: Vec<String>,
}

impl Execute for Tag {
    syntax! {
        "tag" "FOLDER [TAG,..]" "give a run tags to find it by, kept in its folder"
            => Tag { folder: Place("a run's folder"), tags: Or(List("tags"), Vec::new()) };
    }

    fn execute(&self, _: &mut Session) -> Result<String, SessionError> {
        annotate(&self.folder, |notes| notes.tags.clone_from(&self.tags))
    }
}

/// Changes the notes in the folder of a run.
fn annotate(folder: &Path, change: impl FnOnce(&mut Notes)) -> Result<String, SessionError> {
    let directory = RunDirectory::open(folder)?;
    directory.change_notes(change)?;
    Ok(format!("noted in {}", directory.notes_path().display()))
}
