//! Whether the files of a run belong together: its logs, its checkpoints, and what its log says about its end.

use std::cmp::Reverse;

use super::checkpoint::{Checkpoint, Manifest};
use super::event::EpisodeRecord;
use super::retention::CheckpointName;
use super::sums::{LogSums, SUMS_SECTION};
use super::{Result, RunDirectory, RunError, episodes, log, metrics};

impl RunDirectory {
    /// Why a run whose log says that it is finished after `episode` episodes is not: another of its files does not
    /// reach that far. Reads only the ends and sizes of files.
    pub(super) fn missing(&self, episode: u64) -> Result<Option<String>> {
        let last = match self.last_with(&[SUMS_SECTION]) {
            Err(error) => return Ok(Some(error.to_string())),
            Ok(last) => last,
        };
        if let Some(last) = last.as_ref().filter(|last| last.episode != episode) {
            return Ok(Some(format!("its checkpoint `last` is of episode {} of {episode}", last.episode)));
        }
        let rows = metrics::last_episode(&self.metrics_path())?;
        if rows != episode {
            return Ok(Some(format!("metrics.csv ends at episode {rows} of {episode}")));
        }
        // It may have been removed: only replays need it.
        let replays = std::fs::symlink_metadata(self.episodes_path()).map_or(0, |data| data.len());
        let sums = last.map(|last| last.sums()).transpose()?.flatten();
        let is_odd = replays > 0 && sums.is_some_and(|sums| sums.episodes.bytes != replays);
        Ok(is_odd.then(|| "episodes.jsonl has lost some episodes".to_owned()))
    }

    /// The newest checkpoint from which the run can be continued, none if it has no checkpoint at all, and why newer
    /// ones cannot be used.
    ///
    /// # Errors
    /// Why none can be used, or the log was changed before that checkpoint.
    pub fn newest_checkpoint(&self) -> Result<(Option<Checkpoint>, Vec<RunError>)> {
        let store = self.checkpoints();
        let (mut candidates, mut problems) = (Vec::new(), Vec::new());
        for name in store.names()? {
            match Manifest::read(&store.path(name)) {
                Ok(manifest) => candidates.push((Reverse(manifest.episode), name)),
                Err(problem) => problems.push(problem),
            }
        }
        candidates.sort_unstable();
        let last = self.status()?.last_episode.map_or(0, |record| record.episode);
        let newest = candidates.first().map_or(0, |(Reverse(episode), _)| *episode);
        if newest > last {
            problems.insert(0, RunError::LogTooShort { path: self.events_path(), last, checkpoint: newest });
        }
        for (_, name) in candidates.into_iter().filter(|(Reverse(episode), _)| *episode <= last) {
            match store.load(name) {
                Ok(checkpoint) => {
                    self.check_events(&checkpoint)?;
                    return Ok((Some(checkpoint), problems));
                }
                Err(problem) => problems.push(problem),
            }
        }
        problems.into_iter().next().map_or(Ok((None, Vec::new())), Err)
    }

    /// Checks that the event log up to a checkpoint is that of when it was saved.
    ///
    /// # Errors
    /// [`RunError::Malformed`] if it was changed.
    pub fn check_events(&self, checkpoint: &Checkpoint) -> Result<()> {
        let Some(sums) = checkpoint.sums()? else { return Ok(()) };
        let (path, episode) = (self.events_path(), checkpoint.episode);
        if log::sum_until(&path, episode)? == sums.events {
            return Ok(());
        }
        let what = format!("it was changed after it was written, before the checkpoint of episode {episode}");
        let reason = what + ": restore it from a copy; `mge fork --at N` can continue from an earlier checkpoint";
        Err(RunError::malformed(&path, None, reason))
    }

    /// Checks that the logs agree with each other and with the checkpoint `last`, up to its episode; what is after it
    /// is repeated when the run is resumed. `records` are the episodes in the event log. Nothing is checked while a
    /// process writes the run.
    ///
    /// # Errors
    /// [`RunError::LogTooShort`] or [`RunError::Malformed`], with the file.
    pub fn check_logs(&self, records: &[EpisodeRecord]) -> Result<()> {
        if self.is_locked()? {
            return Ok(());
        }
        let Some(last) = self.last_with(&[SUMS_SECTION])? else { return Ok(()) };
        let (logged, episode) = (records.last().map_or(0, |record| record.episode), last.episode);
        if logged < episode {
            return Err(RunError::LogTooShort { path: self.events_path(), last: logged, checkpoint: episode });
        }
        // The log first, because the table is compared with it.
        self.check_events(&last)?;
        let needed: Vec<_> = records.iter().take_while(|record| record.episode <= episode).collect();
        metrics::check(&self.metrics_path(), &needed)?;
        let Some(sums) = last.sums()? else { return Ok(()) };
        match episodes::check(&self.episodes_path(), episode, Some(&sums.episodes)) {
            // It may have been removed.
            Err(RunError::NoEpisode { .. }) => Ok(()),
            checked => checked,
        }
    }

    /// Some sections of the checkpoint `last`; none if there is no such checkpoint.
    ///
    /// # Errors
    /// As [`Checkpoint::load`].
    pub fn last_with(&self, sections: &[&str]) -> Result<Option<Checkpoint>> {
        match self.checkpoints().load_sections(CheckpointName::Last, sections) {
            Err(RunError::NoCheckpoint(_)) => Ok(None),
            loaded => loaded.map(Some),
        }
    }
}

impl Checkpoint {
    /// The checksums of the logs when it was saved; none in checkpoints of earlier versions.
    pub(super) fn sums(&self) -> Result<Option<LogSums>> {
        self.names().any(|name| name == SUMS_SECTION).then(|| self.json(SUMS_SECTION)).transpose()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::CheckpointAction::Save;
    use crate::CheckpointName::{Best, Last};
    use crate::{Event, RunWriter};

    #[test]
    fn the_newest_valid_checkpoint_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path().join("run"), &"config").unwrap();
        let newest =
            || run.newest_checkpoint().map(|(newest, problems)| (newest.map(|newest| newest.episode), problems));
        let mut writer = RunWriter::open(&run, 0).unwrap();
        assert!(matches!(newest(), Ok((None, problems)) if problems.is_empty()));
        for (episode, actions) in [(10, &[Save(Last), Save(Best)][..]), (20, &[Save(Last)])] {
            for episode in episode - 9..=episode {
                writer.record(&Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() })).unwrap();
            }
            let mut checkpoint = Checkpoint::new(episode);
            checkpoint.insert("weights", vec![episode as u8; 100]).unwrap();
            writer.checkpoint(actions, checkpoint).unwrap();
            assert!(matches!(newest(), Ok((Some(found), problems)) if found == episode && problems.is_empty()));
        }
        let store = run.checkpoints();
        fs::write(store.path(Last).join("weights"), b"short").unwrap();
        let (found, problems) = newest().unwrap();
        assert!(found == Some(10) && matches!(problems[..], [RunError::Truncated { .. }]), "{found:?}, {problems:?}");
        fs::remove_file(store.path(Best).join("manifest.json")).unwrap();
        assert!(newest().is_err());
    }
}
