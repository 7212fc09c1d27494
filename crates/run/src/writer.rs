//! The writer of a run: writes every event to all files that record it.

use std::time::SystemTime;

use super::append::AppendFile;
use super::checkpoint::Checkpoint;
use super::episodes::{self, PlayedEpisode};
use super::event::{Event, LoggedEvent};
use super::lock::RunLock;
use super::log::EventLog;
use super::metrics;
use super::projection::Projections;
use super::retention::{CheckpointAction, CheckpointName, Retention};
use super::sums::{LogSums, SUMS_SECTION};
use super::{Result, RunDirectory, RunError};
use mge_base::atomic;
use mge_base::identity::Origin;

/// Holds a run's lock and writes its logs and checkpoints.
#[derive(Debug)]
pub struct RunWriter {
    directory: RunDirectory,
    lock: RunLock,
    events: EventLog,
    episodes: AppendFile,
    projections: Projections,
    /// The origin of the episodes that were kept.
    origin: Option<Origin>,
    /// Whether the log had the event of the checkpoint when it was opened.
    has_checkpoint: bool,
    /// What was wrong with files that are not needed to continue.
    problems: Vec<String>,
}

impl RunWriter {
    /// Begins to write a run after `episode` episodes: 0 for a new run, the checkpoint's episode
    /// to resume one. Later episodes are removed from the logs.
    ///
    /// # Errors
    /// [`RunError::InUse`] if another process writes the run; [`RunError::LogTooShort`] or
    /// [`RunError::Malformed`] if its logs do not reach `episode`; [`RunError::Io`].
    pub fn open(directory: &RunDirectory, episode: u64) -> Result<Self> {
        Self::locked(directory, directory.lock()?, &Checkpoint::new(episode))
    }

    /// Like [`RunWriter::open`], for a run that is already locked and continues from a checkpoint.
    ///
    /// # Errors
    /// As [`RunWriter::open`].
    pub fn locked(directory: &RunDirectory, lock: RunLock, checkpoint: &Checkpoint) -> Result<Self> {
        let episode = checkpoint.episode;
        directory.checkpoints().tidy()?;
        atomic::remove_leftovers(directory.path());
        let (events, kept) = EventLog::open(&directory.events_path(), episode)?;
        let sums = checkpoint.sums()?;
        let mut problems = Vec::new();
        for checked in [
            metrics::check(&directory.metrics_path(), &kept.records()),
            episodes::check(&directory.episodes_path(), episode, sums.as_ref().map(|sums| &sums.episodes)),
        ] {
            match checked {
                Ok(()) => {}
                Err(damage @ (RunError::Malformed { .. } | RunError::NoEpisode { .. })) => {
                    problems.push(format!("found on resuming: {damage}"));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(Self {
            directory: directory.clone(),
            lock,
            events,
            episodes: episodes::open(&directory.episodes_path(), episode)?,
            projections: Projections::open(directory, &kept.events)?,
            origin: kept.origin().cloned(),
            has_checkpoint: kept.has_checkpoint,
            problems,
        })
    }

    /// What was wrong with files that are not needed to continue.
    pub fn take_problems(&mut self) -> Vec<String> {
        std::mem::take(&mut self.problems)
    }

    /// Whether the logs are those of when a checkpoint was saved, or it is of an earlier version.
    pub fn has_logs_of(&self, checkpoint: &Checkpoint) -> bool {
        checkpoint.sums().is_ok_and(|sums| sums.is_none_or(|sums| sums == self.sums()))
    }

    /// The checksums of the logs so far.
    fn sums(&self) -> LogSums {
        LogSums { events: self.events.sum(), episodes: self.episodes.sum() }
    }

    /// The origin of the episodes before those that are to be written, if there are any.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// Writes an event to the log and to all other files that record it. The order of events is
    /// specified in [`Event`].
    ///
    /// # Errors
    /// [`RunError::Io`], for example on a full disk, and [`RunError::Moved`]. The run should then end;
    /// the last checkpoint is intact.
    pub fn record(&mut self, event: &Event) -> Result<()> {
        let logged = LoggedEvent { time: now(), event: event.clone() };
        self.events.append(&logged)?;
        self.projections.add(&logged)?;
        self.check_in_place()
    }

    /// Checks that the run's folder is still in its place, so that nothing is created there after it was
    /// moved or deleted.
    ///
    /// # Errors
    /// [`RunError::Moved`] when the run was moved or deleted.
    pub fn check_in_place(&self) -> Result<()> {
        if self.lock.is_in_place() { Ok(()) } else { Err(RunError::Moved(self.directory.path().to_owned())) }
    }

    /// Records the actions of an episode, so that it can be replayed.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn record_actions(&mut self, episode: &PlayedEpisode) -> Result<()> {
        self.episodes.append_json(episode)
    }

    /// Carries out actions, of which one saves, then records [`Event::Checkpointed`].
    ///
    /// # Errors
    /// [`RunError::Io`]; existing checkpoints are still intact.
    pub fn checkpoint(&mut self, actions: &[CheckpointAction], checkpoint: Checkpoint) -> Result<()> {
        let episode = checkpoint.episode;
        self.apply(actions, checkpoint)?;
        let saved = |action: &CheckpointAction| match action {
            CheckpointAction::Save(name) => Some(name.to_string()),
            CheckpointAction::Delete(_) => None,
        };
        let names: Vec<_> = actions.iter().filter_map(saved).collect();
        self.record(&Event::Checkpointed { episode, names })
    }

    /// Saves `last` for a run that ends or pauses when no checkpoint is due. Records no event, so that a
    /// run resumed from it equals an uninterrupted one.
    ///
    /// # Errors
    /// As [`RunWriter::checkpoint`].
    pub fn save_last(&mut self, checkpoint: Checkpoint) -> Result<()> {
        self.apply(&[CheckpointAction::Save(CheckpointName::Last)], checkpoint)
    }

    fn apply(&mut self, actions: &[CheckpointAction], mut checkpoint: Checkpoint) -> Result<()> {
        self.check_in_place()?;
        checkpoint.insert_json(SUMS_SECTION, &self.sums())?;
        // The logs first: a resume requires them to reach at least as far as the checkpoint.
        self.events.sync()?;
        self.episodes.sync()?;
        self.projections.sync()?;
        self.directory.checkpoints().apply(actions, &checkpoint)
    }

    /// Completes the work of a process that was killed while saving `checkpoint`: the copies that
    /// `policy` demands, the removals, and the event. A checkpoint that was not due, but was saved
    /// because the run ended early, is already complete. `is_finished` tells whether it is the run's last.
    ///
    /// # Errors
    /// As [`RunWriter::checkpoint`].
    pub fn finish_checkpoint(&mut self, policy: &Retention, checkpoint: &Checkpoint, is_finished: bool) -> Result<()> {
        if self.has_checkpoint {
            return Ok(());
        }
        let (store, episode) = (self.directory.checkpoints(), checkpoint.episode);
        let is_here = |name: CheckpointName| store.episode_of(name) == Some(episode);
        // If there is a `best` of this episode, it was due.
        let closing = is_finished || is_here(CheckpointName::Best);
        let mut actions = store.due(policy, episode, checkpoint.score, closing)?;
        if actions.is_empty() {
            return Ok(());
        }
        actions.retain(|action| !matches!(action, CheckpointAction::Save(name) if is_here(*name)));
        store.apply(&actions, checkpoint)?;
        let names = store.names()?.into_iter().filter(|name| is_here(*name)).map(|name| name.to_string()).collect();
        self.record(&Event::Checkpointed { episode, names })
    }

    /// The run's directory.
    pub fn directory(&self) -> &RunDirectory {
        &self.directory
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
    use crate::{EpisodeRecord, RunHistory, RunState, read_events};

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
            let actions = writer.directory().checkpoints().due(&policy, episode, None, false).unwrap();
            if !actions.is_empty() {
                writer.checkpoint(&actions, Checkpoint::new(episode)).unwrap();
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
        let save = [CheckpointAction::Save(CheckpointName::Last)];
        assert!(writer.checkpoint(&save, Checkpoint::new(6)).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    /// A checkpoint without its event may be incomplete.
    #[test]
    fn a_checkpoint_that_was_being_saved_is_completed_on_resume() {
        let policy = Retention { last_every: 5, periodic_every: 5, periodic_kept: Some(1) };
        let state = |run: &RunDirectory| {
            let names = run.checkpoints().names().unwrap();
            let log = read_events(&run.events_path()).unwrap();
            let events: Vec<Event> = log.into_iter().map(|logged| logged.event).collect();
            (names, events)
        };
        let played = |writer: &mut RunWriter, episode: u64| {
            for episode in episode - 4..=episode {
                let record = EpisodeRecord { episode, ..Default::default() };
                writer.record(&Event::EpisodeFinished(record)).unwrap();
            }
        };
        let scored = |episode: u64| {
            let mut checkpoint = Checkpoint::new(episode);
            checkpoint.score = Some(episode as f64);
            checkpoint
        };
        let saved = |writer: &mut RunWriter, episode: u64| {
            let actions = writer.directory().checkpoints().due(&policy, episode, Some(episode as f64), false).unwrap();
            writer.checkpoint(&actions, scored(episode)).unwrap();
        };
        let (_folder, whole) = new_run();
        let mut writer = RunWriter::open(&whole, 0).unwrap();
        for episode in [5, 10] {
            played(&mut writer, episode);
            saved(&mut writer, episode);
        }
        let all = [CheckpointName::Last, CheckpointName::Best, CheckpointName::Episode(10)];
        // Killed after this many copies.
        for copies in 1..=3 {
            let (_folder, broken) = new_run();
            let mut writer = RunWriter::open(&broken, 0).unwrap();
            played(&mut writer, 5);
            saved(&mut writer, 5);
            played(&mut writer, 10);
            let actions: Vec<CheckpointAction> = all[..copies].iter().copied().map(CheckpointAction::Save).collect();
            broken.checkpoints().apply(&actions, &scored(10)).unwrap();
            drop(writer);
            let checkpoint = broken.checkpoints().load(CheckpointName::Last).unwrap();
            let mut writer = RunWriter::open(&broken, 10).unwrap();
            writer.finish_checkpoint(&policy, &checkpoint, false).unwrap();
            assert_eq!(state(&broken), state(&whole), "after {copies} copies");
            assert_eq!(broken.checkpoints().load(CheckpointName::Best).unwrap(), scored(10));
            // A second call is a no-op.
            drop(writer);
            let mut writer = RunWriter::open(&broken, 10).unwrap();
            writer.finish_checkpoint(&policy, &checkpoint, false).unwrap();
            assert_eq!(state(&broken), state(&whole));
        }
    }

    #[test]
    fn the_step_in_tensorboard_is_the_episode() {
        let (_folder, run) = new_run();
        let mut writer = RunWriter::open(&run, 0).unwrap();
        train(&mut writer, 1..=3);
        writer.record(&Event::Evaluated { episode: 3, episodes: 1, success: 1.0, mean_return: 2.0 }).unwrap();
        drop(writer);
        assert_eq!(
            steps(&run),
            [0, 0, 1, 2, 3, 3],
            "the configuration as text and as settings, episodes, an evaluation"
        );
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
