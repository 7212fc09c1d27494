//! The folder of a study: it belongs to one plan, and existing files are reused.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use super::error::StudyError;
use crate::json;
use crate::run::{RunError, read_optional};

/// A study's folder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Folder<'a>(pub &'a Path);

impl Folder<'_> {
    /// Creates the folder with its subfolders `parts`, and binds it to `plan`.
    ///
    /// # Errors
    /// When it holds the study of another plan, or cannot be written.
    pub fn claim(&self, plan: &impl Serialize, parts: &[&str]) -> Result<(), StudyError> {
        for part in parts {
            let path = self.path(part);
            std::fs::create_dir_all(&path).map_err(RunError::io("create", &path))?;
        }
        let path = self.path("plan.json");
        match read_optional(&path)? {
            Some(found) if found == json::pretty(plan).as_bytes() => Ok(()),
            Some(found) if serde_json::from_slice::<IgnoredAny>(&found).is_err() => Err(StudyError::Plan { path }),
            Some(_) => Err(StudyError::OtherStudy { path: self.0.to_owned() }),
            None => self.write("plan.json", json::pretty(plan).as_bytes()),
        }
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The value in a file of the study; if there is no such file, makes it and saves it there. None if `make` was
    /// stopped.
    pub fn cached<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        make: impl FnOnce() -> Result<Option<T>, StudyError>,
    ) -> Result<Option<T>, StudyError> {
        if let Some(value) = self.read(name)? {
            return Ok(Some(value));
        }
        let value = make()?;
        if let Some(value) = &value {
            self.write_json(name, value)?;
        }
        Ok(value)
    }

    /// The value in a file of the study; None if there is no such file.
    pub fn read<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, StudyError> {
        let path = self.path(name);
        let Some(text) = read_optional(&path)? else { return Ok(None) };
        serde_json::from_slice(&text)
            .map(Some)
            .map_err(|error| StudyError::Content { path, message: error.to_string() })
    }

    /// Writes a value as JSON.
    pub fn write_json(&self, name: &str, value: &impl Serialize) -> Result<(), StudyError> {
        self.write(name, json::pretty(value).as_bytes())
    }

    /// Writes a file atomically.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), StudyError> {
        let path = self.path(name);
        Ok(crate::atomic::write(&path, bytes).map_err(RunError::io("write", &path))?)
    }
}
