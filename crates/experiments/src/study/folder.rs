//! The folder of a study: it belongs to one plan, and existing files are reused.

use std::path::PathBuf;

use serde::Serialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use super::error::StudyError;
use mge_base::atomic::Target;
use mge_base::json;
use mge_base::markdown;
use mge_base::sync::hold_folder;
use mge_run::{RunError, read_optional};

/// A study's folder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Folder<'a>(pub &'a Target);

impl Folder<'_> {
    /// Creates the folder with its subfolders `parts`, and binds it to `plan`. The study ends with a file `report`.
    ///
    /// # Errors
    /// When it holds the study of another plan or another file `report`, or cannot be written.
    pub fn claim(&self, plan: &impl Serialize, parts: &[&str], report: &str) -> Result<(), StudyError> {
        let report = self.0.join(report);
        report.check(&markdown::REPORT).map_err(RunError::io("write", &report.path))?;
        for part in parts {
            let path = self.path(part);
            std::fs::create_dir_all(&path).map_err(RunError::io("create", &path))?;
        }
        let _alone = hold_folder(&self.0.path, || true).map_err(RunError::io("write into", &self.0.path))?;
        let path = self.path("plan.json");
        match read_optional(&path)? {
            Some(found) if found == json::pretty(plan).as_bytes() => Ok(()),
            Some(found) if serde_json::from_slice::<IgnoredAny>(&found).is_err() => Err(StudyError::Plan { path }),
            Some(_) => Err(StudyError::OtherStudy { path: self.0.path.clone() }),
            None => self.write_json("plan.json", plan),
        }
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path.join(name)
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
        let to = self.0.join(name);
        Ok(json::write(&to, value).map_err(RunError::io("write", &to.path))?)
    }

    /// Writes a report.
    pub fn write_report(&self, name: &str, text: &str) -> Result<(), StudyError> {
        let to = self.0.join(name);
        Ok(to.write(text.as_bytes(), &markdown::REPORT).map_err(RunError::io("write", &to.path))?)
    }
}
