//! Tasks that are chosen by their pictures.

use std::collections::BTreeSet;

use super::picker::Item;
use mge_base::paths::{entries, suffix};
use mge_task::{Task, level_names, load, shipped_names};

/// Maximum number of files that are read.
const FILES: usize = 100;

/// The shipped tasks, those in files here and in the folder `tasks`, and CREATE's levels, by what `task` takes.
pub fn tasks() -> Vec<Item<Task>> {
    let files = [".", "tasks"].into_iter().flat_map(|folder| entries(folder.as_ref()).unwrap_or_default());
    let files = files.filter(|path| suffix(path) == "json").take(FILES);
    let files = files.map(|path| path.strip_prefix(".").unwrap_or(&path).display().to_string());
    let levels = level_names().map(|level| format!("create/{level}"));
    let mut all: Vec<Item<Task>> = Vec::new();
    for name in shipped_names().map(str::to_owned).chain(files.collect::<BTreeSet<_>>()).chain(levels) {
        // Other files are in these folders, too, and copies of the shipped tasks.
        let Some(task) = load(&name).ok().filter(|task| all.iter().all(|known| known.of != *task)) else { continue };
        all.push(Item { name, variant: None, about: task.description.clone(), of: task });
    }
    all
}
