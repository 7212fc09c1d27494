//! The results of a sweep: a row for each of its runs, as CSV and JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};

use super::error::SweepError;
use super::models::{ModelJob, ModelResult, RESULT, short};
use crate::evidence::{FoundRun, find_runs, read_runs};
use crate::json;
use crate::run::{RunDirectory, RunError};

/// The results of a sweep: rows of columns by name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Results {
    /// Format version.
    pub version: u32,
    /// `train` or `dynamics`.
    pub kind: &'static str,
    /// The rows, in order of the runs' names. All have the same columns; what there is not
    /// (yet) is null.
    pub rows: Vec<BTreeMap<String, Value>>,
    /// The columns in order.
    #[serde(skip)]
    columns: Vec<String>,
}

/// Whether a folder of `runs/` holds an agent or a dynamics model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Agent,
    Model,
}

/// The kind of a run in a sweep's folder.
pub(super) fn kind_of(path: &Path) -> Result<Kind, SweepError> {
    let config: Value = RunDirectory::open(path)?.config()?;
    Ok(if config.get("tools").is_some() { Kind::Model } else { Kind::Agent })
}

/// Reads the results of all runs in a sweep's folder.
///
/// # Errors
/// When a run cannot be read, or agents and models lie side by side.
pub fn read_results(folder: &Path) -> Result<Results, SweepError> {
    let paths = find_runs(&[folder.to_owned()])?;
    match common_kind(&paths)? {
        Kind::Agent => Ok(agents(&read_runs(&paths)?)),
        Kind::Model => models(&paths),
    }
}

/// The one kind of all runs.
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

fn agents(runs: &[FoundRun]) -> Results {
    let settings: BTreeSet<&String> = runs.iter().flat_map(|run| run.trained.row.settings.keys()).collect();
    let settings: Vec<&str> = settings.into_iter().map(String::as_str).filter(|key| *key != "epsilon").collect();
    let before = ["run", "state", "task", "method", "epsilon"];
    let after = [
        "seed",
        "episodes",
        "episodes_to_50",
        "episodes_to_80",
        "auc",
        "final_success",
        "held_success",
        "greedy_success",
    ];
    let row = |run: &FoundRun| {
        // Plain data always serialises.
        let row = serde_json::to_value(&run.trained.row).expect("a row is plain data");
        let value = |column: &str| match column {
            "run" => run.name().into(),
            "state" => run.state.name().into(),
            column => row.get(column).or_else(|| row.get("settings")?.get(column)).cloned().unwrap_or(Value::Null),
        };
        let columns = before.iter().chain(&settings).chain(&after);
        columns.map(|column| ((*column).to_owned(), value(column))).collect()
    };
    let columns = before.iter().chain(&settings).chain(&after).map(|column| (*column).to_owned()).collect();
    Results { version: 1, kind: "train", rows: runs.iter().map(row).collect(), columns }
}

fn models(paths: &[PathBuf]) -> Result<Results, SweepError> {
    let mut found = Vec::new();
    for path in paths {
        let settings: Value = RunDirectory::open(path)?.config()?;
        let job: ModelJob = RunDirectory::open(path)?.config()?;
        let result: Option<ModelResult> = match std::fs::read(path.join(RESULT)) {
            Ok(bytes) => Some(json::parse(&bytes, &path.join(RESULT).display().to_string())?),
            Err(_) => None,
        };
        found.push((path, settings, job, result));
    }
    let settings = differing(found.iter().map(|(_, settings, _, _)| settings));
    let actions = found.iter().filter_map(|(_, _, _, result)| Some(result.as_ref()?.rollout_error.len())).max();
    let errors: Vec<String> = (1..=actions.unwrap_or(0)).map(|n| format!("rollout_error_{n}")).collect();
    let mut columns: Vec<String> = ["run", "state", "tools"].map(str::to_owned).into();
    columns.extend(settings.iter().filter(|path| *path != "training.seed").map(|path| short(path).to_owned()));
    let measures = ["seed", "epochs_done", "train_loss", "validation_loss", "one_step_error", "action_error"];
    columns.extend(measures.map(str::to_owned));
    columns.extend(errors);
    let row = |(path, settings, job, result): &(&PathBuf, Value, ModelJob, Option<ModelResult>)| {
        let values = model_values(job, result.as_ref());
        let setting = |column: &str| {
            json::leaves(settings).into_iter().find(|(path, _)| short(path) == column).map(|(_, value)| value.clone())
        };
        let value = |column: &String| match column.as_str() {
            "run" => Some(path.file_name()?.to_string_lossy().into_owned().into()),
            column => values.get(column).cloned().or_else(|| setting(column)),
        };
        columns.iter().map(|column| (column.clone(), value(column).unwrap_or(Value::Null))).collect()
    };
    Ok(Results { version: 1, kind: "dynamics", rows: found.iter().map(row).collect(), columns })
}

/// The values of a model's row that are not settings.
fn model_values(job: &ModelJob, result: Option<&ModelResult>) -> BTreeMap<String, Value> {
    let tools = job.tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
    let mut values =
        BTreeMap::from([("tools".to_owned(), tools.into()), ("seed".to_owned(), job.training.seed.into())]);
    let Some(result) = result else {
        values.insert("state".to_owned(), "not finished".into());
        return values;
    };
    let state = if result.diverged.is_some() { "diverged" } else { "finished" };
    values.insert("state".to_owned(), state.into());
    values.insert("epochs_done".to_owned(), result.epochs.into());
    // As text first: a loss of 0.1 is to be read as 0.1.
    values.insert("train_loss".to_owned(), result.train_loss.map_or(Value::Null, short_float));
    values.insert("validation_loss".to_owned(), short_float(result.validation_loss));
    values.insert("one_step_error".to_owned(), json!(result.one_step_error));
    values.insert("action_error".to_owned(), json!(result.action_error));
    for (n, error) in result.rollout_error.iter().enumerate() {
        values.insert(format!("rollout_error_{}", n + 1), json!(error));
    }
    values
}

/// A 32-bit number with the digits it needs and no more.
fn short_float(value: f32) -> Value {
    value.to_string().parse::<f64>().map_or(Value::Null, |value| json!(value))
}

/// Paths at which the settings are not all the same.
fn differing<'a>(settings: impl Iterator<Item = &'a Value>) -> BTreeSet<String> {
    let mut first: BTreeMap<String, &Value> = BTreeMap::new();
    let mut differing = BTreeSet::new();
    for (path, value) in settings.flat_map(json::leaves) {
        if *first.entry(path.clone()).or_insert(value) != value {
            differing.insert(path);
        }
    }
    differing.remove("tools");
    differing
}

impl Results {
    /// The table as CSV.
    pub fn to_csv(&self) -> Vec<u8> {
        let text = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let mut writer = csv::Writer::from_writer(Vec::new());
        let cells = |row: &BTreeMap<String, Value>| -> Vec<String> {
            self.columns.iter().map(|column| row.get(column).map_or_else(String::new, text)).collect()
        };
        // Writing to memory does not fail, and all rows have the same columns.
        let _ = writer.write_record(&self.columns);
        for row in &self.rows {
            let _ = writer.write_record(cells(row));
        }
        writer.into_inner().unwrap_or_default()
    }

    /// Writes `results.csv` and `results.json` into a folder; returns the path of the first.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, SweepError> {
        let csv = folder.join("results.csv");
        crate::atomic::write(&csv, &self.to_csv()).map_err(RunError::io("write", &csv))?;
        let path = folder.join("results.json");
        // Plain data always serialises.
        let text = serde_json::to_string_pretty(self).expect("results are plain data") + "\n";
        crate::atomic::write(&path, text.as_bytes()).map_err(RunError::io("write", &path))?;
        Ok(csv)
    }
}
