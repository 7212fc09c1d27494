//! Runs that lie in folders, read whole and told apart by their settings.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::learning::{AS_SHIPPED, TrainedRun, WHOLE_MODEL};
use crate::dynamics::tool_set_name;
use crate::json;
use crate::run::{RunDirectory, RunError, RunHistory, RunState};
use crate::task::{self, Task};
use crate::trainer::{Method, PriorSource, RunConfig};

/// A run on disk.
#[derive(Debug, Clone)]
pub struct FoundRun {
    /// Its folder.
    pub path: PathBuf,
    /// Whether somebody works on it, or how it ended.
    pub state: RunState,
    /// Its configuration.
    pub config: RunConfig,
    /// What it came to.
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
    // What cannot be resolved is told by whoever reads it.
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

/// Reads runs. The settings in which runs on the same task differ become part of their rows,
/// so that only runs that differ in nothing but the seed have the same label.
///
/// # Errors
/// When a run cannot be read.
pub fn read_runs(paths: &[PathBuf]) -> Result<Vec<FoundRun>, RunError> {
    let mut runs = Vec::new();
    let mut settings = Vec::new();
    for path in paths {
        let directory = RunDirectory::open(path)?;
        let config: RunConfig = directory.config()?;
        let history = match RunHistory::read(&directory) {
            // It was made, but has not begun.
            Err(error) if error.is_not_found() => RunHistory::default(),
            read => read?,
        };
        let trained = TrainedRun::new(&config, &history);
        let state = directory.status()?.state;
        // As they are written: 0.99 is not 0.9900000095367432.
        let mut compared = compared_settings(&directory.config()?, config.method);
        compared.extend(task_changes(&config.task));
        settings.push(compared);
        runs.push(FoundRun { path: path.clone(), state, config, trained });
    }
    name_models(&runs, &mut settings);
    tell_apart(&mut runs, &settings);
    Ok(runs)
}

/// Whether a task that is called as a shipped one has its subgoals, and all else of it.
fn task_changes(task: &Task) -> Vec<(String, String)> {
    let Some(shipped) = task::shipped().into_iter().find(|shipped| shipped.name == task.name) else {
        return Vec::new();
    };
    let same_scene = Task { subgoals: shipped.subgoals.clone(), ..task.clone() } == shipped;
    let told = |same| if same { AS_SHIPPED } else { "changed" }.to_owned();
    vec![("subgoals".to_owned(), told(task.subgoals == shipped.subgoals)), ("scene".to_owned(), told(same_scene))]
}

/// Calls model files by what their names have beyond the tool set, so that tasks with different
/// tool sets can have the same method. Two models of one name on one task keep their paths.
fn name_models(runs: &[FoundRun], settings: &mut [BTreeMap<String, String>]) {
    let mut paths: BTreeMap<(&str, String), BTreeSet<String>> = BTreeMap::new();
    for (run, settings) in runs.iter().zip(settings.iter()) {
        if let (Some(name), Some(path)) = (model_name(&run.config), settings.get("prior")) {
            paths.entry((&run.config.task.name, name)).or_default().insert(path.clone());
        }
    }
    let ambiguous: BTreeSet<&String> =
        paths.iter().filter(|(_, paths)| paths.len() > 1).map(|((_, name), _)| name).collect();
    for (run, settings) in runs.iter().zip(settings) {
        let name = model_name(&run.config).filter(|name| !ambiguous.contains(name));
        if let (Some(name), Some(path)) = (name, settings.get_mut("prior")) {
            *path = name;
        }
    }
}

/// What tells the model file of a run from others of its tool set, if it has one.
fn model_name(config: &RunConfig) -> Option<String> {
    let PriorSource::ModelFile(path) = &config.prior else { return None };
    let stem = Path::new(path).file_stem()?.to_str()?;
    Some(match stem.strip_prefix(&tool_set_name(&config.task.tool_set())) {
        Some("") => WHOLE_MODEL.to_owned(),
        Some(rest) if rest.starts_with('-') => rest[1..].to_owned(),
        _ => stem.to_owned(),
    })
}

/// Settings by path, without those that are told anyway or do not change what is learned.
fn compared_settings(config: &Value, method: Method) -> BTreeMap<String, String> {
    let told = |path: &str| {
        ["method", "seed", "epsilon"].contains(&path)
            || ["task.", "checkpoints."].iter().any(|prefix| path.starts_with(prefix))
            || !method.uses(path)
    };
    let leaves = json::leaves(config).into_iter().filter(|(path, _)| !told(path));
    leaves.map(|(path, value)| (path, value.as_str().map_or_else(|| value.to_string(), str::to_owned))).collect()
}

fn tell_apart(runs: &mut [FoundRun], settings: &[BTreeMap<String, String>]) {
    // Whatever differs between two runs of a task that both have the setting.
    let mut differing: BTreeSet<String> = BTreeSet::new();
    let mut first: BTreeMap<(&str, &str), &str> = BTreeMap::new();
    for (run, settings) in runs.iter().zip(settings) {
        for (path, value) in settings {
            if *first.entry((&run.trained.row.task, path)).or_insert(value) != value {
                differing.insert(path.clone());
            }
        }
    }
    for (run, settings) in runs.iter_mut().zip(settings) {
        let of_run = settings.iter().filter(|(path, _)| differing.contains(*path));
        run.trained.row.settings = of_run.map(|(path, value)| (path.clone(), value.clone())).collect();
    }
    tell_thresholds_apart(runs);
}

/// Two schedules may be called the same in a label: then it says them whole.
fn tell_thresholds_apart(runs: &mut [FoundRun]) {
    let mut schedules: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for run in runs.iter() {
        schedules.entry(run.trained.row.label()).or_default().insert(run.trained.row.epsilon.clone());
    }
    for row in runs.iter_mut().filter(|run| run.config.method.uses("epsilon")).map(|run| &mut run.trained.row) {
        if schedules.get(&row.label()).is_some_and(|schedules| schedules.len() > 1) {
            row.tell_whole_schedule();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn runs_are_told_apart_by_the_settings_in_which_they_differ() {
        let folder = tempfile::tempdir().unwrap();
        let task = Arc::new(crate::task::load("task1").unwrap());
        let other = Arc::new(crate::task::load("task2").unwrap());
        let make = |name: &str, task: &Arc<crate::task::Task>, settings: &[(&str, &str)]| {
            let mut config = RunConfig::new(task.clone());
            for (key, value) in settings {
                config = config.with_setting(key, value).unwrap();
            }
            RunDirectory::create(folder.path().join("runs").join(name), &config).unwrap();
        };
        make("a", &task, &[("epsilon", "0.1"), ("ddpg.gamma", "0.7")]);
        make("b", &task, &[("epsilon", "0.1"), ("seed", "1")]);
        make("c", &task, &[("epsilon", "linear:0.5:0:10")]);
        make("d", &task, &[("epsilon", "linear:0.5:0:20")]);
        make("e", &task, &[("method", "ddpg"), ("epsilon", "0.3"), ("guidance.horizon", "3")]);
        // Another task may need another model: that is no difference between runs of a task.
        make("f", &other, &[("epsilon", "0.1"), ("prior", "true")]);
        std::fs::create_dir(folder.path().join("runs/nothing")).unwrap();

        let paths = find_runs(&[folder.path().to_owned()]).unwrap();
        let runs = read_runs(&paths).unwrap();
        let labels: Vec<String> = runs.iter().map(|run| run.trained.row.label()).collect();
        let usual = runs[1].config.ddpg.gamma;
        let expected = [
            "DDPG-MGE, epsilon 0.1, ddpg.gamma 0.7",
            "DDPG-MGE, epsilon 0.1, ddpg.gamma USUAL",
            "DDPG-MGE, epsilon linear:0.5:0:10, ddpg.gamma USUAL",
            "DDPG-MGE, epsilon linear:0.5:0:20, ddpg.gamma USUAL",
            "DDPG, ddpg.gamma USUAL",
            "DDPG-MGE, epsilon 0.1, ddpg.gamma USUAL",
        ];
        let expected = expected.map(|label| label.replace("USUAL", &usual.to_string()));
        assert_eq!(labels, expected);
        assert!(runs.iter().all(|run| run.state == RunState::NotStarted && run.trained.row.episodes == 0));
        assert_eq!(find_runs(&paths[..1]).unwrap(), paths[..1]);
        assert_eq!(find_runs(&[folder.path().to_owned(), paths[0].clone()]).unwrap(), paths);
        let error = find_runs(&[folder.path().join("runs/nothing")]).unwrap_err().to_string();
        assert!(error.contains("holds no runs"), "{error}");
    }

    #[test]
    fn a_changed_task_is_told_from_the_shipped_one() {
        let folder = tempfile::tempdir().unwrap();
        let mut task = task::load("task1").unwrap();
        for (name, changed) in [("a", false), ("b", true)] {
            task.subgoals[0].radius += f32::from(u8::from(changed));
            let config = RunConfig::new(Arc::new(task.clone())).with_setting("epsilon", "0.1").unwrap();
            RunDirectory::create(folder.path().join(name), &config).unwrap();
        }
        let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
        let labels: Vec<String> = runs.iter().map(|run| run.trained.row.label()).collect();
        assert_eq!(labels, ["DDPG-MGE, epsilon 0.1", "DDPG-MGE, epsilon 0.1, subgoals changed"]);
    }

    #[test]
    fn models_are_named_by_what_they_lack_on_all_tasks_alike() {
        let labels = |models: &[(&str, &str)]| -> Vec<String> {
            let folder = tempfile::tempdir().unwrap();
            for (n, (task, model)) in models.iter().enumerate() {
                let config = RunConfig::new(Arc::new(crate::task::load(task).unwrap()));
                let config = config.with_setting("epsilon", "0.1").unwrap().with_setting("prior", model).unwrap();
                RunDirectory::create(folder.path().join(n.to_string()), &config).unwrap();
            }
            let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
            runs.iter().map(|run| run.trained.row.label()).collect()
        };
        let [whole, ablated] = ["DDPG-MGE, epsilon 0.1", "DDPG-MGE, epsilon 0.1, model absolute"];
        let models = [
            ("task1", "m/bucket-box.safetensors"),
            ("task1", "m/bucket-box-absolute.safetensors"),
            ("task3", "m/square-floor.safetensors"),
            ("task3", "m/square-floor-absolute.safetensors"),
        ];
        assert_eq!(labels(&models), [whole, ablated, whole, ablated]);
        let same_name = labels(&[("task1", "m/a.safetensors"), ("task1", "n/a.safetensors")]);
        assert_eq!(same_name, ["m", "n"].map(|folder| format!("{whole}, model {folder}/a.safetensors")));
    }
}
