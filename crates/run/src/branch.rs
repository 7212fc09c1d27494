//! A new run that starts from the state of another run after some of its episodes.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::checkpoint::Checkpoint;
use super::event::{Event, LoggedEvent};
use super::log::KeptLog;
use super::projection::Projections;
use super::retention::CheckpointName;
use super::{Result, RunDirectory, RunError, episodes, folder};
use mge_base::atomic::{self, NewFolder, parent_of, remove_leftovers};

/// The folder of a run that is being created from another. It is moved to its place when it is complete, and
/// removed if dropped before.
#[derive(Debug)]
pub struct Branch {
    filled: NewFolder,
    directory: RunDirectory,
    place: PathBuf,
    episode: u64,
    /// The events so far.
    events: Vec<LoggedEvent>,
}

impl Branch {
    /// Begins a run in `place`, a folder that is empty or does not exist yet, with the logs of `source` as
    /// they were after `episode` episodes.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`]; [`RunError::NotEmpty`]; [`RunError::LogTooShort`] if the run has fewer episodes;
    /// [`RunError::Io`].
    pub fn new(source: &RunDirectory, place: &Path, episode: u64) -> Result<Self> {
        RunDirectory::at(place).check_room()?;
        remove_leftovers(parent_of(place));
        let filled = folder::new_beside(place)?;
        let directory = RunDirectory::at(filled.path());
        let kept = KeptLog::read(&source.events_path(), episode)?;
        let episodes = episodes::read_until(&source.episodes_path(), episode)?;
        for (path, bytes) in [(directory.events_path(), &kept.bytes), (directory.episodes_path(), &episodes)] {
            atomic::write(&path, bytes).map_err(RunError::io("write", &path))?;
        }
        let best = source.checkpoints();
        if best.episode_of(CheckpointName::Best).is_some_and(|best| best <= episode) {
            let best = best.load(CheckpointName::Best)?;
            directory.checkpoints().save(&[CheckpointName::Best], None, &best)?;
        }
        Ok(Self { filled, directory, place: place.to_owned(), episode, events: kept.events })
    }

    /// The events so far, which are those of the other run.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.events.iter().map(|logged| &logged.event)
    }

    /// Writes the configuration, the file of its model, if given, and the checkpoint from which the run continues, both
    /// as `last` and as `episode-N`, and moves the run to its place.
    ///
    /// # Errors
    /// [`RunError::Io`]; then nothing remains.
    pub fn finish(
        self,
        config: &impl Serialize,
        model: Option<&[u8]>,
        checkpoint: &Checkpoint,
    ) -> Result<RunDirectory> {
        let Self { filled, directory, place, episode, events } = self;
        let names = [CheckpointName::Last, CheckpointName::Episode(episode)];
        directory.checkpoints().save(&names, None, checkpoint)?;
        directory.write_config(config, model)?;
        Projections::open(&directory, &events)?.sync()?;
        folder::sync(filled.path())?;
        // Any folder there is empty; not every system can rename over it.
        let _ = fs::remove_dir(&place);
        filled.rename(&place).map_err(RunError::io("create", &place))?;
        folder::sync(parent_of(&place))?;
        Ok(RunDirectory::at(&place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EpisodeRecord, Event, PlayedEpisode, RunHistory, RunWriter, read_events};

    #[test]
    fn a_branch_has_the_first_episodes_of_the_other_and_its_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let source = RunDirectory::create(folder.path().join("a"), &"config").unwrap();
        let mut writer = RunWriter::open(&source, 0).unwrap();
        for episode in 1..=9 {
            writer.record(&Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() })).unwrap();
            writer.record_actions(&PlayedEpisode { episode, ..Default::default() }).unwrap();
        }
        let place = folder.path().join("b");
        let short = Branch::new(&source, &place, 10);
        assert!(
            matches!(&short, Err(RunError::LogTooShort { path, .. }) if *path == source.events_path()),
            "{short:?}"
        );
        assert!(matches!(Branch::new(&source, source.path(), 4), Err(RunError::AlreadyARun(_))));
        drop(Branch::new(&source, &place, 4).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "an abandoned branch leaves nothing behind");
        let branch = Branch::new(&source, &place, 4).unwrap();
        let made = branch.finish(&"other", None, &Checkpoint::new(4)).unwrap();
        assert_eq!(RunHistory::read(&made).unwrap().records.len(), 4);
        assert_eq!(read_events(&made.events_path()).unwrap().len(), 4);
        assert_eq!(made.config::<String>().unwrap(), "other");
        let (checkpoint, problems) = made.newest_checkpoint().unwrap();
        assert_eq!((checkpoint.unwrap().episode, problems.len()), (4, 0));
        RunWriter::open(&made, 4).unwrap();
        assert_eq!(RunHistory::read(&source).unwrap().records.len(), 9, "the source is unchanged");
    }

    #[test]
    fn a_link_in_place_of_a_log_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let source = RunDirectory::create(folder.path().join("a"), &"config").unwrap();
        RunWriter::open(&source, 0).unwrap();
        let (log, elsewhere) = (source.episodes_path(), folder.path().join("elsewhere"));
        fs::rename(&log, &elsewhere).unwrap();
        std::os::unix::fs::symlink(&elsewhere, &log).unwrap();
        let branch = Branch::new(&source, &folder.path().join("b"), 0);
        assert!(matches!(&branch, Err(RunError::Io { path, .. }) if *path == log), "{branch:?}");
    }
}
