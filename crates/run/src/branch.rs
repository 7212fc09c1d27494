//! A new run that starts from the state of another run after some of its episodes.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::checkpoint::Checkpoint;
use super::event::{Event, LoggedEvent};
use super::log::EventLog;
use super::projection::Projections;
use super::retention::{CheckpointAction, CheckpointName};
use super::sums::{LogSums, SUMS_SECTION};
use super::{Result, RunDirectory, RunError, episodes, file, folder};
use mge_base::atomic::{NewFolder, parent_of, remove_leftovers};

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
    sums: LogSums,
}

impl Branch {
    /// Begins a run in `place`, a folder that is empty or does not exist yet, with the logs of `source` as
    /// they were after `episode` episodes.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`]; [`RunError::NotEmpty`]; [`RunError::LogTooShort`] if the run has fewer episodes; [`RunError::Io`].
    pub fn new(source: &RunDirectory, place: &Path, episode: u64) -> Result<Self> {
        RunDirectory::at(place).make_room()?;
        let is_taken = fs::read_dir(place).is_ok_and(|mut entries| entries.next().is_some());
        if is_taken || place.is_file() {
            return Err(RunError::NotEmpty(place.to_owned()));
        }
        remove_leftovers(parent_of(place));
        let filled = folder::new_beside(place)?;
        let directory = RunDirectory::at(filled.path());
        file::copy(&source.events_path(), &directory.events_path())?;
        file::copy(&source.episodes_path(), &directory.episodes_path())?;
        let of_source = |path: PathBuf| {
            move |error| match error {
                RunError::LogTooShort { found, wanted, .. } => RunError::LogTooShort { path, found, wanted },
                RunError::Malformed { line, reason, .. } => RunError::Malformed { path, line, reason },
                error => error,
            }
        };
        let (log, kept) = EventLog::open(&directory.events_path(), episode).map_err(of_source(source.events_path()))?;
        log.sync()?;
        let episodes = episodes::open(&directory.episodes_path(), episode)?;
        episodes.sync()?;
        let sums = LogSums { events: log.sum(), episodes: episodes.sum() };
        let best = source.checkpoints();
        if best.episode_of(CheckpointName::Best).is_some_and(|best| best <= episode) {
            let best = best.load(CheckpointName::Best)?;
            directory.checkpoints().apply(&[CheckpointAction::Save(CheckpointName::Best)], &best)?;
        }
        Ok(Self { filled, directory, place: place.to_owned(), episode, events: kept.events, sums })
    }

    /// The events so far, which are those of the other run.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.events.iter().map(|logged| &logged.event)
    }

    /// Writes the configuration, the file of its model, if given, and the checkpoint from which the run continues, both as `last` and as
    /// `episode-N`, and moves the run to its place.
    ///
    /// # Errors
    /// [`RunError::Io`]; then nothing remains.
    pub fn finish(
        self,
        config: &impl Serialize,
        model: Option<&[u8]>,
        mut checkpoint: Checkpoint,
    ) -> Result<RunDirectory> {
        let Self { filled, directory, place, episode, events, sums } = self;
        checkpoint.insert_json(SUMS_SECTION, &sums)?;
        let names = [CheckpointName::Last, CheckpointName::Episode(episode)];
        directory.checkpoints().apply(&names.map(CheckpointAction::Save), &checkpoint)?;
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
    use crate::{EpisodeRecord, Event, PlayedEpisode, RunWriter, read_events, read_metrics};

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
        let made = branch.finish(&"other", None, Checkpoint::new(4)).unwrap();
        assert_eq!(read_metrics(&made.metrics_path()).unwrap().len(), 4);
        assert_eq!(read_events(&made.events_path()).unwrap().len(), 4);
        assert_eq!(made.config::<String>().unwrap(), "other");
        let (checkpoint, problems) = made.checkpoints().load_newest().unwrap();
        assert_eq!((checkpoint.episode, problems.len()), (4, 0));
        RunWriter::open(&made, 4).unwrap();
        assert_eq!(read_metrics(&source.metrics_path()).unwrap().len(), 9, "the source is unchanged");
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
