//! Commands that start, control, open and delete runs.

use std::path::{Path, PathBuf};

use super::arguments::{
    Argument, Changes, Index, Keyword, Named, Number, Optional, Parsed, Place, RUN, Rest, RunFolders, Within, Words,
    optional,
};
use super::{Command, DependsOn, Execute, ScriptRole, Verb, WaitFor, command};
use crate::runs::folder_of_seed;
use crate::setup::Setup;
use crate::{Session, SessionError};
use mge_run::{CheckpointName, RunDirectory, RunError};
use mge_trainer::Control;

/// Commands that control the current run. The journal derives them from the run's state or event log.
const CONTROLS: ScriptRole = ScriptRole { unrecorded: true, depends_on: DependsOn::Nothing, awaits: WaitFor::Nothing };

/// The number of episodes after which a run pauses.
const UNTIL: Keyword<Number> = Keyword("until", Number("number of episodes"));

command! {
    /// Starts or queues a run with the current settings.
    #[derive(Default)]
    Train {
        /// Its folder: a name alone is that of one in the folder for runs, as is one that is not given. With several
        /// seeds, `-seedN` is appended to its name.
        folder: Option<PathBuf> = Optional(Place("a folder", false), |word| ["seeds", "until"].contains(&word)),
        /// Number of runs, with consecutive seeds starting at the seed set; None for a single run.
        seeds: Option<u32> = Keyword("seeds", Within("number of seeds", 1..=1000)),
        /// Pause after this many episodes.
        until: Option<u32> = UNTIL,
    }: "train" "[FOLDER] [seeds N] [until N]" "start a run, or queue it, or one for each of N seeds; alone it opens a dialog";
    execute = |this, session| match this.seeds {
        None => session.train(this.folder.as_deref(), this.until),
        Some(seeds) => session.train_seeds(seeds, this.folder.as_deref(), this.until),
    };
    check = |_, setup| setup.check();
    // With several seeds, each run is recorded on its own.
    script_role = |this| ScriptRole { unrecorded: this.seeds.is_some(), ..ScriptRole::default() };
}

command! {
    /// Pauses the current run.
    Pause: "pause" "" "pause the training; the key also resumes it";
    execute = |_, session| session.send(Control::Pause, "pausing {run} after this episode");
    script_role = |_| CONTROLS;
}

command! {
    /// Resumes the paused run.
    Resume {
        /// Pause again after this many episodes in total.
        until: Option<u32> = UNTIL,
    }: "resume" "[until N]" "resume the paused run; `until N` pauses it again after episode N";
    execute = |this, session| {
        let control = this.until.map_or(Control::Resume, |episode| Control::PauseAt(episode.into()));
        session.send(control, "resumed {run}")
    };
    script_role = |_| CONTROLS;
}

command! {
    /// Stops the current run, keeping a checkpoint.
    Stop: "stop" "" "end the training; a checkpoint is kept";
    execute = |_, session| session.stop();
    script_role = |_| CONTROLS;
}

command! {
    /// Opens a run on disk.
    Open(folder: PathBuf = RUN): "open" "FOLDER" "open a run that is on disk";
    execute = |this, session| session.open(this);
    script_role = |_| ScriptRole { awaits: WaitFor::Result, ..ScriptRole::default() };
}

command! {
    /// Makes another run of the session, numbered from 0, the current one.
    Watch(number: usize = Index):
        "watch" "N" "act on run N, from 1 as they began; elsewhere `%N` stands for its folder";
    execute = |this, session| session.watch(this.0);
}

command! {
    /// Continues a run from its checkpoint: the one in a folder, or the current one.
    Continue {
        /// Its folder; None for the current run.
        folder: Option<PathBuf> = Optional(RUN, |word| word == "until"),
        /// Pause after this many episodes in total.
        until: Option<u32> = UNTIL,
    }: "continue" "[FOLDER] [until N]" "continue a run from its checkpoint; `until N` pauses it after episode N";
    execute = |this, session| session.continue_run(this);
    script_role = |this| {
        let depends_on = if this.folder.is_none() { DependsOn::Run } else { DependsOn::Nothing };
        ScriptRole { depends_on, awaits: WaitFor::Result, ..ScriptRole::default() }
    };
}

command! {
    /// Creates and trains a run that branches off the current one at an episode, with other settings.
    Fork {
        /// Number of episodes of the current run that the new one shares.
        episode: u32 = Number("number of episodes"),
        /// Settings to change, and their values.
        changes: Vec<(String, String)> = Changes,
        /// The new run's folder; a name alone is that of one in the folder for runs.
        folder: Option<PathBuf> = Keyword("in", Place("a folder", false)),
        /// Pause after this many episodes.
        until: Option<u32> = UNTIL,
    }: "fork" "EPISODE [KEY=VALUE]... [in NAME] [until N]" "train a new run from an episode of a run, with other settings";
    execute = |this, session| session.fork(this);
    // It is recorded once the new run has its number.
    script_role = |_| ScriptRole { unrecorded: true, awaits: WaitFor::Result, ..ScriptRole::default() };
}

command! {
    /// Moves runs, with all their files, to the trash beside them.
    Delete(folders: Vec<PathBuf> = RunFolders):
        "delete" "FOLDER..." "move runs, with all their files, to the trash beside them; the key asks first";
    execute = |this, session| session.delete(this);
}

command! {
    /// Brings back the run deleted from a folder, or else those of the last deletion.
    Restore(folder: Option<PathBuf> = optional(RUN)):
        "restore" "[FOLDER]" "bring back what was deleted last, or the run deleted from a folder";
    execute = |this, session| session.restore(this.0.as_deref());
}

command! {
    /// Removes the runs in the trash of a folder of runs for good.
    EmptyTrash(folder: Option<PathBuf> = optional(Place("a folder of runs", false))):
        "empty-trash" "[FOLDER]" "remove the deleted runs of the folder for runs, or of another one, for good";
    execute = |this, session| session.empty_trash(this.0.as_deref());
}

command! {
    /// Plays the greedy policy of the current run.
    Evaluate: "evaluate" "" "play the greedy policy of the watched run, or on Runs of the selected one";
    execute = |_, session| session.evaluate();
    script_role = |_| ScriptRole { depends_on: DependsOn::Checkpoint, awaits: WaitFor::Result, ..ScriptRole::default() };
}

command! {
    /// Chooses the checkpoint of the current run whose agent plays.
    Checkpoint(name: CheckpointName = Parsed("a checkpoint")):
        "checkpoint" "last|best|EPISODE" "choose the checkpoint whose agent `evaluate` plays";
    execute = |this, session| session.choose_checkpoint(this.0);
    script_role = |_| ScriptRole { depends_on: DependsOn::Checkpoint, ..ScriptRole::default() };
}

command! {
    /// Replaces the note on a run.
    Note {
        /// The run's folder.
        folder: PathBuf = RUN,
        /// The note; empty removes it.
        text: String = Rest("a text"),
    }: "note" "FOLDER TEXT" "write a note on a run, kept in its folder; an empty text removes it";
    execute = |this, _| {
        let directory = RunDirectory::open(&this.folder)?;
        directory.change_notes(|notes| notes.note.clone_from(&this.text))?;
        Ok(format!("noted in {}", directory.notes_path().display()))
    };
}

command! {
    /// Gives a run another name.
    Rename {
        /// The run's folder.
        folder: PathBuf = RUN,
        /// The name; empty for that of its folder.
        name: String = Rest("a name"),
    }: "rename" "RUN NAME" "give a run another name; '' gives it that of its folder";
    execute = |this, session| session.rename(&this.folder, &this.name);
}

impl Command {
    /// Checks that the folders that it names for new runs are free.
    ///
    /// # Errors
    /// The first that is not.
    pub(crate) fn check_room(&self, setup: &Setup) -> Result<(), RunError> {
        let (folder, seeds) = match self {
            Self::Train(Train { folder: Some(folder), seeds, .. }) => (folder, *seeds),
            Self::Fork(Fork { folder: Some(folder), .. }) => (folder, None),
            _ => return Ok(()),
        };
        let check = |folder: &Path| RunDirectory::at(&setup.place(folder)).check_room();
        let Some(count) = seeds else { return check(folder) };
        let first = setup.config.seed;
        (first..first.saturating_add(count.into())).try_for_each(|seed| check(&folder_of_seed(folder, seed)))
    }
}
