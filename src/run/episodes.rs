//! `episodes.jsonl`: what was done in every episode, one line each, so that it can be
//! played again. The rest follows from the physics.

use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::append::AppendFile;
use super::{Result, RunError};

/// One action of an episode that was played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayedAction {
    /// Where the tool was to be placed, normalised.
    pub action: [f32; 2],
    /// It was drawn from the action clusters.
    pub guided: bool,
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

/// The writing end of `episodes.jsonl`.
#[derive(Debug)]
pub(super) struct EpisodeLog {
    file: AppendFile,
}

impl EpisodeLog {
    /// Opens the file and removes what comes after `episode`, and a half-written line.
    pub fn open(path: &Path, episode: u64) -> Result<Self> {
        let mut file = AppendFile::open(path)?;
        let bytes = std::fs::read(path).map_err(RunError::io("read", path))?;
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
        Ok(Self { file })
    }

    /// Makes sure that all of it is on the disk.
    pub fn sync(&self) -> Result<()> {
        self.file.sync()
    }

    /// Appends one episode.
    pub fn append(&mut self, played: &PlayedEpisode) -> Result<()> {
        let malformed = |error: serde_json::Error| RunError::Malformed {
            path: self.file.path().to_path_buf(),
            line: None,
            reason: error.to_string(),
        };
        let mut line = serde_json::to_vec(played).map_err(malformed)?;
        line.push(b'\n');
        self.file.append(&line)
    }
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
    let file = std::fs::File::open(path).map_err(RunError::io("read", path))?;
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
                reason: format!("not an episode: {error}"),
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
        let action = PlayedAction { action: [0.1 + episode as f32, -0.3], guided: episode.is_multiple_of(2) };
        PlayedEpisode { episode, shift: [0.0, 0.01], actions: vec![action; 3] }
    }

    #[test]
    fn episodes_are_read_back_and_cut_with_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.jsonl");
        let mut log = EpisodeLog::open(&path, 0).unwrap();
        (1..=5).for_each(|episode| log.append(&played(episode)).unwrap());
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
        let error = read_episode(&path, 6).unwrap_err().to_string();
        assert!(error.contains("episode 6"), "{error}");

        std::fs::OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut file| std::io::Write::write_all(&mut file, b"{\"episode\":6,\"shi"))
            .unwrap();
        assert!(matches!(read_episode(&path, 6), Err(RunError::NoEpisode { .. })));
        let mut log = EpisodeLog::open(&path, 3).unwrap();
        log.append(&played(4)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));

        let damaged = std::fs::read_to_string(&path).unwrap().replacen("\"episode\":2", "\"epizode\":2", 1);
        std::fs::write(&path, damaged).unwrap();
        drop(EpisodeLog::open(&path, 4).unwrap());
        assert_eq!(read_episode(&path, 4).unwrap(), played(4));
    }
}
