//! The tasks that can be opened by their names.

use std::collections::BTreeSet;

use mge_base::paths::{entries, suffix};
use mge_task::{Task, level_names, load, shipped_names};

/// Maximum number of files that are read.
const FILES: usize = 100;

/// The shipped tasks, those in files here and in the folder `tasks`, and CREATE's levels, by what `task` takes.
pub fn named_tasks() -> Vec<(String, Task)> {
    let files = ["tasks", "."].into_iter().flat_map(|folder| entries(folder.as_ref()).unwrap_or_default());
    let files = files.filter(|path| suffix(path) == "json").take(FILES);
    let files = files.map(|path| path.strip_prefix(".").unwrap_or(&path).display().to_string());
    let levels = level_names().map(|level| format!("create/{level}"));
    let mut all: Vec<(String, Task)> = Vec::new();
    for name in shipped_names().map(str::to_owned).chain(files.collect::<BTreeSet<_>>()).chain(levels) {
        // Other files are in these folders, too, and copies of the shipped tasks.
        let task = load(&name).ok().filter(|task| all.iter().all(|(_, known)| known != task));
        all.extend(task.map(|task| (name, task)));
    }
    all
}
