//! Task files on disk and the tasks shipped with the program.

use std::path::PathBuf;

use serde::Deserialize;

use super::Task;
use mge_base::atomic::{Format, Target};
use mge_base::bounded;
use mge_base::json::{self, SyntaxError};
use mge_base::paths::expanded;
use mge_base::spelling::{did_you_mean, suggestion};
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

/// CREATE's levels with their random shifts (MIT licence; the notice is in the folder).
const LEVELS: [(&str, &str); 13] = [
    ("Basket", include_str!("../tasks/create/basket-random.json")),
    ("Belt", include_str!("../tasks/create/belt-random.json")),
    ("Buckets", include_str!("../tasks/create/buckets-random.json")),
    ("Cannon", include_str!("../tasks/create/cannon-random.json")),
    ("Collide", include_str!("../tasks/create/collide-random.json")),
    ("Funnel", include_str!("../tasks/create/funnel-random.json")),
    ("GoalTest", include_str!("../tasks/create/goaltest-random.json")),
    ("Ladder", include_str!("../tasks/create/ladder-random.json")),
    ("Moving", include_str!("../tasks/create/moving-random.json")),
    ("Navigate", include_str!("../tasks/create/navigate-random.json")),
    ("Obstacle", include_str!("../tasks/create/obstacle-random.json")),
    ("Push", include_str!("../tasks/create/push-random.json")),
    ("Seesaw", include_str!("../tasks/create/seesaw-random.json")),
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
            let task = parse(text, name)?;
            return Ok(if is_random { task } else { Task { name: level.to_owned(), shifts: Vec::new(), ..task } });
        }
    }
    let path = expanded(name);
    let is_level = name.starts_with("create/");
    // A path is not a misspelt name.
    let is_path = !is_level && name.contains(['/', '.']);
    match bounded::read_text(&path) {
        Ok(text) => parse(&text, name),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound && !is_path => {
            let shipped: Vec<&str> = shipped_names().collect();
            let levels: Vec<String> = level_names().map(|level| format!("create/{level}")).collect();
            let is_typed =
                |level: &&String| level.rsplit('/').next().is_some_and(|bare| bare.eq_ignore_ascii_case(name));
            let hint = match levels.iter().find(is_typed) {
                Some(level) => suggestion(Some(level)),
                None => did_you_mean(levels.iter().map(String::as_str).chain(built_in().map(|(name, _)| *name)), name),
            };
            let known = match is_level {
                true => format!("{}, each also with -random at its end", levels.join(", ")),
                false => shipped.join(", ") + ", tune1 to tune6, create/LEVEL such as create/Push",
            };
            Err(TaskError::Unknown { name: name.to_owned(), known, hint })
        }
        Err(source) => Err(TaskError::Io { path, source }),
    }
}

/// Whether [`load`] finds this name within the program.
fn is_built_in(name: &str) -> bool {
    let level = name.strip_prefix("create/").map(|level| level.strip_suffix("-random").unwrap_or(level));
    built_in().any(|(known, _)| *known == name) || level_names().any(|known| Some(known) == level)
}

/// The name by which [`load`] finds the task or level within the program that has this name, if there is one.
pub fn shipped_name(name: &str) -> Option<String> {
    [name.to_owned(), format!("create/{name}")].into_iter().find(|name| is_built_in(name))
}

/// The file that [`load`] reads for this name; None for a task or level within the program.
pub fn file_of(name: &str) -> Option<PathBuf> {
    let path = expanded(name);
    (path.is_file() && !is_built_in(name)).then_some(path)
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

/// Whether a task has the name of a task or level within the program, from which it differs.
pub fn is_edited(task: &Task) -> bool {
    let names = [task.name.clone(), format!("create/{}", task.name)];
    names.iter().filter(|name| is_built_in(name)).any(|name| load(name).is_ok_and(|known| known != *task))
}

/// Parses a task from JSON; `origin` names the text in errors.
///
/// # Errors
/// When the text is not JSON, not a task, or a task that cannot be played.
pub fn parse(text: &str, origin: &str) -> Result<Task, TaskError> {
    let Unchecked(task) = json::parse(text.as_bytes(), origin)?;
    task.validate().map_err(|error| TaskError::Invalid { origin: origin.to_owned(), error })?;
    Ok(task)
}

/// A well-formed but unvalidated task. Validation is separate from parsing so that its errors have only the file and
/// the path.
#[derive(Deserialize)]
struct Unchecked(#[serde(deserialize_with = "Task::deserialize")] Task);

/// The JSON text of a task, as it is saved.
pub fn to_json(task: &Task) -> String {
    json::pretty(task)
}

/// The format of tasks.
pub const FORMAT: Format<'static> =
    Format { name: "a task", is: &|found| str::from_utf8(found).is_ok_and(|text| parse(text, "").is_ok()) };

/// Writes the task atomically.
///
/// # Errors
/// When the task is invalid, or the file cannot be written or is not a task.
pub fn save(task: &Task, to: impl Into<Target>) -> Result<(), TaskError> {
    let to = to.into();
    task.validate().map_err(|error| TaskError::Invalid { origin: to.path.display().to_string(), error })?;
    to.write(to_json(task).as_bytes(), &FORMAT).map_err(|source| TaskError::Io { path: to.path, source })
}

/// [`save`] to a file that the user named, where another task is replaced only by force: it is the user's work.
///
/// # Errors
/// As for [`save`], and when the file has another task.
pub fn save_as(task: &Task, to: impl Into<Target>) -> Result<(), TaskError> {
    let (to, text) = (to.into(), to_json(task));
    let same = Format { name: "the same task", is: &|found| found == text.as_bytes() };
    to.check(&same).map_err(|source| TaskError::Io { path: to.path.clone(), source })?;
    save(task, to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_within_the_program_is_known_to_be_edited() {
        for name in ["task4", "tune4", "create/Push", "create/Push-random"] {
            let mut task = load(name).unwrap();
            assert!(!is_edited(&task), "{name}");
            task.goal.position[0] += 0.1;
            assert!(is_edited(&task), "{name}");
            task.name = "mine".to_owned();
            assert!(!is_edited(&task), "it has another name");
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
        for (typed, meant) in
            [("push", "create/Push"), ("create/Puhs", "create/Push"), ("tsak1", "task1"), ("tuen3", "tune3")]
        {
            let error = load(typed).unwrap_err().to_string();
            assert!(error.ends_with(&format!("did you mean `{meant}`?")), "{error}");
        }
    }
}
