//! `episodes.jsonl`: what was done in every episode, one line each, so that it can be
//! played again. The rest follows from the physics.

use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::append::AppendFile;
use super::{Result, RunError, file};
use crate::json;

/// Where an action came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The actor, with or without noise.
    Policy,
    /// The action clusters.
    Clusters,
    /// A plan through the model.
    Planner,
    /// A person.
    Hand,
    /// An earlier episode that is repeated.
    Recorded,
}

/// One action of an episode that was played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "ActionLine", into = "ActionLine")]
pub struct PlayedAction {
    /// Where the tool was to be placed, normalised.
    pub action: [f32; 2],
    /// Who chose it.
    pub source: Source,
}

/// An action as it is written. `source` is left out where `guided` says it all, as it always did.
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

/// An episode that was played.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayedEpisode {
    /// Its number, counted from 1.
    pub episode: u64,
    /// How far noise shifted its start, normalised.
    pub shift: [f32; 2],
    /// Its actions, in order.
    pub actions: Vec<PlayedAction>,
}

/// Opens `episodes.jsonl` for writing and removes what comes after `episode`, and a half-written line.
pub(super) fn open(path: &Path, episode: u64) -> Result<AppendFile> {
    let mut file = AppendFile::open(path)?;
    let bytes = file::read(path)?;
    let mut kept = 0;
    let mut end = 0;
    // A line that is damaged costs its own episode, not those after it.
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        end += line.len();
        if line.ends_with(b"\n") && parse(line).is_ok_and(|played| played.episode <= episode) {
            kept = end;
        }
    }
    file.cut(kept as u64)?;
    Ok(file)
}

fn parse(line: &[u8]) -> serde_json::Result<PlayedEpisode> {
    serde_json::from_slice(line)
}

/// An episode of a run, which another process may still be training.
///
/// # Errors
/// [`RunError::Io`] if the run keeps no episodes, [`RunError::NoEpisode`] if it has not kept
/// this one or is just writing it, [`RunError::Malformed`] if its line is not an episode.
pub fn read_episode(path: &Path, episode: u64) -> Result<PlayedEpisode> {
    let file = file::open(path).map_err(RunError::io("read", path))?;
    let mut reader = BufReader::new(file);
    for number in 1.. {
        let mut line = Vec::new();
        reader.read_until(b'\n', &mut line).map_err(RunError::io("read", path))?;
        if !line.ends_with(b"\n") {
            break;
        }
        if starts_at(&line, episode) {
            return parse(&line).map_err(|error| RunError::Malformed {
                path: path.to_path_buf(),
                line: Some(number),
                reason: format!("not an episode: {}", json::message(&error)),
            });
        }
    }
    Err(RunError::NoEpisode { path: path.to_path_buf(), episode })
}

/// Whether a line is that of an episode: its number is the first thing in it.
fn starts_at(line: &[u8], episode: u64) -> bool {
    line.starts_with(format!("{{\"episode\":{episode},").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(episode: u64) -> PlayedEpisode {
        let source = if episode.is_multiple_of(2) { Source::Clusters } else { Source::Policy };
        let action = PlayedAction { action: [0.1 + episode as f32, -0.3], source };
        PlayedEpisode { episode, shift: [0.0, 0.01], actions: vec![action; 3] }
    }

    #[test]
    fn every_source_is_kept_and_older_lines_are_read() {
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
    fn episodes_are_read_back_and_cut_with_the_run() {
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
        assert!(matches!(read_episode(&path, 6), Err(RunError::NoEpisode { .. })));
        let mut log = open(&path, 3).unwrap();
        log.append_json(&played(4)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));

        let damaged = std::fs::read_to_string(&path).unwrap().replacen("\"episode\":2", "\"epizode\":2", 1);
        std::fs::write(&path, damaged).unwrap();
        drop(open(&path, 4).unwrap());
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
    }
}
