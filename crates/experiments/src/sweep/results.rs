//! The results of a sweep: one row per run, as CSV and JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::error::SweepError;
use super::models::{ModelResult, RESULT, short};
use mge_base::atomic::{Format, Target};
use mge_base::json;
use mge_base::sync::hold_folder;
use mge_results::{FoundRun, RunReader, Settings, complete, find_runs, leaf_settings};
use mge_run::{RunDirectory, RunError, read_optional};

/// The results of a sweep, as a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Results {
    /// Format version.
    pub version: u32,
    /// `train` or `dynamics`.
    pub kind: &'static str,
    /// The rows, ordered by the names of the runs with numbers as numbers. All have the same columns: also the settings
    /// in which any two runs differ, with their effective values. Null are missing measures and settings that a run
    /// does not use.
    pub rows: Vec<BTreeMap<String, Value>>,
    /// The columns in order.
    #[serde(skip)]
    columns: Vec<String>,
}

/// Whether a run is that of an agent or of a dynamics model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Agent,
    Model,
}

/// The kind of a run in a sweep's folder.
pub(super) fn kind_of(path: &Path) -> Result<Kind, SweepError> {
    Ok(if RunDirectory::open(path)?.is_of_model()? { Kind::Model } else { Kind::Agent })
}

/// The formats of the two files of results.
const TABLE: Format<'static> =
    Format { name: "a table of results", suffix: "", is: &|found| found.starts_with(b"run,state,") };
const ROWS: Format<'static> = Format {
    name: "a file of results",
    suffix: "",
    is: &|found| ["kind", "rows", "version"].iter().all(|key| json::keys(found).contains(*key)),
};

/// Checks before the work on them that results may be written into the folder of a sweep.
///
/// # Errors
/// When a file of another origin is in the way.
pub fn check_results(folder: &Target) -> Result<(), SweepError> {
    for (name, format) in [("results.csv", TABLE), ("results.json", ROWS)] {
        let to = folder.join(name);
        to.check(&format).map_err(RunError::io("write", &to.path))?;
    }
    Ok(())
}

/// Writes the results of a sweep's folder into it, as `results.csv` and `results.json`; returns the path of the first.
/// Of several processes that do so at the same time, the last one has read the results of the others.
///
/// # Errors
/// When a run cannot be read, there are both agents and models, or the results cannot be written.
pub fn write_results(folder: &Target) -> Result<PathBuf, SweepError> {
    let _alone = hold_folder(&folder.path, || true).map_err(RunError::io("write into", &folder.path))?;
    let (results, damaged) = readable_results(&folder.path)?;
    // A damaged run does not withhold the results of the others.
    let written = results.write(folder)?;
    damaged.map_or(Ok(written), |error| Err(error.into()))
}

/// Reads the results of all runs in a sweep's folder that have a configuration.
///
/// # Errors
/// When a run cannot be read, or there are both agents and models.
#[cfg(test)]
pub fn read_results(folder: &Path) -> Result<Results, SweepError> {
    let (results, damaged) = readable_results(folder)?;
    damaged.map_or(Ok(results), |error| Err(error.into()))
}

/// The results of the runs that can be read, and why the first of the others cannot.
fn readable_results(folder: &Path) -> Result<(Results, Option<RunError>), SweepError> {
    let mut paths = runs_of(folder)?;
    paths.retain(|path| !matches!(RunDirectory::open(path), Err(RunError::NotARun(_))));
    match common_kind(&paths)? {
        Kind::Agent => {
            let read = RunReader::default().read(&paths, &mut |_| {});
            Ok((agents(&read.runs), read.unreadable.into_iter().next().map(|(_, error)| error)))
        }
        Kind::Model => Ok((models(&paths)?, None)),
    }
}

/// The runs of a sweep, without others that its folder may hold beside them.
pub(super) fn runs_of(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    find_runs(&[folder.join("runs")])
}

/// The common kind of all runs.
pub(super) fn common_kind(paths: &[PathBuf]) -> Result<Kind, SweepError> {
    let mut seen: [Option<&PathBuf>; 2] = [None, None];
    for path in paths {
        seen[usize::from(kind_of(path)? == Kind::Model)].get_or_insert(path);
    }
    match seen {
        [Some(agent), Some(model)] => Err(SweepError::Mixed { agent: agent.clone(), model: model.clone() }),
        [None, _] => Ok(Kind::Model),
        [_, None] => Ok(Kind::Agent),
    }
}

/// The settings in which a run differs from others.
fn differing(run: &FoundRun) -> impl Iterator<Item = (&String, &Value)> {
    run.trained.row.settings.iter().chain(&run.trained.row.implied)
}

fn agents(runs: &[FoundRun]) -> Results {
    let before = ["run", "state", "task", "method", "epsilon"];
    let after = [
        "seed",
        "episodes",
        "episodes_done",
        "episodes_to_50",
        "episodes_to_80",
        "auc",
        "final_success",
        "held_success",
        "greedy_success",
    ];
    let settings: BTreeSet<&str> = runs.iter().flat_map(differing).map(|(path, _)| path.as_str()).collect();
    let settings = settings.into_iter().filter(|key| !before.contains(key) && !after.contains(key));
    let columns: Vec<String> = before.into_iter().chain(settings).chain(after).map(str::to_owned).collect();
    let row = |run: &FoundRun| {
        // Plain data always serialises.
        let row = serde_json::to_value(&run.trained.row).expect("a row is plain data");
        let setting = |column: &str| differing(run).find(|(path, _)| *path == column).map(|(_, value)| value.clone());
        let value = |column: &str| match column {
            "run" => Some(run.name().into()),
            "state" => Some(run.state.name().into()),
            // A constant threshold is a number.
            "epsilon" if !run.config.method.uses(column) => None,
            "epsilon" => serde_json::from_str(&run.trained.row.epsilon).ok().or_else(|| row.get(column).cloned()),
            "episodes" => Some(run.config.episodes.into()),
            "episodes_done" => row.get("episodes").cloned(),
            column => row.get(column).cloned().or_else(|| setting(column)),
        };
        columns.iter().map(|column| (column.clone(), value(column).unwrap_or(Value::Null))).collect()
    };
    Results { version: 1, kind: "train", rows: runs.iter().map(row).collect(), columns }
}

/// The columns of a model's results, except the rollout errors.
const MEASURES: [&str; 5] = ["epochs_done", "train_loss", "validation_loss", "one_step_error", "action_error"];

fn models(paths: &[PathBuf]) -> Result<Results, SweepError> {
    let (mut settings, mut found) = (Vec::new(), Vec::new());
    for path in paths {
        let config: Value = RunDirectory::open(path)?.config()?;
        let file = path.join(RESULT);
        let result = read_optional(&file)?.map_or(Ok(Value::Null), |bytes| checked::<ModelResult>(&bytes, &file))?;
        let mut own = leaf_settings(&config);
        own.insert("tools".to_owned(), names(&config["tools"]).join(",").into());
        // Older files leave it out where it is false.
        own.entry("model.properties".to_owned()).or_insert(false.into());
        settings.push(own);
        found.push((path, result));
    }
    let mut differing = complete(&mut settings, |_, _| true);
    differing.remove("tools");
    let actions = found.iter().filter_map(|(_, result)| Some(result.get("rollout_error")?.as_array()?.len())).max();
    let mut columns: Vec<String> = ["run", "state", "tools"].map(str::to_owned).into();
    columns.extend(differing.iter().filter(|path| *path != "training.seed").map(|path| short(path).to_owned()));
    columns.push("seed".to_owned());
    columns.extend(MEASURES.map(str::to_owned));
    columns.extend((1..=actions.unwrap_or(0)).map(|n| format!("rollout_error_{n}")));
    let row = |((path, result), settings): (&(&PathBuf, Value), &Settings)| {
        let setting = |column: &str| settings.iter().find(|(path, _)| short(path) == column).map(|(_, value)| value);
        let value = |column: &str| match column {
            "run" => Some(path.file_name()?.to_string_lossy().into_owned().into()),
            "state" => Some(model_state(result).into()),
            "epochs_done" => result.get("epochs").cloned(),
            column if MEASURES.contains(&column) => result.get(column).cloned(),
            column => match column.strip_prefix("rollout_error_") {
                Some(n) => result.get("rollout_error")?.get(n.parse::<usize>().ok()? - 1).cloned(),
                None => setting(column).cloned(),
            },
        };
        columns.iter().map(|column| (column.clone(), value(column).unwrap_or(Value::Null))).collect()
    };
    Ok(Results { version: 1, kind: "dynamics", rows: found.iter().zip(&settings).map(row).collect(), columns })
}

/// Parses a JSON file that must hold a `T`, keeping numbers as written: 0.1 and not 0.10000000149011612.
fn checked<T: DeserializeOwned>(bytes: &[u8], path: &Path) -> Result<Value, SweepError> {
    let origin = path.display().to_string();
    json::parse::<T>(bytes, &origin)?;
    Ok(json::parse(bytes, &origin)?)
}

fn model_state(result: &Value) -> &'static str {
    match result.get("diverged") {
        None => "not finished",
        Some(Value::Null) => "finished",
        Some(_) => "diverged",
    }
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

impl Results {
    /// The table as CSV.
    pub fn to_csv(&self) -> Vec<u8> {
        let text = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let cells = |row: &BTreeMap<String, Value>| -> Vec<String> {
            self.columns.iter().map(|column| row.get(column).map_or_else(String::new, text)).collect()
        };
        let rows: Vec<Vec<String>> = std::iter::once(self.columns.clone()).chain(self.rows.iter().map(cells)).collect();
        mge_base::table::to_csv(rows.iter().map(|row| row.iter().map(String::as_str)))
    }

    /// Writes `results.csv` and `results.json` into a folder; returns the path of the first.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(super) fn write(&self, folder: &Target) -> Result<PathBuf, SweepError> {
        let [csv, data] = ["results.csv", "results.json"].map(|name| folder.join(name));
        csv.write(&self.to_csv(), &TABLE).map_err(RunError::io("write", &csv.path))?;
        data.write(json::pretty(self).as_bytes(), &ROWS).map_err(RunError::io("write", &data.path))?;
        Ok(csv.path)
    }
}
