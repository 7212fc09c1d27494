//! The writer of a run: writes every event to all files that record it.

use std::time::SystemTime;

use super::append::AppendFile;
use super::checkpoint::Checkpoint;
use super::episodes::{self, PlayedEpisode};
use super::event::{Event, LoggedEvent};
use super::lock::{RunLock, is_at};
use super::log;
use super::projection::Projections;
use super::retention::CheckpointName;
use super::{Result, RunDirectory, RunError};
use mge_base::atomic;
use mge_base::identity::Origin;

/// Holds a run's lock and writes its logs and checkpoints.
#[derive(Debug)]
pub struct RunWriter {
    /// The run's directory.
    pub directory: RunDirectory,
    lock: RunLock,
    events: AppendFile,
    episodes: AppendFile,
    projections: Projections,
    /// The origin of the episodes before those that are to be written, if there are any.
    pub origin: Option<Origin>,
}

impl RunWriter {
    /// Begins to write a run after `episode` episodes: 0 for a new run, the checkpoint's episode
    /// to resume one. Later episodes are removed from the logs.
    ///
    /// # Errors
    /// [`RunError::InUse`] if another process writes the run; [`RunError::LogTooShort`] or
    /// [`RunError::Malformed`] if its logs do not reach `episode`; [`RunError::Io`].
    pub fn open(directory: &RunDirectory, episode: u64) -> Result<Self> {
        Self::locked(directory, directory.lock()?, episode)
    }

    /// Like [`RunWriter::open`], for a run that is already locked.
    ///
    /// # Errors
    /// As [`RunWriter::open`].
    pub fn locked(directory: &RunDirectory, lock: RunLock, episode: u64) -> Result<Self> {
        directory.checkpoints().tidy()?;
        atomic::remove_leftovers(directory.path());
        let (events, kept) = log::open(&directory.events_path(), episode)?;
        Ok(Self {
            directory: directory.clone(),
            lock,
            events,
            episodes: episodes::open(&directory.episodes_path(), episode)?,
            projections: Projections::open(directory, &kept.events)?,
            origin: kept.origin().cloned(),
        })
    }

    /// Writes an event to the log and to all other files that record it. The order of events is
    /// specified in [`Event`].
    ///
    /// # Errors
    /// [`RunError::Io`], for example on a full disk, and [`RunError::Moved`]. The run should then end;
    /// the last checkpoint is intact.
    pub fn record(&mut self, event: &Event) -> Result<()> {
        let logged = LoggedEvent { time: now(), event: event.clone() };
        self.events.append_json(&logged)?;
        self.projections.add(&logged)?;
        self.check_in_place()
    }

    /// Checks that the run's folder is still in its place, so that nothing is created there after it was
    /// moved or deleted.
    ///
    /// # Errors
    /// [`RunError::Moved`] when the run was moved or deleted.
    pub fn check_in_place(&self) -> Result<()> {
        if is_at(&self.lock.file, &self.lock.path) {
            Ok(())
        } else {
            Err(RunError::Moved(self.directory.path().to_owned()))
        }
    }

    /// Records the actions of an episode, so that it can be replayed.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn record_actions(&mut self, episode: &PlayedEpisode) -> Result<()> {
        self.episodes.append_json(episode)
    }

    /// Records [`Event::Checkpointed`], then saves a checkpoint: see [`CheckpointStore::save`](super::CheckpointStore::save).
    /// In this order, a process that is killed in between leaves an event that is removed, or a checkpoint that can be
    /// completed: see [`CheckpointStore::complete`](super::CheckpointStore::complete).
    ///
    /// # Errors
    /// [`RunError::Io`]; existing checkpoints are still intact.
    pub fn checkpoint(&mut self, names: &[CheckpointName], kept: Option<usize>, checkpoint: &Checkpoint) -> Result<()> {
        let texts = names.iter().map(ToString::to_string).collect();
        self.record(&Event::Checkpointed { episode: checkpoint.episode, names: texts })?;
        self.save(names, kept, checkpoint)
    }

    /// Saves a checkpoint under these names without recording it, and removes all `episode-N` but the newest `kept`.
    ///
    /// # Errors
    /// As [`RunWriter::checkpoint`].
    pub fn save(&mut self, names: &[CheckpointName], kept: Option<usize>, checkpoint: &Checkpoint) -> Result<()> {
        self.check_in_place()?;
        // The logs first: a resume requires them to reach at least as far as the checkpoint.
        self.events.sync()?;
        self.episodes.sync()?;
        self.projections.sync()?;
        self.directory.checkpoints().save(names, kept, checkpoint)
    }
}

/// Seconds since 1970-01-01 UTC.
pub(super) fn now() -> f64 {
    SystemTime::UNIX_EPOCH.elapsed().map_or(0.0, |elapsed| elapsed.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{EpisodeRecord, Retention, RunHistory, RunState, read_events};

    fn new_run() -> (tempfile::TempDir, RunDirectory) {
        let folder = tempfile::tempdir().unwrap();
        let directory = RunDirectory::create(folder.path().join("run"), &"config").unwrap();
        (folder, directory)
    }

    fn started(episode: u64) -> Event {
        Event::Started {
            origin: Origin { mge_version: "0.1.0".into(), ..Origin::default() },
            task: "task1".into(),
            method: "ddpg".into(),
            seed: 1,
            episodes: 20,
            episode,
            problems: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// Writes episodes, with a checkpoint every five of them.
    fn train(writer: &mut RunWriter, episodes: std::ops::RangeInclusive<u64>) {
        writer.record(&started(episodes.start() - 1)).unwrap();
        let policy = Retention { last_every: 5, ..Default::default() };
        for episode in episodes {
            let return_ = (episode as f32).sin();
            let record = EpisodeRecord { episode, return_, steps: 3, ..Default::default() };
            writer.record(&Event::EpisodeFinished(record)).unwrap();
            let due = writer.directory.checkpoints().due(&policy, episode, None, false);
            if !due.is_empty() {
                writer.checkpoint(&due, None, &Checkpoint::new(episode)).unwrap();
            }
        }
    }

    #[test]
    fn an_interrupted_run_ends_with_the_same_table_as_an_uninterrupted_one() {
        let (_folder, whole) = new_run();
        train(&mut RunWriter::open(&whole, 0).unwrap(), 1..=20);

        let (_folder, broken) = new_run();
        train(&mut RunWriter::open(&broken, 0).unwrap(), 1..=12);
        assert_eq!(broken.status().unwrap().state, RunState::Interrupted);
        let checkpoint = broken.checkpoints().load(CheckpointName::Last).unwrap();
        assert_eq!(checkpoint.episode, 10);
        let mut writer = RunWriter::open(&broken, checkpoint.episode).unwrap();
        train(&mut writer, 11..=20);
        writer.record(&Event::Finished { episode: 20 }).unwrap();
        drop(writer);

        let table = |run: &RunDirectory| fs::read(run.metrics_path()).unwrap();
        assert_eq!(table(&whole), table(&broken));
        assert_eq!(broken.status().unwrap().state, RunState::Finished);
        let episodes: Vec<u64> = read_events(&broken.events_path())
            .unwrap()
            .iter()
            .filter(|logged| matches!(logged.event, Event::EpisodeFinished(_)))
            .map(|logged| logged.event.episode())
            .collect();
        assert_eq!(episodes, Vec::from_iter(1..=20));
        assert_eq!(steps(&whole), steps(&broken));
        let text = fs::read_to_string(broken.log_path()).unwrap();
        assert_eq!(text.lines().filter(|line| line.contains("checkpoint saved")).count(), 4);
        assert!(text.contains("episodes 11 to 20"), "{text}");
    }

    /// The steps of the numbers in the only file of TensorBoard.
    fn steps(run: &RunDirectory) -> Vec<u64> {
        let [file] =
            &fs::read_dir(run.tensorboard_path()).unwrap().map(|file| file.unwrap().path()).collect::<Vec<_>>()[..]
        else {
            panic!("one file")
        };
        super::super::tensorboard::scalar_steps(&fs::read(file).unwrap())
    }

    #[test]
    fn a_run_without_a_checkpoint_starts_over() {
        let (_folder, run) = new_run();
        train(&mut RunWriter::open(&run, 0).unwrap(), 1..=3);
        train(&mut RunWriter::open(&run, 0).unwrap(), 1..=2);
        assert_eq!(RunHistory::read(&run).unwrap().records.len(), 2);
        assert_eq!(run.events().poll().unwrap().events.len(), 3);
    }

    #[test]
    fn a_run_whose_folder_disappears_ends_and_leaves_nothing_behind() {
        let (folder, run) = new_run();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        train(&mut writer, 1..=5);
        fs::remove_dir_all(run.path()).unwrap();
        let record = EpisodeRecord { episode: 6, ..Default::default() };
        let error = writer.record(&Event::EpisodeFinished(record)).unwrap_err();
        assert!(matches!(error, RunError::Moved(_)), "{error}");
        assert!(writer.checkpoint(&[CheckpointName::Last], None, &Checkpoint::new(6)).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_checkpoint_that_was_being_saved_is_completed_or_repeated() {
        let policy = Retention { last_every: 5, periodic_every: 5, periodic_kept: Some(1) };
        let play = |writer: &mut RunWriter, until: u64, kept: usize| {
            for episode in until - 4..=until {
                let record = EpisodeRecord { episode, ..Default::default() };
                writer.record(&Event::EpisodeFinished(record)).unwrap();
            }
            let mut checkpoint = Checkpoint::new(until);
            checkpoint.score = Some(until as f64);
            let due = writer.directory.checkpoints().due(&policy, until, checkpoint.score, false);
            let names = due.iter().map(ToString::to_string).collect();
            writer.record(&Event::Checkpointed { episode: until, names }).unwrap();
            writer.directory.checkpoints().save(&due[..kept], policy.periodic_kept, &checkpoint).unwrap();
        };
        let state = |run: &RunDirectory| {
            let log = read_events(&run.events_path()).unwrap();
            let events: Vec<Event> = log.into_iter().map(|logged| logged.event).collect();
            (run.checkpoints().names().unwrap(), events, run.newest_checkpoint().unwrap().0)
        };
        let (_folder, whole) = new_run();
        let mut writer = RunWriter::open(&whole, 0).unwrap();
        play(&mut writer, 5, 3);
        play(&mut writer, 10, 3);
        assert_eq!(whole.checkpoints().names().unwrap().len(), 3);
        // Killed after this many copies.
        for copies in 0..3 {
            let (_folder, broken) = new_run();
            let mut writer = RunWriter::open(&broken, 0).unwrap();
            play(&mut writer, 5, 3);
            play(&mut writer, 10, copies);
            drop(writer);
            let (checkpoint, problems) = broken.newest_checkpoint().unwrap();
            let checkpoint = checkpoint.unwrap();
            assert_eq!((checkpoint.episode, problems.len()), (if copies == 0 { 5 } else { 10 }, 0));
            let mut writer = RunWriter::open(&broken, checkpoint.episode).unwrap();
            broken.checkpoints().complete(&policy, &checkpoint).unwrap();
            if copies == 0 {
                play(&mut writer, 10, 3);
            }
            assert_eq!(state(&broken), state(&whole), "after {copies} copies");
        }
    }

    #[test]
    fn the_step_in_tensorboard_is_the_episode() {
        let (_folder, run) = new_run();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        train(&mut writer, 1..=3);
        writer.record(&Event::Evaluated { episode: 3, episodes: 1, success: 1.0, mean_return: 2.0 }).unwrap();
        drop(writer);
        assert_eq!(steps(&run), [0, 1, 2, 3, 3], "the configuration, episodes, an evaluation");
    }

    #[test]
    fn two_writers_are_refused() {
        let (_folder, run) = new_run();
        let _writer = RunWriter::open(&run, 0).unwrap();
        let error = RunWriter::open(&run, 0).unwrap_err();
        assert!(matches!(error, RunError::InUse { .. }), "{error}");
    }

    #[test]
    fn log_describes_the_events_in_words() {
        let (_folder, run) = new_run();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        train(&mut writer, 1..=5);
        writer.record(&Event::Stopped { episode: 5, reason: "asked".into() }).unwrap();
        let text = fs::read_to_string(run.log_path()).unwrap();
        let lines: Vec<_> = text.lines().map(|line| line.split_once("] ").unwrap().1).collect();
        assert_eq!(
            lines,
            [
                "mge 0.1.0: ddpg on task1, seed 1, episodes 1 to 20",
                "episode 5: checkpoint saved as last",
                "stopped after 5 episodes: asked",
            ]
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_stops_the_run_and_leaves_the_last_checkpoint() {
        let (_folder, run) = new_run();
        train(&mut RunWriter::open(&run, 0).unwrap(), 1..=5);
        let mut writer = RunWriter::open(&run, 5).unwrap();
        writer.projections = writer.projections.with_full_disk();
        let record = EpisodeRecord { episode: 6, ..Default::default() };
        let error = writer.record(&Event::EpisodeFinished(record)).unwrap_err().to_string();
        assert!(error.starts_with("cannot write /dev/full: "), "{error}");
        drop(writer);
        let (checkpoint, problems) = run.newest_checkpoint().unwrap();
        assert_eq!((checkpoint.unwrap().episode, problems.len()), (5, 0));
        train(&mut RunWriter::open(&run, 5).unwrap(), 6..=7);
        assert_eq!(RunHistory::read(&run).unwrap().records.len(), 7);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_named() {
        let (folder, run) = new_run();
        fs::write(folder.path().join("run/checkpoint"), b"in the way").unwrap();
        let error = RunWriter::open(&run, 0).unwrap_err().to_string();
        assert!(error.contains("run/checkpoint"), "{error}");
    }
}
