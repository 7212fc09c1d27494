//! The results of a sweep: one row per run, as CSV and JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::hits::HitCounts;
use super::models::{ModelResult, short};
use super::work::result_in;
use crate::error::ExperimentError;
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

impl Kind {
    /// Its name in messages.
    fn name(self) -> &'static str {
        match self {
            Self::Agent => "an agent",
            Self::Model => "a dynamics model",
            Self::Hits => "a count of hits",
        }
    }
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
pub fn check_results(folder: &Target) -> Result<(), ExperimentError> {
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
pub fn write_results(folder: &Target) -> Result<PathBuf, ExperimentError> {
    let _alone = hold_folder(&folder.path, || true).map_err(RunError::io("write into", &folder.path))?;
    let (results, damaged) = readable_results(&folder.path)?;
    // A damaged run does not withhold the results of the others.
    let written = results.write(folder)?;
    damaged.map_or(Ok(written), Err)
}

/// The results of the runs that can be read, and why the first of the others cannot.
pub(super) fn readable_results(folder: &Path) -> Result<(Results, Option<ExperimentError>), ExperimentError> {
    let mut paths = runs_of(folder)?;
    paths.retain(|path| !matches!(RunDirectory::open(path), Err(RunError::NotARun(_))));
    results_of(&paths)
}

/// The results of those of these runs that can be read, and why the first of the others cannot.
pub(crate) fn results_of(paths: &[PathBuf]) -> Result<(Results, Option<ExperimentError>), ExperimentError> {
    Ok(match common_kind(paths, [])? {
        Kind::Agent => {
            let read = RunReader::default().read(paths, &mut |_| {});
            let damaged = read.unreadable.into_iter().next();
            (agents(&read.runs), damaged.map(|(_, error)| error.into()))
        }
        Kind::Model => MODELS.results(paths),
        Kind::Hits => HITS.results(paths),
    })
}

/// The runs of a sweep, without others that its folder may hold beside them.
pub(super) fn runs_of(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    find_runs(&[folder.join("runs")])
}

/// The runs that a sweep's folder already has.
pub(super) fn runs_so_far(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    match runs_of(folder) {
        Err(RunError::NoRuns(_)) => Ok(Vec::new()),
        Err(_) if !folder.join("runs").exists() => Ok(Vec::new()),
        found => found,
    }
}

/// The common kind of all runs that can be read, and of work that is `planned`.
pub(super) fn common_kind(
    paths: &[PathBuf],
    planned: impl IntoIterator<Item = (Kind, PathBuf)>,
) -> Result<Kind, ExperimentError> {
    // A damaged run has no kind.
    let held = paths.iter().filter_map(|path| Some((kind_of(path).ok()?, path.clone())));
    let mut all = held.chain(planned);
    let Some((known, first)) = all.next() else { return Ok(Kind::Agent) };
    let Some((kind, second)) = all.find(|(kind, _)| *kind != known) else { return Ok(known) };
    Err(ExperimentError::Mixed { first, first_kind: known.name(), second, second_kind: kind.name() })
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
    Columns {
        lead: &["task", "method", "epsilon"],
        differing: differing.cloned().collect(),
        seeds: &["seed"],
        measures: [
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
        ]
        .map(str::to_owned)
        .into(),
    }
    .table("train", runs.iter().map(values))
}

/// The columns of a table, after those of the run and its state.
struct Columns {
    /// The settings that come first, also where they do not differ.
    lead: &'static [&'static str],
    /// The settings that differ.
    differing: BTreeSet<String>,
    /// What distinguishes repetitions.
    seeds: &'static [&'static str],
    /// What was measured.
    measures: Vec<String>,
}

/// The values of a run, by column.
type Values = BTreeMap<String, Value>;

impl Columns {
    /// The table of these runs.
    fn table(self, kind: &'static str, runs: impl Iterator<Item = Values>) -> Results {
        let Self { lead, differing, seeds, measures } = self;
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let is_elsewhere =
            |path: &str| lead.contains(&path) || seeds.contains(&path) || measures.iter().any(|own| own == path);
        let mut settings = owned(lead);
        settings.extend(differing.into_iter().filter(|path| !is_elsewhere(path)));
        let columns = [owned(&["run", "state"]), settings.clone(), owned(seeds), measures.clone()].concat();
        let row = |mut values: Values| {
            columns.iter().map(|column| (column.clone(), values.remove(column).unwrap_or_default())).collect()
        };
        Results { version: 1, kind, rows: runs.map(row).collect(), settings, measures, columns }
    }
}

/// How the results of work with a `result.json` become a table.
struct Measured {
    /// `dynamics` or `hits`.
    kind: &'static str,
    /// The first settings, also where they do not differ.
    lead: &'static [&'static str],
    /// What distinguishes repetitions.
    seeds: &'static [&'static str],
    /// The measures and their names in `result.json`.
    measures: &'static [(&'static str, &'static str)],
    /// The measures that are lists, by their names in `result.json`, and the prefix of their columns.
    list: (&'static str, &'static str),
    /// The settings of a configuration, by their names in a sweep file.
    settings: fn(&Value) -> Settings,
    /// Checks the text of a result.
    check: fn(&Path) -> Result<Option<Value>, ExperimentError>,
}

const MODELS: Measured = Measured {
    kind: "dynamics",
    lead: &["tools"],
    seeds: &["seed"],
    measures: &[
        ("epochs_done", "epochs"),
        ("train_loss", "train_loss"),
        ("validation_loss", "validation_loss"),
        ("one_step_error", "one_step_error"),
        ("action_error", "action_error"),
        ("one_step_contact_error", "one_step_contact_error"),
        ("action_contact_error", "action_contact_error"),
        ("precision", "precision"),
        ("recall", "recall"),
    ],
    list: ("rollout_error", "rollout_error_"),
    settings: model_settings,
    check: checked::<ModelResult>,
};

const HITS: Measured = Measured {
    kind: "hits",
    lead: &["task", "policy"],
    seeds: &["build", "seed"],
    measures: &[("episodes", "episodes"), ("goal", "goal")],
    list: ("subgoals", "subgoal_"),
    settings: |config| {
        let mut settings = leaf_settings(config);
        settings.retain(|path, _| !path.starts_with("task.") && path != "episodes");
        settings.insert("task".to_owned(), config["task"]["name"].clone());
        let prior = PriorSource::from(json::text(&config["prior"]));
        settings.insert("prior".to_owned(), prior.name().into());
        settings
    },
    check: checked::<HitCounts>,
};

/// The settings of a model by their names in a sweep file.
fn model_settings(config: &Value) -> Settings {
    let mut settings = leaf_settings(config);
    settings.insert("tools".to_owned(), names(&config["tools"]).join(",").into());
    // Older files leave it out where it is false.
    settings.entry("model.properties".to_owned()).or_insert(false.into());
    settings.into_iter().map(|(path, value)| (short(&path).to_owned(), value)).collect()
}

impl Measured {
    /// The results of the runs that can be read, and why the first of the others cannot.
    fn results(&self, paths: &[PathBuf]) -> (Results, Option<ExperimentError>) {
        let (mut settings, mut found, mut damaged) = (Vec::new(), Vec::new(), None);
        for path in paths {
            match self.read(path) {
                Ok((own, result)) => {
                    settings.push(own);
                    found.push((path, result));
                }
                Err(error) => damaged = damaged.or(Some(error)),
            }
        }
        let (list, prefix) = self.list;
        let items = |result: &Value| result.get(list).and_then(Value::as_array).cloned().unwrap_or_default();
        let longest = found.iter().map(|(_, result)| items(result).len()).max().unwrap_or(0);
        let measures = self.measures.iter().map(|(column, _)| (*column).to_owned());
        let columns = Columns {
            lead: self.lead,
            differing: complete(&mut settings, |_, _| true),
            seeds: self.seeds,
            measures: measures.chain((1..=longest).map(|n| format!("{prefix}{n}"))).collect(),
        };
        let values = |((path, result), settings): ((&PathBuf, Value), Settings)| {
            let mut values: Values = settings.into_iter().collect();
            let measures = self.measures.iter().filter_map(|(column, key)| Some((*column, result.get(key)?.clone())));
            values.extend(measures.map(|(column, value)| (column.to_owned(), value)));
            values
                .extend(items(&result).into_iter().enumerate().map(|(n, value)| (format!("{prefix}{}", n + 1), value)));
            values.insert("run".to_owned(), path.file_name().unwrap_or_default().to_string_lossy().into());
            values.insert("state".to_owned(), state(&result).into());
            values
        };
        (columns.table(self.kind, found.into_iter().zip(settings).map(values)), damaged)
    }

    /// The settings and the result of a run; null if it is not finished.
    fn read(&self, path: &Path) -> Result<(Settings, Value), ExperimentError> {
        let config: Value = RunDirectory::open(path)?.config()?;
        Ok(((self.settings)(&config), (self.check)(path)?.unwrap_or_default()))
    }
}

/// The result in a folder, which must be a `T`, with numbers as written: 0.1 and not 0.10000000149011612.
fn checked<T: DeserializeOwned>(folder: &Path) -> Result<Option<Value>, ExperimentError> {
    result_in::<T>(folder)?;
    result_in(folder)
}

fn state(result: &Value) -> &'static str {
    match (result, result.get("diverged")) {
        (Value::Null, _) => "not finished",
        (_, None | Some(Value::Null)) => "finished",
        (_, Some(_)) => "diverged",
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
    pub(super) fn write(&self, folder: &Target) -> Result<PathBuf, ExperimentError> {
        let [csv, data] = ["results.csv", "results.json"].map(|name| folder.join(name));
        csv.write(&self.to_csv(), &TABLE).map_err(RunError::io("write", &csv.path))?;
        data.write(json::pretty(self).as_bytes(), &ROWS).map_err(RunError::io("write", &data.path))?;
        Ok(csv.path)
    }
}
