//! Tasks that are chosen by their pictures.

use std::collections::BTreeSet;
use std::rc::Rc;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::picker::Pictured;
use super::search::Searched;
use crate::tui::scene::task_picture;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::theme::Theme;
use mge_base::paths::{entries, suffix};
use mge_task::{Task, level_names, load, shipped_names};

/// A task that can be opened.
#[derive(Debug, Clone)]
pub struct TaskItem {
    /// Its name or file, as `task` takes it.
    pub name: String,
    task: Rc<Task>,
}

/// Maximum number of files that are read.
const FILES: usize = 100;

impl TaskItem {
    /// The shipped tasks, those in files here and in the folder `tasks`, and CREATE's levels.
    pub fn all() -> Vec<Self> {
        let files = [".", "tasks"].into_iter().flat_map(|folder| entries(folder.as_ref()).unwrap_or_default());
        let files = files.filter(|path| suffix(path) == "json").take(FILES);
        let files: BTreeSet<_> =
            files.map(|path| path.strip_prefix(".").unwrap_or(&path).display().to_string()).collect();
        let levels = level_names().map(|level| format!("create/{level}"));
        let mut all: Vec<Self> = Vec::new();
        for name in shipped_names().map(str::to_owned).chain(files).chain(levels) {
            // Other files are in these folders, too, and copies of the shipped tasks.
            let new = load(&name).ok().filter(|task| all.iter().all(|known| *known.task != *task));
            all.extend(new.map(|task| Self { name, task: Rc::new(task) }));
        }
        all
    }
}

impl Searched for TaskItem {
    fn names(&self) -> Vec<&str> {
        vec![&self.name]
    }

    fn about(&self) -> &str {
        &self.task.description
    }
}

impl Pictured for TaskItem {
    const ROWS: u16 = 7;

    fn shown_name(&self, columns: usize) -> String {
        shortened(&self.name, columns, true)
    }

    fn draw(&self, area: Rect, theme: &Theme, buffer: &mut Buffer) {
        task_picture(&self.task, area, theme, buffer);
    }
}
