//! The index of a folder of puzzles.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{ExperimentError, Result};
use mge_base::atomic::Target;
use mge_base::bounded;
use mge_base::by_name;
use mge_base::json;
use mge_base::validation::{ValidationError, in_range};
use mge_physics::ToolKind;
use mge_run::RunError;
use mge_task::{TaskError, check_name};

/// The format version that this program writes. Puzzles of version 1, which were chosen by the success of guided play,
/// are read too.
const VERSION: u32 = 2;
/// Name of the index in its folder.
const FILE: &str = "index.json";

/// The purpose of puzzles. Equal seeds give different puzzles in each split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// For training agents and models.
    Train,
    /// For choosing settings.
    Validation,
    /// For reporting results.
    Test,
}

by_name!(Split, "split", { Train = "train", Validation = "validation", Test = "test" });

/// The puzzles of a folder, by number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Index {
    /// Format version.
    pub version: u32,
    /// Seed of the puzzles.
    pub seed: u64,
    /// Their split.
    pub split: Split,
    /// Half width of the uniform noise on the ball's start, normalised.
    pub start_noise: f32,
    /// The puzzles.
    pub puzzles: Vec<Puzzle>,
}

/// A generated puzzle and how difficult it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Puzzle {
    /// Its number, from 0.
    pub number: u64,
    /// Name of its task; the task file is `NAME.json`.
    pub name: String,
    /// Types of the tools in the scene and of the placeable tool.
    pub tools: Vec<ToolKind>,
    /// Type of the tool that the agent places.
    pub placeable: ToolKind,
    /// Number of layouts before it that uniformly random play solves too often.
    #[serde(default)]
    pub too_easy: u64,
    /// Number of layouts before it that uniformly random play solves too rarely.
    #[serde(default)]
    pub too_hard: u64,
    /// Number of episodes of uniformly random play.
    pub random_episodes: u64,
    /// Number of episodes of uniformly random play that reached the goal.
    pub random_goals: u64,
}

impl Puzzle {
    /// Its task file in a folder of puzzles.
    pub fn path(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.json", self.name))
    }
}

impl Index {
    /// An index without puzzles.
    pub fn new(seed: u64, split: Split, start_noise: f32) -> Self {
        Self { version: VERSION, seed, split, start_noise, puzzles: Vec::new() }
    }

    /// The index in `folder`; None if there is no such file.
    ///
    /// # Errors
    /// When it cannot be read, is invalid, or has another version.
    pub fn load(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(FILE);
        let text = match bounded::regular(&path).and_then(|()| bounded::read(&path, bounded::TEXT)) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            read => read.map_err(RunError::io("read", &path))?,
        };
        Self::parse(&text, &path).map(Some)
    }

    /// Parses the text of an index; `path` names it in errors.
    ///
    /// # Errors
    /// When it is invalid, has another version, or the name of a puzzle is not a plain file name.
    pub fn parse(text: &[u8], path: &Path) -> Result<Self> {
        let origin = path.display().to_string();
        let index: Self = json::parse(text, &origin).map_err(|error| {
            ExperimentError::Refused(format!(
                "{error}: it is no index of puzzles: choose a folder that `mge puzzles generate` has written"
            ))
        })?;
        if !(1..=VERSION).contains(&index.version) {
            let found = index.version;
            return Err(ExperimentError::Refused(format!(
                "{origin}: the index has format version {found}, this program reads version {VERSION}: generate the puzzles again"
            )));
        }
        index.validate().map_err(|error| TaskError::Invalid { origin, error })?;
        Ok(index)
    }

    fn validate(&self) -> Result<(), ValidationError> {
        in_range(self.start_noise, "start_noise", 0.0, 1.0)?;
        for (number, puzzle) in self.puzzles.iter().enumerate() {
            check_name(&puzzle.name).map_err(|error| error.within(format_args!("puzzles[{number}]")))?;
        }
        Ok(())
    }

    /// Writes the index into `folder`, atomically.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, folder: &Target) -> Result<()> {
        let to = folder.join(FILE);
        Ok(json::write(&to, self).map_err(RunError::io("write", &to.path))?)
    }

    /// Whether `other` has the same sequence of puzzles.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let sequence = |index: &Self| (index.version, index.seed, index.split, index.start_noise);
        sequence(self) == sequence(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_names_only_files_of_its_folder() {
        let parse = |name: &str, noise: &str| {
            let puzzle = format!(
                r#"{{"number": 0, "name": "{name}", "tools": [], "placeable": "box", "too_easy": 0,
                "too_hard": 0, "random_episodes": 1, "random_goals": 0}}"#
            );
            let text = format!(
                r#"{{"version": 2, "seed": 0, "split": "test", "start_noise": {noise}, "puzzles": [{puzzle}]}}"#
            );
            Index::parse(text.as_bytes(), Path::new("index.json")).map_err(|error| error.to_string())
        };
        assert_eq!(parse("test-0-0000", "0.01").unwrap().puzzles.len(), 1);
        for name in ["../outside", "/etc/passwd", "", ".hidden", "a/b"] {
            let error = parse(name, "0.01").unwrap_err();
            assert!(error.starts_with("index.json: puzzles[0].name: "), "{error}");
        }
        let error = parse("test-0-0000", "7").unwrap_err();
        assert!(error.starts_with("index.json: start_noise: "), "{error}");
    }
}
