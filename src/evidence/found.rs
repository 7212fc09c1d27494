//! Runs in folders, read with their training results.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::charges::Charges;
use super::row::TrainedRun;
use super::settings::distinguish;
use crate::run::{RunDirectory, RunError, RunHistory, RunState};
use crate::trainer::RunConfig;

/// Runs that are read in parallel, between two reports of progress.
const READ_AT_ONCE: usize = 32;

/// A run on disk.
#[derive(Debug, Clone)]
pub struct FoundRun {
    /// Its folder.
    pub path: PathBuf,
    /// Whether it is being trained, or how it ended.
    pub state: RunState,
    /// Its configuration.
    pub config: RunConfig,
    /// Its training results.
    pub trained: TrainedRun,
}

impl FoundRun {
    /// Name of its folder.
    pub fn name(&self) -> String {
        self.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }
}

/// The folders of runs in `folders`, in order of their names: each is a run itself, or holds
/// runs, or holds them in its folder `runs`. One that is named twice is one.
///
/// # Errors
/// [`RunError::NoRuns`] for a folder without runs; [`RunError::Io`].
pub fn find_runs(folders: &[PathBuf]) -> Result<Vec<PathBuf>, RunError> {
    let mut found = Vec::new();
    for folder in folders {
        if is_run(folder) {
            found.push(folder.clone());
            continue;
        }
        let inner = folder.join("runs");
        let runs = runs_in(if inner.is_dir() { &inner } else { folder })?;
        if runs.is_empty() {
            return Err(RunError::NoRuns(folder.clone()));
        }
        found.extend(runs);
    }
    let mut known = BTreeSet::new();
    // A path that cannot be resolved is reported when it is read.
    found.retain(|path| std::fs::canonicalize(path).map_or(true, |path| known.insert(path)));
    Ok(found)
}

fn is_run(folder: &Path) -> bool {
    folder.join("config.json").is_file()
}

fn runs_in(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    let entries = std::fs::read_dir(folder).map_err(RunError::io("read", folder))?;
    let paths: Result<Vec<PathBuf>, _> = entries.map(|entry| entry.map(|entry| entry.path())).collect();
    let mut runs = paths.map_err(RunError::io("read", folder))?;
    runs.retain(|path| is_run(path));
    runs.sort();
    Ok(runs)
}

/// Reads runs, each with the settings in which it differs from the others (see [`distinguish`]).
///
/// # Errors
/// When a run cannot be read.
pub fn read_runs(paths: &[PathBuf]) -> Result<Vec<FoundRun>, RunError> {
    read_runs_with_progress(paths, &mut |_| {})
}

/// As [`read_runs`]; `on_progress` is called with the number of runs that have been read.
///
/// # Errors
/// As [`read_runs`].
pub fn read_runs_with_progress(
    paths: &[PathBuf],
    on_progress: &mut dyn FnMut(usize),
) -> Result<Vec<FoundRun>, RunError> {
    let mut runs = Vec::new();
    for some in paths.chunks(READ_AT_ONCE) {
        runs.extend(some.par_iter().map(|path| read_run(path)).collect::<Result<Vec<FoundRun>, RunError>>()?);
        on_progress(runs.len());
    }
    let mut charges = Charges::default();
    for run in &mut runs {
        run.trained.charged = charges.of(&run.config);
    }
    distinguish(runs.iter_mut().map(|run| (&run.config, &mut run.trained.row)).collect());
    Ok(runs)
}

fn read_run(path: &Path) -> Result<FoundRun, RunError> {
    let directory = RunDirectory::open(path)?;
    let config: RunConfig = directory.config()?;
    let history = match RunHistory::read(&directory) {
        // It was created, but has not begun.
        Err(error) if error.is_not_found() => RunHistory::default(),
        read => read?,
    };
    let trained = TrainedRun::new(&config, &history);
    Ok(FoundRun { path: path.to_owned(), state: directory.status()?.state, config, trained })
}
