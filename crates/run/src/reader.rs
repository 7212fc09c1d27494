//! Readers of the event log `events.jsonl`, which another process may still be writing.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::event::{Event, LoggedEvent};
use super::{Result, RunError, file};
use mge_base::json;

/// Lines that end with a line feed, counted from 1; a half-written last line is left out.
pub(super) fn complete_lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let lines = file::whole_lines(bytes).split_inclusive(|&byte| byte == b'\n');
    (1..).zip(lines.map(|line| &line[..line.len() - 1]))
}

/// The event in a line, which has this number.
pub(super) fn parse(path: &Path, number: u64, line: &[u8]) -> Result<LoggedEvent> {
    serde_json::from_slice(line)
        .map_err(|error| RunError::malformed(path, Some(number), format!("not an event: {}", json::message(&error))))
}

/// Checks that no episode is missing before that of an event; `last` is the last one before.
pub(super) fn check_order(path: &Path, line: u64, last: u64, event: &Event) -> Result<()> {
    match event {
        Event::EpisodeFinished(record) if record.episode > last + 1 => {
            let reason = format!("episode {} follows episode {last}: those between are missing", record.episode);
            Err(RunError::malformed(path, Some(line), reason))
        }
        _ => Ok(()),
    }
}

/// Bytes of a log that are read at once, which bounds a reader's memory.
const CHUNK_BYTES: u64 = 4 << 20;

/// The result of a poll.
#[derive(Debug, Default)]
pub struct Poll {
    /// New events, in order.
    pub events: Vec<LoggedEvent>,
    /// Lines that cannot be read, each with its number; the lines around them are in `events`.
    pub problems: Vec<RunError>,
    /// The run was reset to a checkpoint: events read before are void, and `events` starts from the beginning.
    pub restarted: bool,
    /// There is more to read with the next call.
    pub more: bool,
}

/// Follows an `events.jsonl` that another process may still be writing.
#[derive(Debug, Clone)]
pub struct EventReader {
    path: PathBuf,
    offset: u64,
    line: u64,
    /// The last line read. Times make lines unique, so if it is no longer in the same place, the log was
    /// truncated in the meantime, even if it is now longer than before.
    last: Vec<u8>,
}

impl EventReader {
    /// A reader at the beginning of the log at `path`, which need not exist yet.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), offset: 0, line: 0, last: Vec::new() }
    }

    /// Reads new events since the last call, at most one piece of the log. There are none if the log does
    /// not exist, has not grown or has only a new half-written line.
    ///
    /// # Errors
    /// [`RunError::Io`] if the file cannot be read. Invalid lines are reported in [`Poll::problems`].
    pub fn poll(&mut self) -> Result<Poll> {
        let failed = RunError::io("read", &self.path);
        self.read_on().map_err(failed)
    }

    fn read_on(&mut self) -> std::io::Result<Poll> {
        let mut poll = Poll::default();
        let mut file = match file::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound && self.offset == 0 => {
                return Ok(poll);
            }
            Err(error) => return Err(error),
        };
        if !self.is_where_it_was(&mut file)? {
            *self = Self::new(std::mem::take(&mut self.path));
            poll.restarted = true;
        }
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(self.offset))?;
        // A line may be longer than a piece.
        loop {
            poll.more = file.by_ref().take(CHUNK_BYTES).read_to_end(&mut bytes)? as u64 == CHUNK_BYTES;
            if !poll.more || bytes.contains(&b'\n') {
                break;
            }
        }
        let first = self.line;
        for (number, line) in complete_lines(&bytes) {
            match parse(&self.path, first + number, line) {
                Ok(event) => poll.events.push(event),
                Err(problem) => poll.problems.push(problem),
            }
            self.offset += line.len() as u64 + 1;
            self.line += 1;
            self.last.clear();
            self.last.extend_from_slice(line);
            self.last.push(b'\n');
        }
        Ok(poll)
    }

    fn is_where_it_was(&self, file: &mut File) -> std::io::Result<bool> {
        let mut found = vec![0; self.last.len()];
        file.seek(SeekFrom::Start(self.offset - self.last.len() as u64))?;
        match file.read_exact(&mut found) {
            Ok(()) => Ok(found == self.last),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(error),
        }
    }
}

/// All events of a log, strictly.
///
/// # Errors
/// [`RunError::Io`] if there is no such file, [`RunError::Malformed`] with the number of the first
/// line that is not an event. A half-written last line is left out and is not an error.
pub fn read_events(path: &Path) -> Result<Vec<LoggedEvent>> {
    let mut events = Vec::new();
    for_each_event(path, |logged| events.push(logged))?;
    Ok(events)
}

/// Calls `visit` for each event of a log, in order; errors are those of [`read_events`].
pub(super) fn for_each_event(path: &Path, mut visit: impl FnMut(LoggedEvent)) -> Result<()> {
    let mut last = 0;
    for (number, line) in complete_lines(&file::read(path)?) {
        let logged = parse(path, number, line)?;
        check_order(path, number, last, &logged.event)?;
        last = logged.event.record().map_or(last, |record| record.episode);
        visit(logged);
    }
    Ok(())
}

/// The events in the last `bytes` bytes of a log, oldest first, without invalid lines.
pub(super) fn read_tail(path: &Path, bytes: u64) -> Result<Vec<LoggedEvent>> {
    let tail = file::read_end(path, bytes)?;
    Ok(complete_lines(&tail).filter_map(|(_, line)| serde_json::from_slice(line).ok()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::EpisodeRecord;
    use crate::log::tests::{Log, checkpointed, episode, lines};

    #[test]
    fn a_long_log_is_read_in_pieces_and_a_long_line_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.jsonl");
        let line = |episode| {
            let event = Event::EpisodeFinished(EpisodeRecord { episode, ..EpisodeRecord::default() });
            serde_json::to_string(&LoggedEvent { time: episode as f64, event }).unwrap() + "\n"
        };
        let mut text: String = (1..=2).map(line).collect();
        text += &("x".repeat(2 * CHUNK_BYTES as usize) + "\n");
        let count = 2 * CHUNK_BYTES / line(3).len() as u64;
        text.extend((3..=count).map(line));
        std::fs::write(&path, text).unwrap();
        let mut reader = EventReader::new(&path);
        let (mut episodes, mut problems, mut pieces) = (Vec::new(), 0, 0);
        loop {
            let poll = reader.poll().unwrap();
            episodes.extend(poll.events.iter().map(|logged| logged.event.episode()));
            problems += poll.problems.len();
            pieces += 1;
            if !poll.more {
                break;
            }
        }
        assert_eq!((episodes, problems), ((1..=count).collect(), 1));
        assert!(pieces > 3, "{pieces}");
        assert!(matches!(read_events(&path), Err(RunError::Malformed { line: Some(3), .. })));
    }

    #[test]
    fn the_tail_of_a_missing_log_is_empty_but_an_unreadable_log_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(read_tail(&folder.path().join("none"), 10).unwrap().is_empty());
        assert!(read_tail(folder.path(), 10).is_err());
    }

    #[test]
    fn reader_follows_and_waits_for_the_end_of_a_line() {
        let log = Log::new();
        let mut reader = EventReader::new(&log.path);
        assert!(reader.poll().unwrap().events.is_empty());
        let line = lines(&[episode(1)]);
        let (head, tail) = line.split_at(30);
        log.raw(head);
        let poll = reader.poll().unwrap();
        assert!(poll.events.is_empty() && poll.problems.is_empty() && !poll.restarted);
        log.raw(tail);
        log.raw(&lines(&[episode(2)]));
        let poll = reader.poll().unwrap();
        let episodes: Vec<u64> = poll.events.iter().map(|logged| logged.event.episode()).collect();
        assert_eq!(episodes, [1, 2]);
        assert!(reader.poll().unwrap().events.is_empty());
    }

    #[test]
    fn reader_names_a_bad_line_and_reads_those_around_it() {
        let log = Log::new();
        let mut reader = EventReader::new(&log.path);
        log.raw(&lines(&[episode(1)]));
        reader.poll().unwrap();
        log.raw(&lines(&[episode(2)]));
        log.raw("\u{fffd}{]\n");
        log.raw(&lines(&[episode(3)]));
        let poll = reader.poll().unwrap();
        assert_eq!(poll.events.len(), 2);
        let [RunError::Malformed { line: Some(3), .. }] = poll.problems[..] else { panic!("{:?}", poll.problems) };
    }

    #[test]
    fn reader_notices_that_the_run_was_reset() {
        let mut log = Log::new();
        log.write(0, &[episode(1), checkpointed(1), episode(2), episode(3)]);
        let mut reader = EventReader::new(&log.path);
        assert_eq!(reader.poll().unwrap().events.len(), 4);
        log.write(1, &[]);
        let poll = reader.poll().unwrap();
        assert!(poll.restarted);
        assert_eq!(poll.events.len(), 2);

        // Truncated and grown beyond the old length between two polls.
        log.write(1, &[episode(2), episode(3)]);
        assert_eq!(reader.poll().unwrap().events.len(), 2);
        log.write(1, &[episode(2), episode(3), episode(4)]);
        let poll = reader.poll().unwrap();
        assert!(poll.restarted);
        assert_eq!(poll.events.len(), 5);
    }

    #[test]
    fn a_vanished_log_is_an_error_only_if_something_was_read() {
        let log = Log::new();
        log.raw(&lines(&[episode(1)]));
        let mut reader = EventReader::new(&log.path);
        reader.poll().unwrap();
        std::fs::remove_file(&log.path).unwrap();
        assert!(reader.poll().unwrap_err().is_not_found());
        assert!(read_events(&log.path).unwrap_err().is_not_found());
    }
}
