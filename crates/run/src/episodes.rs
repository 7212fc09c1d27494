//! `episodes.jsonl`: the actions of every episode, one line each, so that it can be replayed.
//! Everything else follows from the physics.

use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::append::AppendFile;
use super::sums::{Sum, Summing};
use super::{Result, RunError, file};
use mge_base::json;

/// What chose an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The actor, with or without noise.
    Policy,
    /// The action clusters.
    Clusters,
    /// A plan through the model.
    Planner,
    /// A person, by hand.
    Hand,
    /// A recorded episode that is repeated.
    Recorded,
}

/// One action of a played episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "ActionLine", into = "ActionLine")]
pub struct PlayedAction {
    /// Requested position of the tool, normalised.
    pub action: [f32; 2],
    /// Index of the tool in the action set; none if the agent uses the task's own tool.
    pub tool: Option<usize>,
    /// What chose the action.
    pub source: Source,
}

/// The file form of an action. `source` is omitted where `guided` determines it, as in older files.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ActionLine {
    action: [f32; 2],
    guided: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tool: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    source: Option<Source>,
}

impl From<ActionLine> for PlayedAction {
    fn from(line: ActionLine) -> Self {
        let by_flag = if line.guided { Source::Clusters } else { Source::Policy };
        Self { action: line.action, tool: line.tool, source: line.source.unwrap_or(by_flag) }
    }
}

impl From<PlayedAction> for ActionLine {
    fn from(played: PlayedAction) -> Self {
        let source =
            Some(played.source).filter(|source| matches!(source, Source::Planner | Source::Hand | Source::Recorded));
        Self { action: played.action, guided: played.source == Source::Clusters, tool: played.tool, source }
    }
}

/// A played episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayedEpisode {
    /// Its number, counted from 1.
    pub episode: u64,
    /// Shift of the start by noise, normalised.
    pub shift: [f32; 2],
    /// The task's random shifts as drawn, normalised.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shifts: Vec<[f32; 2]>,
    /// The action set, as numbers in CREATE's catalogue; empty if the agent uses the task's own tool.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tools: Vec<usize>,
    /// Its actions, in order.
    pub actions: Vec<PlayedAction>,
}

/// Opens `episodes.jsonl` for writing and removes everything after `episode` and a half-written last line.
/// Also returns the number of its last episode, which is less than `episode` if the file is too short.
pub(super) fn open(path: &Path, episode: u64) -> Result<(AppendFile, u64)> {
    let mut file = AppendFile::open(path)?;
    let bytes = file::read(path)?;
    let (kept, last) = until(&bytes, episode);
    file.cut(kept)?;
    Ok((file, last))
}

/// Checks the file up to `episode` against its sum when that was the last episode. It may have been removed since, or
/// have been begun anew: only replays need it.
///
/// # Errors
/// [`RunError::Malformed`], with the first line that is not the next episode, if there is one.
pub(super) fn check(path: &Path, episode: u64, expected: &Sum) -> Result<()> {
    let bytes = file::read_optional(path)?.unwrap_or_default();
    let (kept, last) = until(&bytes, episode);
    if kept.is_empty() || Summing::of(kept).sum() == *expected {
        return Ok(());
    }
    let lines = (1..).zip(kept.split_inclusive(|byte| *byte == b'\n'));
    let damage = |(line, text): (u64, &[u8])| Some((line, json::message(&parse(text).err()?)));
    let (line, what) = match lines.into_iter().find_map(damage) {
        Some((line, message)) => (Some(line), format!("not an episode: {message}")),
        None if last < episode => (None, format!("it ends at episode {last} of {episode}")),
        None => (None, "it was changed after it was written".to_owned()),
    };
    let reason = what + ": `mge resume` accepts it as it is, without the replays that are lost";
    Err(RunError::malformed(path, line, reason))
}

/// The beginning of the file up to `episode`, and the last episode in it.
fn until(bytes: &[u8], episode: u64) -> (&[u8], u64) {
    let (mut end, mut kept, mut last) = (0, 0, 0);
    // A damaged line loses only its own episode, not those after it.
    for line in file::whole_lines(bytes).split_inclusive(|byte| *byte == b'\n') {
        end += line.len();
        if let Some(number) = number_of(line).filter(|number| *number <= episode) {
            (kept, last) = (end, number);
        }
    }
    (&bytes[..kept], last)
}

fn parse(line: &[u8]) -> serde_json::Result<PlayedEpisode> {
    serde_json::from_slice(line)
}

/// An episode of a run, which another process may still be training.
///
/// # Errors
/// [`RunError::Io`] if there is no such file, [`RunError::NoEpisode`] if it does not contain the
/// episode or it is just being written, [`RunError::Malformed`] if its line is not an episode.
pub fn read_episode(path: &Path, episode: u64) -> Result<PlayedEpisode> {
    let find = || -> std::io::Result<Option<(u64, Vec<u8>)>> {
        let file = file::open(path)?;
        let length = file.metadata()?.len();
        find_line(&mut BufReader::new(file), length, episode)
    };
    let Some((start, line)) = find().map_err(RunError::io("read", path))? else {
        return Err(RunError::NoEpisode { path: path.to_path_buf(), episode });
    };
    parse(&line).map_err(|error| RunError::Malformed {
        path: path.to_path_buf(),
        line: line_number(path, start),
        reason: format!("not an episode: {}", json::message(&error)),
    })
}

/// Ranges of up to this many bytes are searched line by line.
const NEAR: u64 = 1 << 16;

/// The line of an episode and its offset. Episodes are in order, so binary search reads little of a long file.
fn find_line(file: &mut (impl BufRead + Seek), length: u64, episode: u64) -> std::io::Result<Option<(u64, Vec<u8>)>> {
    // The line, if it exists, begins in this range.
    let (mut from, mut to) = (0, length);
    let mut line = Vec::new();
    while to - from > NEAR {
        let middle = from + (to - from) / 2;
        let mut at = file.seek(SeekFrom::Start(middle))?;
        // Skips the rest of a line, then damaged lines, which have no number.
        let found = loop {
            line.clear();
            let start = at;
            at += file.read_until(b'\n', &mut line)? as u64;
            match number_of(&line) {
                _ if line.is_empty() || start >= to => break None,
                Some(number) if start > middle => break Some((start, number)),
                _ => {}
            }
        };
        match found {
            Some((start, number)) if number <= episode => from = start,
            _ => to = middle,
        }
    }
    let mut at = file.seek(SeekFrom::Start(from))?;
    loop {
        line.clear();
        let start = at;
        at += file.read_until(b'\n', &mut line)? as u64;
        if !line.ends_with(b"\n") || number_of(&line).is_some_and(|number| number > episode) {
            return Ok(None);
        }
        if number_of(&line) == Some(episode) {
            return Ok(Some((start, line)));
        }
    }
}

/// The number of a line's episode, which is its first field.
fn number_of(line: &[u8]) -> Option<u64> {
    file::leading_number(line, b"{\"episode\":")
}

/// The number, from 1, of the line at offset `start`; `None` if the file can no longer be read.
fn line_number(path: &Path, start: u64) -> Option<u64> {
    let mut before = Vec::new();
    file::open(path).ok()?.take(start).read_to_end(&mut before).ok()?;
    Some(before.iter().filter(|byte| **byte == b'\n').count() as u64 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(episode: u64) -> PlayedEpisode {
        let source = if episode.is_multiple_of(2) { Source::Clusters } else { Source::Policy };
        let action = PlayedAction { action: [0.1 + episode as f32, -0.3], tool: None, source };
        PlayedEpisode { episode, shift: [0.0, 0.01], actions: vec![action; 3], ..PlayedEpisode::default() }
    }

    #[test]
    fn every_source_round_trips_and_older_lines_are_read() {
        for (source, line) in [
            (Source::Policy, r#"{"action":[0.5,-0.5],"guided":false}"#),
            (Source::Clusters, r#"{"action":[0.5,-0.5],"guided":true}"#),
            (Source::Planner, r#"{"action":[0.5,-0.5],"guided":false,"source":"planner"}"#),
            (Source::Hand, r#"{"action":[0.5,-0.5],"guided":false,"source":"hand"}"#),
        ] {
            let played = PlayedAction { action: [0.5, -0.5], tool: None, source };
            assert_eq!(serde_json::to_string(&played).unwrap(), line);
            assert_eq!(serde_json::from_str::<PlayedAction>(line).unwrap(), played);
        }
        let chosen = PlayedAction { action: [0.5, -0.5], tool: Some(3), source: Source::Policy };
        let line = r#"{"action":[0.5,-0.5],"guided":false,"tool":3}"#;
        assert_eq!(serde_json::to_string(&chosen).unwrap(), line);
        assert_eq!(serde_json::from_str::<PlayedAction>(line).unwrap(), chosen);
    }

    #[test]
    fn every_episode_of_a_long_damaged_file_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.jsonl");
        let mut text = String::new();
        for episode in 1..=3000 {
            let line = serde_json::to_string(&played(episode)).unwrap();
            // The damaged stretch is longer than the range that is searched line by line.
            let damaged = (1000..2000).contains(&episode);
            text += &if damaged { line.replace("episode", "epizode") } else { line };
            text.push('\n');
        }
        text = text.replacen("{\"episode\":2500,", "{\"episode\":2500,,", 1);
        std::fs::write(&path, &text).unwrap();
        for episode in (1..1000).step_by(7).chain((2000..=3000).step_by(9)).chain([999, 2000, 2999, 3000]) {
            assert_eq!(
                read_episode(&path, episode).unwrap_or_else(|error| panic!("{episode}: {error}")),
                played(episode)
            );
        }
        for episode in [0, 1000, 1500, 1999, 3001, u64::MAX] {
            assert!(matches!(read_episode(&path, episode), Err(RunError::NoEpisode { .. })), "{episode}");
        }
        let error = read_episode(&path, 2500).unwrap_err();
        assert!(matches!(error, RunError::Malformed { line: Some(2500), .. }), "{error}");
    }

    #[test]
    fn episodes_round_trip_and_are_truncated_with_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.jsonl");
        let (mut log, _) = open(&path, 0).unwrap();
        (1..=5).for_each(|episode| log.append_json(&played(episode)).unwrap());
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
        let error = read_episode(&path, 6).unwrap_err().to_string();
        assert!(error.contains("episode 6"), "{error}");

        std::fs::OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut file| std::io::Write::write_all(&mut file, b"{\"episode\":6,\"shi"))
            .unwrap();
        assert!(matches!(read_episode(&path, 6), Err(RunError::NoEpisode { .. })));
        let (mut log, last) = open(&path, 3).unwrap();
        assert_eq!(last, 3);
        log.append_json(&played(4)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));

        let damaged = std::fs::read_to_string(&path).unwrap().replacen("\"episode\":2", "\"epizode\":2", 1);
        std::fs::write(&path, damaged).unwrap();
        assert_eq!(open(&path, 9).unwrap().1, 4, "the last of a file that is too short");
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
    }
}
