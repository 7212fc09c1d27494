//! Task files on disk and the tasks shipped with the program.

use std::path::PathBuf;

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};

use super::Task;
use super::create;
use mge_base::atomic::{Format, Target};
use mge_base::bounded;
use mge_base::json::{self, SyntaxError};
use mge_base::paths::{expanded, suffix};
use mge_base::spelling::did_you_mean;
use mge_base::validation::ValidationError;

/// The six tasks in `tasks/`, by name.
const SHIPPED: [(&str, &str); 6] = [
    ("task1", include_str!("../tasks/task1.json")),
    ("task2", include_str!("../tasks/task2.json")),
    ("task3", include_str!("../tasks/task3.json")),
    ("task4", include_str!("../tasks/task4.json")),
    ("task5", include_str!("../tasks/task5.json")),
    ("task6", include_str!("../tasks/task6.json")),
];

/// Six tasks on which settings are tuned, so that the shipped ones stay unseen. They are loaded by name, but not listed.
const TUNING: [(&str, &str); 6] = [
    ("tune1", include_str!("../tasks/tuning/tune1.json")),
    ("tune2", include_str!("../tasks/tuning/tune2.json")),
    ("tune3", include_str!("../tasks/tuning/tune3.json")),
    ("tune4", include_str!("../tasks/tuning/tune4.json")),
    ("tune5", include_str!("../tasks/tuning/tune5.json")),
    ("tune6", include_str!("../tasks/tuning/tune6.json")),
];

/// Why a task cannot be loaded or saved.
#[derive(Debug, thiserror::Error)]
pub enum TaskError {
    /// Neither a shipped name nor a readable file.
    #[error("there is no task `{name}`: use one of {known}, or the path of a task file{hint}")]
    Unknown { name: String, known: String, hint: String },
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// The text is not a task.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// The task is not playable.
    #[error("{origin}: {error}")]
    Invalid { origin: String, error: ValidationError },
}

/// CREATE's level files (MIT licence; the notice is in the folder).
const LEVELS: [(&str, &str); 13] = [
    ("Basket", include_str!("../tasks/create/level_basket.json")),
    ("Belt", include_str!("../tasks/create/level_belt.json")),
    ("Buckets", include_str!("../tasks/create/level_buckets.json")),
    ("Cannon", include_str!("../tasks/create/level_cannon.json")),
    ("Collide", include_str!("../tasks/create/level_collide.json")),
    ("Funnel", include_str!("../tasks/create/level_funnel.json")),
    ("GoalTest", include_str!("../tasks/create/level_test.json")),
    ("Ladder", include_str!("../tasks/create/level_ladder.json")),
    ("Moving", include_str!("../tasks/create/level_moving.json")),
    ("Navigate", include_str!("../tasks/create/level_navigate.json")),
    ("Obstacle", include_str!("../tasks/create/level_obstacle.json")),
    ("Push", include_str!("../tasks/create/level_push.json")),
    ("Seesaw", include_str!("../tasks/create/level_seesaw.json")),
];

/// Names of CREATE's levels. `create/NAME` loads one, `create/NAME-random` its variant with
/// random shifts.
pub fn level_names() -> impl Iterator<Item = &'static str> {
    LEVELS.iter().map(|(name, _)| *name)
}

/// Names of the shipped tasks.
pub fn shipped_names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The shipped tasks.
pub fn shipped() -> Vec<Task> {
    // A test parses every shipped file.
    SHIPPED.iter().map(|(name, text)| parse(text, name).expect("shipped tasks are valid")).collect()
}

/// Names and texts of the tasks in `tasks/` and `tasks/tuning/`.
fn built_in() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    SHIPPED.iter().chain(&TUNING)
}

/// The task with the name of a shipped or a tuning task, or the one in the file at that path.
///
/// # Errors
/// When there is neither, or the file is not a valid task.
pub fn load(name: &str) -> Result<Task, TaskError> {
    if let Some((name, text)) = built_in().find(|(built_in, _)| *built_in == name) {
        return parse(text, name);
    }
    if let Some(level) = name.strip_prefix("create/") {
        let (level, is_random) = level.strip_suffix("-random").map_or((level, false), |level| (level, true));
        if let Some((_, text)) = LEVELS.iter().find(|(known, _)| *known == level) {
            return parse_level(text, name, is_random);
        }
    }
    let path = expanded(name);
    let is_level = name.starts_with("create/");
    // A path is not a misspelt name.
    let is_path = !is_level && name.contains(['/', '.']);
    match bounded::read_text(&path) {
        Ok(text) => parse(&text, name),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound && !is_path => {
            let known: Vec<String> = match is_level {
                true => level_names().map(|level| format!("create/{level}")).collect(),
                false => shipped_names().map(str::to_owned).collect(),
            };
            let hint = did_you_mean(known.iter().map(String::as_str), name);
            Err(TaskError::Unknown { name: name.to_owned(), known: known.join(", "), hint })
        }
        Err(source) => Err(TaskError::Io { path, source }),
    }
}

/// Whether [`load`] finds this name within the program.
pub fn is_built_in(name: &str) -> bool {
    let level = name.strip_prefix("create/").map(|level| level.strip_suffix("-random").unwrap_or(level));
    built_in().any(|(known, _)| *known == name) || level_names().any(|known| Some(known) == level)
}

/// The file that [`load`] reads for this name; None for a task or level within the program.
pub fn file_of(name: &str) -> Option<PathBuf> {
    let path = expanded(name);
    (path.is_file() && !is_built_in(name)).then_some(path)
}

/// The tasks of all files in a folder whose names end in `.json`, by name, except `index.json`, which lists puzzles;
/// for anything else as [`load`]. Pipes and devices are refused.
///
/// # Errors
/// When a file cannot be read or is not a valid task, or the folder has none.
pub fn load_all(place: &str) -> Result<Vec<Task>, TaskError> {
    let path = expanded(place);
    if !path.is_dir() || built_in().any(|(built_in, _)| *built_in == place) {
        return Ok(vec![load_regular(place)?]);
    }
    let unreadable = |source| TaskError::Io { path: path.clone(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(&path).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let is_index = file.file_name().is_some_and(|name| name == "index.json");
        if suffix(&file) == "json" && !is_index {
            files.push(file);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(unreadable(std::io::Error::new(std::io::ErrorKind::NotFound, "the folder has no task files")));
    }
    files.iter().map(|file| load_regular(&file.display().to_string())).collect()
}

/// As [`load`], but refuses pipes and devices, on which a read might block.
///
/// # Errors
/// As [`load`].
pub fn load_regular(name: &str) -> Result<Task, TaskError> {
    let path = expanded(name);
    match bounded::regular(&path) {
        Err(source) if source.kind() == std::io::ErrorKind::InvalidInput && !path.is_dir() => {
            Err(TaskError::Io { path, source })
        }
        _ => load(name),
    }
}

/// The name by which [`load`] loads an equal task, if it is within the program.
pub fn name_of(task: &Task) -> Option<String> {
    let levels = level_names().flat_map(|level| ["", "-random"].map(|end| format!("create/{level}{end}")));
    let mut names = built_in().map(|(name, _)| (*name).to_owned()).chain(levels);
    names.find(|name| load(name).is_ok_and(|known| known == *task))
}

/// Parses a task from JSON, in our format or that of CREATE's level files; `origin` names the text in errors.
///
/// # Errors
/// When the text is not JSON, not a task, or a task that cannot be played.
pub fn parse(text: &str, origin: &str) -> Result<Task, TaskError> {
    let invalid = |error| TaskError::Invalid { origin: origin.to_owned(), error };
    if is_create_level(text) {
        return parse_level(text, origin, false);
    }
    let Unchecked(task) = json::parse(text.as_bytes(), origin)?;
    task.validate().map_err(invalid)?;
    Ok(task)
}

/// Parses a level file, with or without its random shifts.
fn parse_level(text: &str, origin: &str, is_random: bool) -> Result<Task, TaskError> {
    let invalid = |error| TaskError::Invalid { origin: origin.to_owned(), error };
    let task = create::level_task(json::parse(text.as_bytes(), origin)?, is_random).map_err(invalid)?;
    task.validate().map_err(invalid)?;
    Ok(task)
}

/// A well-formed but unvalidated task. Validation is separate from parsing so that its errors have only the file and
/// the path.
struct Unchecked(Task);

impl<'de> Deserialize<'de> for Unchecked {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Task::deserialize(deserializer).map(Self)
    }
}

/// Whether the text is one of CREATE's level files, which list their objects in `env` and have no version.
fn is_create_level(text: &str) -> bool {
    #[derive(Deserialize)]
    struct Marks {
        version: Option<IgnoredAny>,
        env: Option<IgnoredAny>,
    }
    json::parse(text.as_bytes(), "").is_ok_and(|Marks { version, env }| version.is_none() && env.is_some())
}

/// The JSON text of a task, as it is saved.
pub fn to_json(task: &Task) -> String {
    json::pretty(task)
}

/// The format of tasks.
pub const FORMAT: Format<'static> = Format { name: "a task", suffix: "json", is: &is_task };

fn is_task(found: &[u8]) -> bool {
    // CREATE's levels are other programs' files.
    str::from_utf8(found).is_ok_and(|text| !is_create_level(text) && parse(text, "").is_ok())
}

/// Writes the task atomically.
///
/// # Errors
/// When the task is invalid, or the file cannot be written or is not a task.
pub fn save(task: &Task, to: impl Into<Target>) -> Result<(), TaskError> {
    let to = to.into();
    task.validate().map_err(|error| TaskError::Invalid { origin: to.path.display().to_string(), error })?;
    to.write(to_json(task).as_bytes(), &FORMAT).map_err(|source| TaskError::Io { path: to.path, source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_stands_for_its_task_files_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().display().to_string();
        let error = load_all(&place).unwrap_err().to_string();
        assert!(error.contains("the folder has no task files"), "{error}");
        for (name, file) in [("task2", "b.json"), ("task1", "a.json")] {
            save(&load(name).unwrap(), &folder.path().join(file)).unwrap();
        }
        std::fs::write(folder.path().join("index.json"), "{}").unwrap();
        std::fs::write(folder.path().join("notes.txt"), "not a task").unwrap();
        let names: Vec<String> = load_all(&place).unwrap().into_iter().map(|task| task.name).collect();
        assert_eq!(names, ["task1", "task2"]);
        assert_eq!(load_all("task3").unwrap()[0].name, "task3");
        std::fs::write(folder.path().join("c.json"), "{").unwrap();
        assert!(load_all(&place).unwrap_err().to_string().contains("c.json"));
    }

    #[test]
    fn tasks_are_known_by_the_name_they_were_loaded_by_until_edited() {
        for name in ["task4", "tune4", "create/Push", "create/Push-random"] {
            let mut task = load(name).unwrap();
            assert_eq!(name_of(&task).as_deref(), Some(name));
            task.goal.position[0] += 0.1;
            assert_eq!(name_of(&task), None, "{name}");
        }
    }

    #[test]
    fn tuning_tasks_are_loaded_by_name_and_not_listed() {
        for (name, _) in TUNING {
            let task = load(name).unwrap();
            assert_eq!(task.name, name);
            assert!((1..=2).contains(&task.subgoals.len()));
            assert!(file_of(name).is_none() && shipped_names().all(|listed| listed != name));
        }
    }

    #[test]
    fn an_unreadable_file_is_not_an_unknown_name() {
        let folder = tempfile::tempdir().unwrap();
        let found = load(&folder.path().display().to_string());
        assert!(matches!(found, Err(TaskError::Io { .. })), "{found:?}");
        let missing = load(&folder.path().join("none").display().to_string());
        assert!(matches!(missing, Err(TaskError::Io { .. })), "{missing:?}");
        let misspelt = load("tsak1");
        assert!(matches!(misspelt, Err(TaskError::Unknown { .. })), "{misspelt:?}");
    }
}
