//! The checkpoints of one run: the folder `checkpoint/`.

use std::fs;
use std::path::PathBuf;

use super::checkpoint::{self, Checkpoint, Manifest};
use super::retention::{CheckpointAction, CheckpointName, Retention, RetentionContext, checkpoint_actions};
use super::{Result, RunError, folder};
use mge_base::atomic;
use mge_base::paths::entries;

/// The folder that holds a run's checkpoints by name.
#[derive(Clone, Debug)]
pub struct CheckpointStore {
    folder: PathBuf,
}

impl CheckpointStore {
    /// The checkpoints in `folder`, which need not exist yet.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The path of the checkpoint with this name, whether or not it exists.
    pub fn path(&self, name: CheckpointName) -> PathBuf {
        self.folder.join(name.to_string())
    }

    /// The existing checkpoints.
    ///
    /// # Errors
    /// [`RunError::Io`] if the folder cannot be read.
    pub fn names(&self) -> Result<Vec<CheckpointName>> {
        let parse = |entry: &str| entry.parse().ok().filter(|name: &CheckpointName| name.to_string() == entry);
        let mut names: Vec<_> = self.entries()?.iter().filter_map(|entry| parse(finished_name(entry))).collect();
        names.sort_unstable();
        names.dedup();
        Ok(names)
    }

    /// Score of the checkpoint `best`; `None` if there is none.
    ///
    /// # Errors
    /// As [`Checkpoint::load`], if its manifest cannot be read.
    pub fn best_score(&self) -> Result<Option<f64>> {
        match Manifest::read(&self.path(CheckpointName::Best)) {
            Ok(manifest) => Ok(manifest.score),
            Err(RunError::NoCheckpoint(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Episode of a checkpoint; `None` if there is none with this name and a readable manifest.
    pub(super) fn episode_of(&self, name: CheckpointName) -> Option<u64> {
        Manifest::read(&self.path(name)).ok().map(|manifest| manifest.episode)
    }

    /// The name of a checkpoint that is chosen by a name, or by its episode whatever its name.
    ///
    /// # Errors
    /// [`RunError::NoSuchCheckpoint`] with those that there are; [`RunError::NoCheckpoint`] if there are none.
    pub fn chosen(&self, choice: CheckpointName) -> Result<CheckpointName> {
        let all = self.episodes()?;
        let is_it =
            |(episode, name): &&(u64, CheckpointName)| *name == choice || choice == CheckpointName::Episode(*episode);
        match all.iter().find(is_it) {
            Some((_, name)) => Ok(*name),
            // Reading it reports what is wrong with it.
            None if all.is_empty() => Ok(choice),
            None => {
                let present = all.iter().map(|(episode, name)| format!("{name} (episode {episode})"));
                let present = present.collect::<Vec<_>>().join(", ");
                Err(RunError::NoSuchCheckpoint { path: self.folder.clone(), choice, present })
            }
        }
    }

    /// Reads and verifies one checkpoint.
    ///
    /// # Errors
    /// As [`Checkpoint::load`].
    pub fn load(&self, name: CheckpointName) -> Result<Checkpoint> {
        folder::check(&self.folder)?;
        Checkpoint::load(&self.path(name))
    }

    /// Reads and verifies some sections of a checkpoint.
    ///
    /// # Errors
    /// As [`Checkpoint::load`].
    pub fn load_sections(&self, name: CheckpointName, sections: &[&str]) -> Result<Checkpoint> {
        folder::check(&self.folder)?;
        Checkpoint::load_filtered(&self.path(name), |section| sections.contains(&section))
    }

    /// The checkpoints with a readable manifest and their episodes, sorted by episode.
    ///
    /// # Errors
    /// As [`CheckpointStore::names`].
    pub fn episodes(&self) -> Result<Vec<(u64, CheckpointName)>> {
        let episode = |name| self.episode_of(name).map(|episode| (episode, name));
        let mut episodes: Vec<(u64, CheckpointName)> = self.names()?.into_iter().filter_map(episode).collect();
        episodes.sort_unstable();
        Ok(episodes)
    }

    /// What `policy` demands to be saved and removed after an episode; `closing` tells that the run ends. Whenever
    /// something is saved, `last` is saved first.
    ///
    /// # Errors
    /// As [`CheckpointStore::names`].
    pub fn due(
        &self,
        policy: &Retention,
        episode: u64,
        score: Option<f64>,
        closing: bool,
    ) -> Result<Vec<CheckpointAction>> {
        // An unreadable `best` counts as none: the next one replaces it.
        let best_score = score.and_then(|_| self.best_score().unwrap_or_default());
        let moment = RetentionContext { episode, score, best_score, closing, existing: &[] };
        if checkpoint_actions(policy, &moment).is_empty() {
            return Ok(Vec::new());
        }
        Ok(checkpoint_actions(policy, &RetentionContext { existing: &self.names()?, ..moment }))
    }

    /// Carries out actions: saves first, then removals.
    ///
    /// # Errors
    /// [`RunError::Io`]. If a save fails, the old checkpoint of that name is unchanged and nothing is
    /// removed.
    pub fn apply(&self, actions: &[CheckpointAction], checkpoint: &Checkpoint) -> Result<()> {
        folder::create(&self.folder)?;
        let mut saved: Option<PathBuf> = None;
        for action in actions {
            let CheckpointAction::Save(name) = action else { continue };
            let path = self.path(*name);
            match &saved {
                Some(first) => checkpoint::duplicate(first, &path)?,
                None => {
                    checkpoint.save(&path)?;
                    saved = Some(path);
                }
            }
        }
        for action in actions {
            if let CheckpointAction::Delete(name) = action {
                checkpoint::remove_whole(&self.path(*name))?;
            }
        }
        Ok(())
    }

    /// Cleans up after a process that was killed while writing. Only for the holder of the run's lock.
    pub fn tidy(&self) -> Result<()> {
        atomic::remove_leftovers(&self.folder);
        // Whatever else is in the folder is the user's.
        for entry in self.entries()?.into_iter().filter(|entry| finished_name(entry).parse::<CheckpointName>().is_ok())
        {
            let path = self.folder.join(&entry);
            // Succeeds only for an empty folder, left by an interrupted removal.
            if fs::remove_dir(&path).is_ok() {
                continue;
            }
            let finished = self.folder.join(finished_name(&entry));
            if finished == path {
                continue;
            }
            if finished.exists() {
                checkpoint::remove(&path)?;
            } else {
                fs::rename(&path, &finished).map_err(RunError::io("restore", &finished))?;
            }
        }
        Ok(())
    }

    fn entries(&self) -> Result<Vec<String>> {
        folder::check(&self.folder)?;
        let entries = entries(&self.folder).map_err(RunError::io("read", &self.folder))?;
        Ok(entries.iter().filter_map(|entry| Some(entry.file_name()?.to_string_lossy().into_owned())).collect())
    }
}

/// The final name of a checkpoint, even while a process replaces it.
fn finished_name(entry: &str) -> &str {
    entry.strip_prefix(checkpoint::PREVIOUS).unwrap_or(entry)
}

#[cfg(test)]
mod tests {
    use super::CheckpointAction::{Delete, Save};
    use super::CheckpointName::{Best, Episode, Last};
    use super::*;

    fn sample(episode: u64, score: f64) -> Checkpoint {
        let mut checkpoint = Checkpoint::new(episode);
        checkpoint.score = Some(score);
        checkpoint.insert("weights", vec![episode as u8; 100]).unwrap();
        checkpoint
    }

    #[test]
    fn actions_are_carried_out() {
        let folder = tempfile::tempdir().unwrap();
        let store = CheckpointStore::new(folder.path().join("checkpoint"));
        assert_eq!(store.names().unwrap(), []);
        assert_eq!(store.best_score().unwrap(), None);
        store.apply(&[Save(Last), Save(Best), Save(Episode(10))], &sample(10, 0.5)).unwrap();
        store.apply(&[Save(Last), Save(Episode(20)), Delete(Episode(10))], &sample(20, 0.1)).unwrap();
        assert_eq!(store.names().unwrap(), [Last, Best, Episode(20)]);
        assert_eq!(store.best_score().unwrap(), Some(0.5));
        assert_eq!(store.load(Best).unwrap(), sample(10, 0.5));
        assert_eq!(store.load(Last).unwrap(), sample(20, 0.1));
        assert_eq!(store.load(Episode(20)).unwrap(), sample(20, 0.1));
        assert!(matches!(store.load(Episode(10)).unwrap_err(), RunError::NoCheckpoint(_)));
    }

    #[test]
    fn leftovers_of_a_killed_process_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let store = CheckpointStore::new(folder.path());
        store.apply(&[Save(Last), Save(Best)], &sample(10, 0.5)).unwrap();
        fs::rename(store.path(Last), folder.path().join(".previous-last")).unwrap();
        fs::create_dir(folder.path().join(".previous-best")).unwrap();
        fs::create_dir(folder.path().join(".mge-abcDEF0123.tmp")).unwrap();
        for mine in [".writing-mine", ".previous-mine", "mine"] {
            fs::create_dir(folder.path().join(mine)).unwrap();
        }
        assert_eq!(store.names().unwrap(), [Last, Best]);
        store.tidy().unwrap();
        assert_eq!(store.entries().unwrap().len(), 5, "the checkpoints and the user's folders");
        assert_eq!(store.load(Last).unwrap().episode, 10);
    }
}
