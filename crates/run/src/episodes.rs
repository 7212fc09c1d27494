//! `episodes.jsonl`: the actions of every episode, one line each, so that it can be replayed.
//! Everything else follows from the physics.

use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::append::AppendFile;
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
    source: Option<Source>,
}

impl From<ActionLine> for PlayedAction {
    fn from(line: ActionLine) -> Self {
        let by_flag = if line.guided { Source::Clusters } else { Source::Policy };
        Self { action: line.action, source: line.source.unwrap_or(by_flag) }
    }
}

impl From<PlayedAction> for ActionLine {
    fn from(played: PlayedAction) -> Self {
        let source =
            Some(played.source).filter(|source| matches!(source, Source::Planner | Source::Hand | Source::Recorded));
        Self { action: played.action, guided: played.source == Source::Clusters, source }
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
    /// Its actions, in order.
    pub actions: Vec<PlayedAction>,
}

/// Opens `episodes.jsonl` for writing and removes everything after `episode` and a half-written last line.
pub(super) fn open(path: &Path, episode: u64) -> Result<AppendFile> {
    let file = AppendFile::open(path)?;
    file.cut(read_until(path, episode)?.len())?;
    Ok(file)
}

/// The file up to `episode`.
pub(super) fn read_until(path: &Path, episode: u64) -> Result<Vec<u8>> {
    let mut bytes = file::read(path)?;
    let (mut end, mut kept) = (0, 0);
    // A damaged line loses only its own episode, not those after it.
    for line in file::whole_lines(&bytes).split_inclusive(|byte| *byte == b'\n') {
        end += line.len();
        if number_of(line).is_some_and(|number| number <= episode) {
            kept = end;
        }
    }
    bytes.truncate(kept);
    Ok(bytes)
}

/// An episode of a run, which another process may still be training.
///
/// # Errors
/// [`RunError::Io`] if there is no such file, [`RunError::Refused`] if it does not contain the
/// episode or it is just being written, [`RunError::Malformed`] if its line is not an episode.
pub fn read_episode(path: &Path, episode: u64) -> Result<PlayedEpisode> {
    let mut file = BufReader::new(file::open(path).map_err(RunError::io("read", path))?);
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        file.read_until(b'\n', &mut line).map_err(RunError::io("read", path))?;
        if !line.ends_with(b"\n") {
            break;
        }
        // Damaged lines have no number.
        match number_of(&line) {
            Some(found) if found == episode => {
                let malformed = |error| {
                    RunError::malformed(path, Some(number), format!("not an episode: {}", json::message(&error)))
                };
                return serde_json::from_slice(&line).map_err(malformed);
            }
            Some(found) if found > episode => break,
            _ => {}
        }
    }
    Err(RunError::Refused(format!("{}: there is no episode {episode} in it", path.display())))
}

/// The number of a line's episode, which is its first field.
fn number_of(line: &[u8]) -> Option<u64> {
    let digits = line.strip_prefix(b"{\"episode\":")?.split(|byte| *byte == b',').next()?;
    std::str::from_utf8(digits).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(episode: u64) -> PlayedEpisode {
        let source = if episode.is_multiple_of(2) { Source::Clusters } else { Source::Policy };
        let action = PlayedAction { action: [0.1 + episode as f32, -0.3], source };
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
            let played = PlayedAction { action: [0.5, -0.5], source };
            assert_eq!(serde_json::to_string(&played).unwrap(), line);
            assert_eq!(serde_json::from_str::<PlayedAction>(line).unwrap(), played);
        }
    }

    #[test]
    fn every_episode_of_a_long_damaged_file_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.jsonl");
        let mut text = String::new();
        for episode in 1..=3000 {
            let line = serde_json::to_string(&played(episode)).unwrap();
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
            assert!(matches!(read_episode(&path, episode), Err(RunError::Refused(_))), "{episode}");
        }
        let error = read_episode(&path, 2500).unwrap_err();
        assert!(matches!(error, RunError::Malformed { line: Some(2500), .. }), "{error}");
    }

    #[test]
    fn episodes_round_trip_and_are_truncated_with_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.jsonl");
        let mut log = open(&path, 0).unwrap();
        (1..=5).for_each(|episode| log.append_json(&played(episode)).unwrap());
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
        let error = read_episode(&path, 6).unwrap_err().to_string();
        assert!(error.contains("episode 6"), "{error}");

        std::fs::OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut file| std::io::Write::write_all(&mut file, b"{\"episode\":6,\"shi"))
            .unwrap();
        assert!(matches!(read_episode(&path, 6), Err(RunError::Refused(_))));
        let mut log = open(&path, 3).unwrap();
        log.append_json(&played(4)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));

        let damaged = std::fs::read_to_string(&path).unwrap().replacen("\"episode\":2", "\"epizode\":2", 1);
        std::fs::write(&path, damaged).unwrap();
        open(&path, 9).unwrap();
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
    }
}
