//! User notes on a run: `notes.json` in its folder. Training and comparisons ignore it.

use std::path::Path;

use educe::Educe;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::file::{check_format, parse_json};
use super::{Result, RunDirectory, RunError, file};
use mge_base::atomic::parent_of;
use mge_base::paths::entries;

/// The format of `notes.json` that this program writes, and the newest that it reads.
const FORMAT: u64 = 1;
/// Maximum number of characters of a note.
const MAX_NOTE_LENGTH: usize = 4000;
/// Maximum number of characters of a name.
const MAX_NAME_LENGTH: usize = 100;

/// Notes on a run.
#[derive(Debug, Clone, Educe, PartialEq, Eq, Serialize, Deserialize)]
#[educe(Default)]
pub struct Notes {
    #[educe(Default = FORMAT)]
    format: u64,
    /// Name that users gave the run; empty for that of its folder.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Free text.
    #[serde(default)]
    pub note: String,
    /// What else is in the file, such as the tags of earlier versions, which is kept.
    #[serde(flatten)]
    others: Map<String, Value>,
}

impl Notes {
    /// Checks lengths and the characters of the name.
    fn check(&self) -> std::result::Result<(), String> {
        let is_bad = |character: char| character.is_control() || ['/', '\\'].contains(&character);
        if self.name.chars().count() > MAX_NAME_LENGTH || self.name.starts_with('.') || self.name.contains(is_bad) {
            let what = "characters other than /, \\ and control characters, and does not begin with a dot";
            return Err(format!("a name has at most {MAX_NAME_LENGTH} {what}"));
        }
        if self.note.chars().count() > MAX_NOTE_LENGTH {
            return Err(format!("a note has at most {MAX_NOTE_LENGTH} characters"));
        }
        Ok(())
    }
}

impl RunDirectory {
    /// The notes on the run; empty if there are none.
    ///
    /// # Errors
    /// [`RunError::Io`], [`RunError::Malformed`], and [`RunError::Refused`] of another format.
    pub fn notes(&self) -> Result<Notes> {
        let path = self.notes_path();
        let Some(bytes) = file::read_optional(&path)? else { return Ok(Notes::default()) };
        check_format(&path, &bytes, FORMAT)?;
        let notes: Notes = parse_json(&path, &bytes)?;
        notes.check().map_err(|reason| RunError::Malformed { path, line: None, reason })?;
        Ok(notes)
    }

    /// The name of the run: the one that users gave it, or else that of its folder.
    pub fn name(&self) -> String {
        let given = self.given_name();
        if given.is_empty() {
            self.path().file_name().unwrap_or_default().to_string_lossy().into_owned()
        } else {
            given
        }
    }

    /// The name that users gave the run; empty if they gave none.
    pub fn given_name(&self) -> String {
        // Unreadable notes count as none here; writing new ones reports the error.
        self.notes().map_or_else(|_| String::new(), |notes| notes.name)
    }

    /// The run beside a missing one, or in the usual folder of runs, that users gave the name of that, in words.
    pub fn named_so(missing: &Path, usual: &Path) -> Option<String> {
        let name = missing.file_name()?.to_string_lossy();
        let beside = [parent_of(missing), usual].into_iter().flat_map(|folder| entries(folder).unwrap_or_default());
        let run = beside.into_iter().find(|run| Self::at(run).given_name() == name)?;
        Some(format!(": the run in {} has that name", run.display()))
    }

    /// Changes the notes on the run. This is allowed during training, which does not use them. Of changes by several
    /// processes at the same time, none is lost.
    ///
    /// # Errors
    /// [`RunError::Refused`] if they are invalid, [`RunError::Io`] if they cannot be written.
    pub fn change_notes(&self, change: impl FnOnce(&mut Notes)) -> Result<()> {
        self.in_turn(|| {
            let mut notes = self.notes()?;
            change(&mut notes);
            notes.check().map_err(RunError::Refused)?;
            file::write_json(&self.notes_path(), &notes)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_kept_in_the_folder_of_the_run_and_bad_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        assert_eq!(run.notes().unwrap(), Notes::default());
        let notes = Notes { note: "the first that works".into(), ..Notes::default() };
        let write = |new: &Notes| run.change_notes(|notes| notes.clone_from(new));
        write(&notes).unwrap();
        assert_eq!(run.notes().unwrap(), notes);
        for bad in [
            Notes { note: "x".repeat(4001), ..Notes::default() },
            Notes { name: "a/b".into(), ..Notes::default() },
            Notes { name: "x".repeat(101), ..Notes::default() },
        ] {
            assert!(matches!(write(&bad), Err(RunError::Refused(_))), "{bad:?}");
            assert_eq!(run.notes().unwrap(), notes, "the notes are unchanged");
            // The same notes written by another program are rejected as well.
            std::fs::write(run.notes_path(), serde_json::to_vec(&bad).unwrap()).unwrap();
            assert!(matches!(run.notes(), Err(RunError::Malformed { .. })), "{bad:?}");
            std::fs::remove_file(run.notes_path()).unwrap();
            write(&notes).unwrap();
        }
        assert_eq!(run.name(), folder.path().file_name().unwrap().to_str().unwrap());
        run.change_notes(|notes| notes.name = "the best".into()).unwrap();
        assert_eq!(run.name(), "the best");
        std::fs::write(run.notes_path(), r#"{"format": 1, "tags": ["paper"], "note": "of 0.1.0"}"#).unwrap();
        run.change_notes(|notes| notes.note = "anew".into()).unwrap();
        let written = std::fs::read_to_string(run.notes_path()).unwrap();
        assert!(written.contains("paper") && written.contains("anew"), "{written}");
        std::fs::write(run.notes_path(), r#"{"format": 9}"#).unwrap();
        assert!(matches!(run.notes(), Err(RunError::Refused(_))));
    }
}
