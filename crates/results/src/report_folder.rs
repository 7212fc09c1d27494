//! The files of a report: `report.md`, `report.html`, `report.json` and figures in one folder.

use std::path::PathBuf;

use serde::Serialize;

use super::page::{PAGE, page};
use mge_base::atomic::Target;
use mge_base::sync::hold_folder;
use mge_base::{json, markdown};
use mge_run::RunError;

/// The folder of a report.
#[derive(Debug, Clone)]
pub struct ReportFolder {
    folder: Target,
    text: Target,
    page: Target,
    data: Target,
}

impl ReportFolder {
    /// The report in `folder`, before the work on it.
    ///
    /// # Errors
    /// When a file of another origin is in the place of the report.
    pub fn new(folder: impl Into<Target>) -> Result<Self, RunError> {
        let folder = folder.into();
        let [text, page, data] = ["report.md", "report.html", "report.json"].map(|name| folder.join(name));
        text.check(&markdown::REPORT).map_err(RunError::io("write", &text.path))?;
        page.check(&PAGE).map_err(RunError::io("write", &page.path))?;
        data.check(&json::RESULTS).map_err(RunError::io("write", &data.path))?;
        Ok(Self { folder, text, page, data })
    }

    /// Keeps other processes from writing a report into the folder, until what is returned is dropped.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn hold(&self) -> Result<impl Sized + use<>, RunError> {
        let path = &self.folder.path;
        std::fs::create_dir_all(path).map_err(RunError::io("create", path))?;
        hold_folder(path, || true).map_err(RunError::io("write into", path))
    }

    /// The folder of the figures, which is created.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn figures(&self) -> Result<Target, RunError> {
        let figures = self.folder.join("figures");
        std::fs::create_dir_all(&figures.path).map_err(RunError::io("create", &figures.path))?;
        Ok(figures)
    }

    /// Writes the report for programs and for people, after its figures. Returns the path of the text.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, data: &impl Serialize, text: &str) -> Result<PathBuf, RunError> {
        json::write(&self.data, data).map_err(RunError::io("write", &self.data.path))?;
        self.text.write(text.as_bytes(), &markdown::REPORT).map_err(RunError::io("write", &self.text.path))?;
        let page = page(text, &self.folder.path);
        self.page.write(page.as_bytes(), &PAGE).map_err(RunError::io("write", &self.page.path))?;
        Ok(self.text.path.clone())
    }
}
