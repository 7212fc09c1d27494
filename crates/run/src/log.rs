//! The event log `events.jsonl`, written by one process and read by any, even while it grows.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::append::AppendFile;
use super::event::{EpisodeRecord, Event, LoggedEvent};
use super::sums::{Sum, Summing};
use super::{Result, RunError, file};
use mge_base::identity::Origin;
use mge_base::json;

/// The writing end of `events.jsonl`.
#[derive(Debug)]
pub(super) struct EventLog {
    file: AppendFile,
    /// Of the results, without their times.
    summing: Summing,
}

/// The part of a log that belongs to a checkpoint.
#[derive(Debug)]
pub(super) struct KeptLog {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its events.
    pub events: Vec<LoggedEvent>,
    /// Whether it ends with the `Checkpointed` event of the checkpoint.
    pub has_checkpoint: bool,
}

impl KeptLog {
    /// Reads the part of a log that belongs to a checkpoint of `episode`: all up to that episode's `Checkpointed`, or,
    /// without one, up to the episode itself.
    ///
    /// # Errors
    /// [`RunError::LogTooShort`] if it does not reach the episode; [`RunError::Malformed`]; [`RunError::Io`].
    pub fn read(path: &Path, episode: u64) -> Result<Self> {
        kept_until(path, file::read(path)?, episode)
    }

    /// The sum of the results, without their times.
    pub fn sum(&self) -> Sum {
        results_until(&self.bytes, u64::MAX).sum()
    }

    /// The finished episodes.
    pub fn records(&self) -> Vec<&EpisodeRecord> {
        self.events.iter().filter_map(|logged| logged.event.record()).collect()
    }

    /// The origin of the latest episodes; none without episodes.
    pub fn origin(&self) -> Option<&Origin> {
        self.events.iter().rev().find_map(|logged| match &logged.event {
            Event::Started { origin, .. } => Some(origin),
            _ => None,
        })
    }
}

impl EventLog {
    /// Opens the log and removes everything that does not belong to a checkpoint of `episode`. Also returns what is
    /// left.
    pub fn open(path: &Path, episode: u64) -> Result<(Self, KeptLog)> {
        let mut file = AppendFile::open(path)?;
        let kept = KeptLog::read(path, episode)?;
        file.cut(&kept.bytes)?;
        Ok((Self { file, summing: results_until(&kept.bytes, u64::MAX) }, kept))
    }

    /// Appends one line.
    pub fn append(&mut self, logged: &LoggedEvent) -> Result<()> {
        let line = file::json_line(logged)?;
        self.file.append(&line)?;
        result_of(&line).into_iter().for_each(|result| self.summing.add(result));
        Ok(())
    }

    /// The sum of the results, without their times.
    pub fn sum(&self) -> Sum {
        self.summing.sum()
    }

    /// Waits until everything is on disk.
    pub fn sync(&self) -> Result<()> {
        self.file.sync()
    }
}

/// The sum of the results in a log up to `episode`, without their times.
pub(super) fn sum_until(path: &Path, episode: u64) -> Result<Sum> {
    Ok(results_until(&file::read(path)?, episode).sum())
}

fn results_until(bytes: &[u8], episode: u64) -> Summing {
    let mut summing = Summing::default();
    for line in file::whole_lines(bytes).split_inclusive(|&byte| byte == b'\n') {
        let Some(result) = result_of(line) else { continue };
        let number = RESULTS.into_iter().find_map(|start| file::leading_number(result, start));
        if number.is_some_and(|number| number > episode) {
            break;
        }
        summing.add(result);
    }
    summing
}

/// How lines with results go on after their time, up to the episode.
const RESULTS: [&[u8]; 2] = [b",\"type\":\"episode_finished\",\"episode\":", b",\"type\":\"evaluated\",\"episode\":"];

/// The part of a line after its time, if it records a result: it is the same whenever the run is repeated.
fn result_of(line: &[u8]) -> Option<&[u8]> {
    let after_time = &line[line.iter().position(|byte| *byte == b',')?..];
    RESULTS.iter().any(|start| after_time.starts_with(start)).then_some(after_time)
}

/// Checks that no episode is missing before that of an event; `last` is the last one before.
fn check_order(path: &Path, line: u64, last: u64, event: &Event) -> Result<()> {
    match event {
        Event::EpisodeFinished(record) if record.episode > last + 1 => {
            let reason = format!("episode {} follows episode {last}: those between are missing", record.episode);
            Err(RunError::malformed(path, Some(line), reason))
        }
        _ => Ok(()),
    }
}

/// The part of a log that belongs to a checkpoint of `episode`: see [`KeptLog::read`].
///
/// A run that was stopped or paused when no checkpoint was due has one without an event: it belongs
/// to the log as it was before the stop or the pause.
///
/// The rest has also the damage after the last kept episode, and the final events of a process that
/// was killed before it could log the checkpoint.
fn kept_until(path: &Path, mut bytes: Vec<u8>, episode: u64) -> Result<KeptLog> {
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
    Ok(KeptLog { bytes, events, has_checkpoint: after_checkpoint.is_some() })
}

/// Lines that end with a line feed, counted from 1; a half-written last line is left out.
fn complete_lines(bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let lines = file::whole_lines(bytes).split_inclusive(|&byte| byte == b'\n');
    (1..).zip(lines.map(|line| &line[..line.len() - 1]))
}

fn parse(path: &Path, number: u64, line: &[u8]) -> Result<LoggedEvent> {
    serde_json::from_slice(line).map_err(|error| RunError::Malformed {
        path: path.to_path_buf(),
        line: Some(number),
        reason: format!("not an event: {}", json::message(&error)),
    })
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
#[derive(Debug)]
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
    let mut file = BufReader::new(file::open(path).map_err(RunError::io("read", path))?);
    let (mut line, mut last) = (Vec::new(), 0);
    for number in 1.. {
        line.clear();
        file.read_until(b'\n', &mut line).map_err(RunError::io("read", path))?;
        if line.pop() != Some(b'\n') {
            break;
        }
        let logged = parse(path, number, &line)?;
        check_order(path, number, last, &logged.event)?;
        if let Some(record) = logged.event.record() {
            last = record.episode;
        }
        visit(logged);
    }
    Ok(())
}

/// The events in the last `bytes` bytes of a log, oldest first, without invalid lines.
pub(super) fn read_tail(path: &Path, bytes: u64) -> Result<Vec<LoggedEvent>> {
    let (tail, _) = file::read_end(path, bytes)?;
    Ok(complete_lines(&tail).filter_map(|(_, line)| serde_json::from_slice(line).ok()).collect())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::event::EpisodeRecord;

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

    fn episode(episode: u64) -> Event {
        Event::EpisodeFinished(EpisodeRecord { episode, ..Default::default() })
    }

    fn checkpointed(episode: u64) -> Event {
        Event::Checkpointed { episode, names: vec!["last".into()] }
    }

    struct Log {
        _folder: tempfile::TempDir,
        path: PathBuf,
        clock: f64,
    }

    impl Log {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("events.jsonl");
            Self { _folder: folder, path, clock: 0.0 }
        }

        fn write(&mut self, from: u64, events: &[Event]) {
            let (mut log, _) = EventLog::open(&self.path, from).unwrap();
            for event in events {
                self.clock += 1.0;
                log.append(&LoggedEvent { time: self.clock, event: event.clone() }).unwrap();
            }
        }

        fn raw(&self, text: &str) {
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

    fn lines(events: &[Event]) -> String {
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
        let error = EventLog::open(&log.path, 5).unwrap_err();
        assert!(matches!(error, RunError::LogTooShort { last: 1, checkpoint: 5, .. }), "{error}");

        let log = Log::new();
        log.raw(&lines(&[episode(1)]));
        log.raw("rubbish\n");
        log.raw(&lines(&[episode(2), checkpointed(2)]));
        let error = EventLog::open(&log.path, 2).unwrap_err();
        assert!(error.to_string().contains("line 2: not an event"), "{error}");
        assert_eq!(read_tail(&log.path, 1 << 16).unwrap().len(), 3);
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
