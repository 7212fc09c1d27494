//! The writer of the event log `events.jsonl`, and the part of the log that belongs to a checkpoint.

use std::path::Path;

use super::append::AppendFile;
use super::event::{Event, LoggedEvent};
use super::reader::{check_order, complete_lines, parse};
use super::{Result, RunError, file};
use mge_base::identity::Origin;

/// The part of a log that belongs to a checkpoint.
#[derive(Debug)]
pub(super) struct KeptLog {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its events.
    pub events: Vec<LoggedEvent>,
}

impl KeptLog {
    /// Reads the part of a log that belongs to a checkpoint of `episode`: all up to that episode's `Checkpointed`, or,
    /// without one, up to the episode itself.
    ///
    /// A run that was stopped or paused when no checkpoint was due has one without an event: it belongs
    /// to the log as it was before the stop or the pause.
    ///
    /// The rest has also the damage after the last kept episode, and the final events of a process that
    /// was killed before it could log the checkpoint.
    ///
    /// # Errors
    /// [`RunError::LogTooShort`] if it does not reach the episode; [`RunError::Malformed`]; [`RunError::Io`].
    pub fn read(path: &Path, episode: u64) -> Result<Self> {
        let mut bytes = file::read(path)?;
        let mut events: Vec<LoggedEvent> = Vec::new();
        // The length after a line, and the number of events until there.
        let (mut before_end, mut after_checkpoint) = ((0, 0), None);
        let (mut length, mut last, mut is_over) = (0, 0, false);
        for (number, line) in complete_lines(&bytes) {
            let logged = match parse(path, number, line) {
                Err(_) if last >= episode => break,
                parsed => parsed?,
            };
            let event = &logged.event;
            if let Some(record) = event.record() {
                if record.episode > episode {
                    break;
                }
                check_order(path, number, last, event)?;
                last = record.episode;
            }
            length += line.len() + 1;
            let here = (length, events.len() + 1);
            let ends = matches!(
                event,
                Event::Finished { .. } | Event::Stopped { .. } | Event::Failed { .. } | Event::Paused { .. }
            );
            is_over |= ends && event.episode() == episode;
            if !ends && !is_over {
                before_end = here;
            }
            if matches!(event, Event::Checkpointed { episode: at, .. } if *at == episode) {
                after_checkpoint = Some(here);
            }
            events.push(logged);
        }
        if last < episode {
            return Err(RunError::LogTooShort { path: path.to_path_buf(), last, checkpoint: episode });
        }
        // Without a checkpoint the run starts over, and so does its log.
        let unlogged = if episode == 0 { (0, 0) } else { before_end };
        let (length, count) = after_checkpoint.unwrap_or(unlogged);
        events.truncate(count);
        bytes.truncate(length);
        Ok(Self { bytes, events })
    }

    /// The origin of the latest episodes; none without episodes.
    pub fn origin(&self) -> Option<&Origin> {
        self.events.iter().rev().find_map(|logged| match &logged.event {
            Event::Started { origin, .. } => Some(origin),
            _ => None,
        })
    }
}

/// Opens the log for writing and removes everything that does not belong to a checkpoint of `episode`. Also returns what
/// is left.
pub(super) fn open(path: &Path, episode: u64) -> Result<(AppendFile, KeptLog)> {
    let file = AppendFile::open(path)?;
    let kept = KeptLog::read(path, episode)?;
    file.cut(kept.bytes.len())?;
    Ok((file, kept))
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Write;
    use std::path::PathBuf;

    use super::*;
    use crate::EpisodeRecord;
    use crate::reader::{read_events, read_tail};

    pub fn episode(episode: u64) -> Event {
        Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() })
    }

    pub fn checkpointed(episode: u64) -> Event {
        Event::Checkpointed { episode, names: vec!["last".into()] }
    }

    pub struct Log {
        _folder: tempfile::TempDir,
        pub path: PathBuf,
        clock: f64,
    }

    impl Log {
        pub fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("events.jsonl");
            Self { _folder: folder, path, clock: 0.0 }
        }

        pub fn write(&mut self, from: u64, events: &[Event]) {
            let (mut log, _) = open(&self.path, from).unwrap();
            for event in events {
                self.clock += 1.0;
                log.append_json(&LoggedEvent { time: self.clock, event: event.clone() }).unwrap();
            }
        }

        pub fn raw(&self, text: &str) {
            std::fs::OpenOptions::new()
                .append(true)
                .create(true)
                .open(&self.path)
                .unwrap()
                .write_all(text.as_bytes())
                .unwrap();
        }

        fn events(&self) -> Vec<Event> {
            read_events(&self.path).unwrap().into_iter().map(|logged| logged.event).collect()
        }
    }

    #[test]
    fn resume_cuts_after_the_checkpoint_of_its_episode() {
        let mut log = Log::new();
        let kept = [episode(1), checkpointed(1), episode(2), checkpointed(2)];
        log.write(0, &kept);
        log.write(2, &[]);
        assert_eq!(log.events(), kept);

        let schedule = Event::ScheduleChanged { episode: 2, schedule: "0".into() };
        let stopped = Event::Stopped { episode: 3, reason: "asked".into() };
        let mut log = Log::new();
        log.write(0, &kept);
        log.raw(&lines(&[schedule, episode(3), stopped]));
        log.raw("{\"time\":9");
        log.write(2, &[]);
        assert_eq!(log.events(), kept);
        log.write(1, &[]);
        assert_eq!(log.events(), kept[..2]);
        log.write(0, &[]);
        assert_eq!(log.events(), []);

        let mut log = Log::new();
        log.write(0, &kept);
        log.raw("left by a power failure\n");
        log.write(2, &[]);
        assert_eq!(log.events(), kept, "damage after the cut is removed");
        log.raw("and again\n");
        log.write(0, &[]);
        assert_eq!(log.events(), []);
    }

    pub fn lines(events: &[Event]) -> String {
        let line =
            |event: &Event| serde_json::to_string(&LoggedEvent { time: 0.5, event: event.clone() }).unwrap() + "\n";
        events.iter().map(line).collect()
    }

    #[test]
    fn resume_cuts_after_the_episode_when_the_checkpoint_was_not_logged() {
        let mut log = Log::new();
        let evaluated = Event::Evaluated { episode: 1, episodes: 5, success: 0.0, mean_return: 0.0 };
        log.raw(&lines(&[episode(1), evaluated.clone(), episode(2)]));
        log.write(1, &[]);
        assert_eq!(log.events(), [episode(1), evaluated.clone()]);

        let failed = Event::Failed { episode: 1, reason: "disk".into() };
        log.raw(&lines(&[failed]));
        log.write(1, &[]);
        assert_eq!(log.events(), [episode(1), evaluated], "the end of the previous process is not part of the run");
    }

    #[test]
    fn resume_refuses_a_log_that_is_too_short_or_damaged_before_the_cut() {
        let log = Log::new();
        log.raw(&lines(&[episode(1)]));
        let error = open(&log.path, 5).unwrap_err();
        assert!(matches!(error, RunError::LogTooShort { last: 1, checkpoint: 5, .. }), "{error}");

        let log = Log::new();
        log.raw(&lines(&[episode(1)]));
        log.raw("rubbish\n");
        log.raw(&lines(&[episode(2), checkpointed(2)]));
        let error = open(&log.path, 2).unwrap_err();
        assert!(error.to_string().contains("line 2: not an event"), "{error}");
        assert_eq!(read_tail(&log.path, 1 << 16).unwrap().len(), 3);
    }
}
