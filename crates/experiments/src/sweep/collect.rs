//! Merges sweep folders of several machines into one.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::models::MODEL;
use super::results::{Kind, common_kind, kind_of, runs_of, runs_so_far};
use super::work::RESULT;
use crate::error::ExperimentError;
use mge_base::atomic::{NewFolder, parent_of, remove_leftovers};
use mge_base::identity::Origin;
use mge_base::sync::hold_folder;
use mge_dynamics::{Model, Provenance, checkpoint_of};
use mge_run::{self as run, Event, LoggedEvent, RunDirectory, RunError, RunState, read_events, read_optional};
use mge_trainer::RunConfig;

/// What was collected.
#[derive(Debug)]
pub struct Collected {
    /// The number of runs.
    pub runs: usize,
    /// Why each damaged run was left out.
    pub damaged: Vec<RunError>,
}

/// Copies the runs of several sweep folders into the folder `out`, which may already hold runs. Of
/// several copies of a run, the one with the most episodes or epochs is kept. Runs without a valid configuration are
/// left out.
///
/// # Errors
/// Before anything is copied: when runs of the same name have different settings or results, when a
/// run is still being trained, or when a folder holds no runs. Later: when a file cannot be copied.
pub fn collect(folders: &[PathBuf], out: &Path) -> Result<Collected, ExperimentError> {
    // Conflicts are found before anything is created.
    furthest_copies(folders, out)?;
    let runs = out.join("runs");
    fs::create_dir_all(&runs).map_err(RunError::io("create", &runs))?;
    let _alone = hold_folder(out, || true).map_err(RunError::io("write into", out))?;
    // Another process may have collected meanwhile.
    let (best, damaged) = furthest_copies(folders, out)?;
    remove_leftovers(&runs);
    for (name, path) in &best {
        let target = runs.join(name);
        if *path != target {
            replace(path, &target)?;
        }
    }
    Ok(Collected { runs: best.len(), damaged })
}

/// Of each run in the folders and in `out`, the copy with the most episodes or epochs, by name; and why the damaged runs
/// cannot be used.
fn furthest_copies(
    folders: &[PathBuf],
    out: &Path,
) -> Result<(BTreeMap<String, PathBuf>, Vec<RunError>), ExperimentError> {
    let mut all: Vec<PathBuf> = Vec::new();
    let is_out = |folder: &Path| fs::canonicalize(folder).ok() == fs::canonicalize(out).ok();
    for folder in folders.iter().filter(|folder| !is_out(folder) || !out.exists()) {
        if !folder.join("runs").is_dir() {
            return Err(ExperimentError::NotASweep(folder.clone()));
        }
        all.extend(runs_of(folder)?);
    }
    all.extend(runs_so_far(out)?);
    // What is left of a run without its configuration has no results.
    all.retain(|path| !matches!(RunDirectory::open(path), Err(RunError::NotARun(_))));
    common_kind(&all, [])?;
    let mut best: BTreeMap<String, PathBuf> = BTreeMap::new();
    let mut damaged = Vec::new();
    for path in all {
        if let Err(error) = check_config(&path) {
            damaged.push(error);
            continue;
        }
        if RunDirectory::open(&path)?.is_locked()? {
            return Err(ExperimentError::Busy(path));
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let further = match best.get(&name) {
            None => path,
            Some(other) => further(other, &path)?.to_owned(),
        };
        best.insert(name, further);
    }
    Ok((best, damaged))
}

/// Checks that a run has a valid configuration.
fn check_config(path: &Path) -> Result<(), RunError> {
    match kind_of(path)? {
        Kind::Agent => RunConfig::of(&RunDirectory::open(path)?).map(drop),
        Kind::Model | Kind::Hits => Ok(()),
    }
}

/// Epochs in the checkpoint of an unfinished model; 0 if there is none.
fn trained_epochs(path: &Path) -> u32 {
    Model::load(&checkpoint_of(&path.join(MODEL))).map_or(0, |model| model.provenance().epoch)
}

/// The copy of a run with more episodes or epochs; if equal, a finished one.
fn further<'a>(first: &'a Path, second: &'a Path) -> Result<&'a Path, ExperimentError> {
    let conflict = |problem| Err(ExperimentError::Conflict { first: first.into(), second: second.into(), problem });
    let (file, is_same) = match kind_of(first)? {
        Kind::Agent => {
            let config = |path: &Path| RunConfig::of(&RunDirectory::open(path)?);
            ("metrics.csv", config(first)?.trains_as(&config(second)?))
        }
        Kind::Model | Kind::Hits => {
            let config = |path: &Path| RunDirectory::open(path)?.config::<serde_json::Value>();
            (RESULT, config(first)? == config(second)?)
        }
    };
    if !is_same {
        return conflict("have the same name and different settings".to_owned());
    }
    // A run that has not started has no such file.
    let read = |path: &Path| read_optional(&path.join(file)).map(Option::unwrap_or_default);
    let (a, b) = (read(first)?, read(second)?);
    if !(a.starts_with(&b) || b.starts_with(&a)) {
        let differing = origin(second).changes(&origin(first)).join("; ");
        let reason = if differing.is_empty() { String::new() } else { format!(" (of the second, {differing})") };
        return conflict(format!("have the same settings and different results{reason}"));
    }
    let length = |bytes: &[u8], path| (bytes.len(), trained_epochs(path));
    let (a, b) = (length(&a, first), length(&b, second));
    if a != b {
        return Ok(if a > b { first } else { second });
    }
    let is_finished = RunDirectory::open(second)?.status()?.state == RunState::Finished;
    Ok(if is_finished { second } else { first })
}

/// The origin of a run's results, as far as it is recorded.
fn origin(path: &Path) -> Origin {
    let started = |logged: LoggedEvent| match logged.event {
        Event::Started { origin, .. } => Some(origin),
        _ => None,
    };
    if let Ok(events) = read_events(&path.join("events.jsonl")) {
        return events.into_iter().rev().find_map(started).unwrap_or_default();
    }
    let of_model = |model: Model| {
        let Provenance { crate_version: mge_version, processor, .. } = model.provenance().clone();
        Origin { mge_version, processor, models: Vec::new() }
    };
    Model::load(&path.join(MODEL)).map(of_model).unwrap_or_default()
}

/// Copies a run's folder completely, then puts the copy in the place of `target`, which goes to the trash.
fn replace(from: &Path, target: &Path) -> Result<(), ExperimentError> {
    let parent = parent_of(target);
    let new = NewFolder::create(parent).map_err(RunError::io("write", parent))?;
    copy(from, new.path())?;
    match RunDirectory::open(target) {
        Ok(old) => drop(old.discard()?),
        Err(RunError::NotARun(_)) => RunDirectory::at(target).make_room()?,
        Err(error) => return Err(error.into()),
    }
    Ok(new.rename(target).map_err(RunError::io("write", target))?)
}

/// Copies the folders and files in a folder. Links, which may lead out of it, and pipes are refused.
fn copy(from: &Path, to: &Path) -> Result<(), ExperimentError> {
    fs::create_dir_all(to).map_err(RunError::io("create", to))?;
    for entry in fs::read_dir(from).map_err(RunError::io("read", from))? {
        let entry = entry.map_err(RunError::io("read", from))?;
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type().map_err(RunError::io("read", &path))?.is_dir() {
            copy(&path, &target)?;
        } else if entry.file_name() != "lock" {
            run::copy(&path, &target)?;
        }
    }
    Ok(())
}
