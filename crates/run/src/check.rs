//! Whether the files of a run belong together: its logs, its checkpoints, and what its log says about its end.

use super::checkpoint::Checkpoint;
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
        if store.names()?.is_empty() {
            return Ok((None, Vec::new()));
        }
        let found = self.status()?.last_episode.map_or(0, |record| record.episode);
        let newer = store.episodes()?.into_iter().map(|(wanted, _)| wanted).rfind(|wanted| *wanted > found);
        let short = newer.map(|wanted| RunError::LogTooShort { path: self.events_path(), found, wanted });
        let (newest, problems) = match (store.load_newest_until(found), short) {
            (Err(RunError::NoCheckpoint(_)), Some(short)) => return Err(short),
            (loaded, short) => {
                loaded.map(|(newest, problems)| (newest, short.into_iter().chain(problems).collect()))?
            }
        };
        self.check_events(&newest)?;
        Ok((Some(newest), problems))
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
        let (found, wanted) = (records.last().map_or(0, |record| record.episode), last.episode);
        if found < wanted {
            return Err(RunError::LogTooShort { path: self.events_path(), found, wanted });
        }
        // The log first, because the table is compared with it.
        self.check_events(&last)?;
        let needed: Vec<_> = records.iter().take_while(|record| record.episode <= wanted).collect();
        metrics::check(&self.metrics_path(), &needed)?;
        let Some(sums) = last.sums()? else { return Ok(()) };
        match episodes::check(&self.episodes_path(), wanted, Some(&sums.episodes)) {
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
    /// Whether the logs are those of when it was saved, or it is of an earlier version.
    pub fn has_sums(&self, sums: &LogSums) -> bool {
        self.sums().is_ok_and(|own| own.is_none_or(|own| own == *sums))
    }

    /// The checksums of the logs when it was saved; none in checkpoints of earlier versions.
    pub(super) fn sums(&self) -> Result<Option<LogSums>> {
        self.names().any(|name| name == SUMS_SECTION).then(|| self.json(SUMS_SECTION)).transpose()
    }
}
