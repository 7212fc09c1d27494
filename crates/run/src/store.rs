//! The checkpoints of one run: the folder `checkpoint/`.

use std::fs;
use std::path::PathBuf;

use super::checkpoint::{self, Checkpoint, Manifest};
use super::retention::{CheckpointName, Retention};
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
    /// [`RunError::Refused`] with those that there are.
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
                let folder = self.folder.display();
                Err(RunError::Refused(format!("there is no checkpoint {choice} in {folder}: it has {present}")))
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

    /// The checkpoints that `policy` demands after an episode, `last` as the last of them: so it is saved only when the
    /// others are complete. `closing` tells that the run ends. A checkpoint becomes `best` unless its score is lower than
    /// that of the current `best`; one with NaN never does. So of equal ones the latest, which has learned most, is
    /// `best`.
    pub fn due(&self, policy: &Retention, episode: u64, score: Option<f64>, closing: bool) -> Vec<CheckpointName> {
        let due = |every: u64| every > 0 && episode > 0 && episode.is_multiple_of(every);
        // An unreadable `best` counts as none: the next one replaces it.
        let is_best = |score: f64| match self.best_score().unwrap_or_default() {
            Some(best) => score >= best,
            None => !score.is_nan(),
        };
        let best = score.is_some_and(is_best).then_some(CheckpointName::Best);
        let periodic = due(policy.periodic_every).then_some(CheckpointName::Episode(episode));
        let mut names: Vec<_> = best.into_iter().chain(periodic).collect();
        if !names.is_empty() || closing || due(policy.last_every) {
            names.push(CheckpointName::Last);
        }
        names
    }

    /// Saves a checkpoint under these names, then removes all `episode-N` but the newest `kept`, if given.
    ///
    /// # Errors
    /// [`RunError::Io`]. If a save fails, the old checkpoint of that name is unchanged and nothing is
    /// removed.
    pub fn save(&self, names: &[CheckpointName], kept: Option<usize>, checkpoint: &Checkpoint) -> Result<()> {
        let Some((first, others)) = names.split_first() else { return Ok(()) };
        folder::create(&self.folder)?;
        checkpoint.save(&self.path(*first))?;
        for name in others {
            checkpoint::duplicate(&self.path(*first), &self.path(*name))?;
        }
        let mut periodic = self.names()?;
        periodic.retain(|name| matches!(name, CheckpointName::Episode(_)));
        let surplus = kept.map_or(0, |kept| periodic.len().saturating_sub(kept));
        periodic[..surplus].iter().try_for_each(|name| checkpoint::remove_whole(&self.path(*name)))
    }

    /// Completes the work of a process that was killed while it saved a checkpoint, before it saved `last`.
    ///
    /// # Errors
    /// As [`CheckpointStore::save`].
    pub fn complete(&self, policy: &Retention, checkpoint: &Checkpoint) -> Result<()> {
        if self.episode_of(CheckpointName::Last) == Some(checkpoint.episode) {
            return Ok(());
        }
        let due = self.due(policy, checkpoint.episode, checkpoint.score, true);
        self.save(&due, policy.periodic_kept, checkpoint)
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
    use super::CheckpointName::{Best, Episode, Last};
    use super::*;

    fn sample(episode: u64, score: f64) -> Checkpoint {
        let mut checkpoint = Checkpoint::new(episode);
        checkpoint.score = Some(score);
        checkpoint.insert("weights", vec![episode as u8; 100]).unwrap();
        checkpoint
    }

    #[test]
    fn checkpoints_are_saved_and_old_ones_removed() {
        let folder = tempfile::tempdir().unwrap();
        let store = CheckpointStore::new(folder.path().join("checkpoint"));
        assert_eq!(store.names().unwrap(), []);
        assert_eq!(store.best_score().unwrap(), None);
        store.save(&[Best, Episode(10), Last], Some(1), &sample(10, 0.5)).unwrap();
        store.save(&[Episode(20), Last], Some(1), &sample(20, 0.1)).unwrap();
        assert_eq!(store.names().unwrap(), [Last, Best, Episode(20)]);
        assert_eq!(store.best_score().unwrap(), Some(0.5));
        assert_eq!(store.load(Best).unwrap(), sample(10, 0.5));
        assert_eq!(store.load(Last).unwrap(), sample(20, 0.1));
        assert_eq!(store.load(Episode(20)).unwrap(), sample(20, 0.1));
        assert!(matches!(store.load(Episode(10)).unwrap_err(), RunError::NoCheckpoint(_)));
    }

    #[test]
    fn what_is_due_follows_from_the_episode_and_the_score() {
        let folder = tempfile::tempdir().unwrap();
        let store = CheckpointStore::new(folder.path());
        let policy = Retention { last_every: 10, periodic_every: 100, periodic_kept: Some(2) };
        assert_eq!(store.due(&policy, 7, None, false), []);
        assert_eq!(store.due(&policy, 0, None, false), []);
        assert_eq!(store.due(&policy, 20, None, false), [Last]);
        assert_eq!(store.due(&policy, 0, None, true), [Last]);
        assert_eq!(store.due(&policy, 200, Some(0.5), false), [Best, Episode(200), Last]);
        let never = Retention { last_every: 0, periodic_every: 0, periodic_kept: None };
        assert_eq!(store.due(&never, 20, None, false), []);
        assert_eq!(store.due(&never, 20, Some(f64::NAN), false), []);
        store.save(&[Best], None, &sample(10, 0.5)).unwrap();
        for (score, is_best) in [(0.4, false), (0.5, true), (0.6, true), (f64::NAN, false)] {
            assert_eq!(store.due(&never, 20, Some(score), false).contains(&Best), is_best, "{score}");
        }
    }

    #[test]
    fn leftovers_of_a_killed_process_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let store = CheckpointStore::new(folder.path());
        store.save(&[Last, Best], None, &sample(10, 0.5)).unwrap();
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
