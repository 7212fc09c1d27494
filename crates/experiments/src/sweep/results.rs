//! The results of a sweep: one row per run, as CSV and JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::hits::HitCounts;
use super::models::{ModelResult, short};
use super::work::result_in;
use crate::error::{ExperimentError, Result};
use mge_base::atomic::{Format, Target};
use mge_base::json;
use mge_base::sync::hold_folder;
use mge_results::{FoundRun, RunReader, Settings, complete, find_runs, leaf_settings};
use mge_run::{RunDirectory, RunError};
use mge_trainer::PriorSource;

/// The results of a sweep, as a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Results {
    /// Format version.
    pub version: u32,
    /// `train`, `dynamics` or `hits`.
    pub kind: &'static str,
    /// The rows, ordered by the names of the runs with numbers as numbers. All have the same columns: also the settings
    /// in which any two runs differ, with their effective values. Null are missing measures and settings that a run
    /// does not use.
    pub rows: Vec<BTreeMap<String, Value>>,
    /// The settings among the columns, in order.
    #[serde(skip)]
    pub(super) settings: Vec<String>,
    /// The measures among the columns, in order.
    #[serde(skip)]
    pub(super) measures: Vec<String>,
    /// All columns in order.
    #[serde(skip)]
    columns: Vec<String>,
}

/// What a folder of a sweep holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Agent,
    Model,
    Hits,
}

/// The kind of a run in a sweep's folder.
pub(super) fn kind_of(path: &Path) -> Result<Kind, RunError> {
    let directory = RunDirectory::open(path)?;
    let config: Value = directory.config()?;
    Ok(match config.get("policy") {
        Some(_) => Kind::Hits,
        None if directory.is_of_model()? => Kind::Model,
        None => Kind::Agent,
    })
}

/// The formats of the two files of results.
const TABLE: Format<'static> = Format { name: "a table of results", is: &|found| found.starts_with(b"run,state,") };
const ROWS: Format<'static> = Format {
    name: "a file of results",
    is: &|found| ["kind", "rows", "version"].iter().all(|key| json::keys(found).contains(*key)),
};

/// Checks before the work on them that results may be written into the folder of a sweep.
///
/// # Errors
/// When a file of another origin is in the way.
pub fn check_results(folder: &Target) -> Result<()> {
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
pub fn write_results(folder: &Target) -> Result<PathBuf> {
    let _alone = hold_folder(&folder.path, || true).map_err(RunError::io("write into", &folder.path))?;
    let (results, damaged) = readable_results(&folder.path)?;
    // A damaged run does not withhold the results of the others.
    let written = results.write(folder)?;
    damaged.map_or(Ok(written), Err)
}

/// The results of the runs that can be read, and why the first of the others cannot.
pub(super) fn readable_results(folder: &Path) -> Result<(Results, Option<ExperimentError>)> {
    // Without others that the folder may hold beside them.
    let mut paths = find_runs(&[folder.join("runs")])?;
    paths.retain(|path| !matches!(RunDirectory::open(path), Err(RunError::NotARun(_))));
    results_of(&paths)
}

/// The results of those of these runs that can be read, and why the first of the others cannot.
pub(crate) fn results_of(paths: &[PathBuf]) -> Result<(Results, Option<ExperimentError>)> {
    Ok(match common_kind(paths) {
        Kind::Agent => {
            let read = RunReader::default().read(paths, &mut |_| {});
            let damaged = read.unreadable.into_iter().next();
            (agents(&read.runs), damaged.map(|(_, error)| error.into()))
        }
        Kind::Model => MODELS.of_results::<ModelResult>(paths, model_settings),
        Kind::Hits => HITS.of_results::<HitCounts>(paths, hit_settings),
    })
}

/// The kind of the first run that can be read: a folder of a sweep holds one kind.
pub(super) fn common_kind(paths: &[PathBuf]) -> Kind {
    paths.iter().find_map(|path| kind_of(path).ok()).unwrap_or(Kind::Agent)
}

/// The columns of one kind of work, after those of the run and its state.
struct Layout {
    /// `train`, `dynamics` or `hits`.
    kind: &'static str,
    /// The settings that come first, also where they do not differ.
    lead: &'static [&'static str],
    /// What distinguishes repetitions.
    seeds: &'static [&'static str],
    /// What was measured.
    measures: &'static [&'static str],
    /// The measure that is a list, and the prefix of the columns of its items.
    list: (&'static str, &'static str),
}

const AGENTS: Layout = Layout {
    kind: "train",
    lead: &["task", "method", "epsilon"],
    seeds: &["seed"],
    measures: &[
        "episodes",
        "episodes_done",
        "episodes_to_50",
        "episodes_to_80",
        "actions_to_80",
        "charged_to_80",
        "charged_area",
        "auc",
        "final_success",
        "held_success",
        "greedy_success",
    ],
    // Rows of agents have no list, and no column begins so.
    list: ("none", "none_"),
};

const MODELS: Layout = Layout {
    kind: "dynamics",
    lead: &["tools"],
    seeds: &["seed"],
    measures: &[
        "epochs_done",
        "train_loss",
        "validation_loss",
        "one_step_error",
        "action_error",
        "one_step_contact_error",
        "action_contact_error",
        "precision",
        "recall",
    ],
    list: ("rollout_error", "rollout_error_"),
};

const HITS: Layout = Layout {
    kind: "hits",
    lead: &["task", "policy"],
    seeds: &["build", "seed"],
    measures: &["episodes", "goal"],
    list: ("subgoals", "subgoal_"),
};

/// The values of a run, by column.
type Values = BTreeMap<String, Value>;

impl Layout {
    /// The table of these runs, which differ in the settings `differing`.
    fn table(&self, differing: BTreeSet<String>, runs: Vec<Values>) -> Results {
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let items = |run: &Values| run.keys().filter(|column| column.starts_with(self.list.1)).count();
        let longest = runs.iter().map(items).max().unwrap_or(0);
        let measures = [owned(self.measures), (1..=longest).map(|number| self.item(number)).collect()].concat();
        let (mut settings, seeds) = (owned(self.lead), owned(self.seeds));
        let is_other = |path: &String| ![&settings, &seeds, &measures].iter().any(|columns| columns.contains(path));
        let others: Vec<String> = differing.into_iter().filter(is_other).collect();
        settings.extend(others);
        let columns = [owned(&["run", "state"]), settings.clone(), seeds, measures.clone()].concat();
        let row = |mut values: Values| {
            columns.iter().map(|column| (column.clone(), values.remove(column).unwrap_or_default())).collect()
        };
        Results { version: 1, kind: self.kind, rows: runs.into_iter().map(row).collect(), settings, measures, columns }
    }

    /// The column of an item of the list, counted from 1.
    fn item(&self, number: usize) -> String {
        format!("{}{number}", self.list.1)
    }

    /// The table of work with a `result.json`, each a `T`, of which `settings` returns the settings by their names in a
    /// sweep file, and why the first of those that cannot be read cannot.
    fn of_results<T: DeserializeOwned>(
        &self,
        paths: &[PathBuf],
        settings: fn(&Value) -> Settings,
    ) -> (Results, Option<ExperimentError>) {
        let (mut all, mut measured, mut damaged) = (Vec::new(), Vec::new(), None);
        let read = |path: &PathBuf| Ok::<_, ExperimentError>((RunDirectory::open(path)?.config()?, result::<T>(path)?));
        for path in paths {
            match read(path) {
                Ok((config, result)) => {
                    all.push(settings(&config));
                    measured.push(self.measured(path, result));
                }
                Err(error) => damaged = damaged.or(Some(error)),
            }
        }
        let differing = complete(&mut all, |_, _| true);
        let runs = all.into_iter().zip(measured).map(|(settings, measured)| settings.into_iter().chain(measured));
        (self.table(differing, runs.map(Iterator::collect).collect()), damaged)
    }

    /// The values of a result by column; none if the work is not finished.
    fn measured(&self, path: &Path, result: Option<Map<String, Value>>) -> Values {
        let state = match result.as_ref().map(|result| result.get("diverged")) {
            None => "not finished",
            Some(None | Some(Value::Null)) => "finished",
            Some(Some(_)) => "diverged",
        };
        let mut values: Values = result.into_iter().flatten().collect();
        // The setting of this name is how many are asked for.
        if let Some(epochs) = values.remove("epochs") {
            values.insert("epochs_done".to_owned(), epochs);
        }
        let items = values.remove(self.list.0).and_then(|list| list.as_array().cloned()).unwrap_or_default();
        values.extend((1..).map(|number| self.item(number)).zip(items));
        values.insert("run".to_owned(), path.file_name().unwrap_or_default().to_string_lossy().into());
        values.insert("state".to_owned(), state.into());
        values
    }
}

/// The result in a folder, which must be a `T`, with numbers as written: 0.1 and not 0.10000000149011612.
fn result<T: DeserializeOwned>(folder: &Path) -> Result<Option<Map<String, Value>>> {
    result_in::<T>(folder)?;
    result_in(folder)
}

/// The results of agents.
fn agents(runs: &[FoundRun]) -> Results {
    let values = |run: &FoundRun| {
        let row = &run.trained.row;
        let mut values: Values = row.settings.clone().into_iter().chain(row.implied.clone()).collect();
        // Plain data always serialises.
        let measures = json::to_value(row);
        values.extend(measures.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone())));
        let done = values.insert("episodes".to_owned(), run.config.episodes.into());
        values.insert("episodes_done".to_owned(), done.unwrap_or_default());
        // A constant threshold is a number.
        let epsilon = json::value_of(&row.epsilon);
        values.insert("epsilon".to_owned(), if run.config.method.uses("epsilon") { epsilon } else { Value::Null });
        values.insert("run".to_owned(), run.name().into());
        values.insert("state".to_owned(), run.state.name().into());
        values
    };
    let differing = runs.iter().flat_map(|run| run.trained.row.settings.keys().chain(run.trained.row.implied.keys()));
    AGENTS.table(differing.cloned().collect(), runs.iter().map(values).collect())
}

/// The settings of a model by their names in a sweep file.
fn model_settings(config: &Value) -> Settings {
    let mut settings = leaf_settings(config);
    let tools: Vec<&str> = config["tools"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    settings.insert("tools".to_owned(), tools.join(",").into());
    // Older files leave it out where it is false.
    settings.entry("model.properties".to_owned()).or_insert(false.into());
    settings.into_iter().map(|(path, value)| (short(&path).to_owned(), value)).collect()
}

/// The settings of a count by their names in a sweep file.
fn hit_settings(config: &Value) -> Settings {
    let mut settings = leaf_settings(config);
    settings.retain(|path, _| !path.starts_with("task.") && path != "episodes");
    settings.insert("task".to_owned(), config["task"]["name"].clone());
    let prior = PriorSource::from(json::text(&config["prior"]));
    settings.insert("prior".to_owned(), prior.name().into());
    settings
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
    pub(super) fn write(&self, folder: &Target) -> Result<PathBuf> {
        let [csv, data] = ["results.csv", "results.json"].map(|name| folder.join(name));
        csv.write(&self.to_csv(), &TABLE).map_err(RunError::io("write", &csv.path))?;
        data.write(json::pretty(self).as_bytes(), &ROWS).map_err(RunError::io("write", &data.path))?;
        Ok(csv.path)
    }
}
