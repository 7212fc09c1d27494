//! Recovery of unsaved edits: when a signal or a panic ends the workbench, the task is saved to a new file in the
//! current folder, or else in the folder for temporary files. The next start in the current folder reports it.

use std::path::{Path, PathBuf};

use super::App;
use crate::tui::terminal;
use crate::tui::view::{Level, ViewModel};
use mge_task as task;
use mge_workbench::free_name;

/// Prefix of the file names of saved tasks.
const NAME: &str = "unsaved-";
/// The end of the name of a task file, and what is before the number of a further one.
pub(super) const OF_TASK: [&str; 2] = ["-", ".json"];

impl Drop for App {
    /// Saves unsaved edits, as after a signal or a panic.
    fn drop(&mut self) {
        let view = self.workspace.view();
        if !self.keeps_edits || self.is_leaving() {
            return;
        }
        if view.dirty {
            terminal::report_at_the_end(keep(view, &[PathBuf::new(), std::env::temp_dir()]));
        }
        if self.screens.schedule.is_edited() {
            let schedule = self.screens.schedule.shown(view);
            terminal::report_at_the_end(format!("the drawn schedule was not in use yet: `epsilon {schedule}` sets it"));
        }
    }
}

/// Saves the task to a new file in the first of the folders that can be written; returns the message to report.
fn keep(view: &ViewModel, folders: &[PathBuf]) -> String {
    let name = &view.task.name;
    let mut message = String::new();
    for folder in folders {
        let path = folder.join(free_name(folder, &format!("{NAME}{name}"), OF_TASK));
        match task::save(&view.task, &path) {
            Ok(()) => return format!("the unsaved edits of {name} are kept in {}", path.display()),
            Err(error) => message = format!("the edits of {name} are lost: {error}"),
        }
    }
    message
}

/// Reports a task that an earlier workbench saved in `folder`.
pub fn report_recovered_edits(app: &mut App, folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    if let Some(name) = names.filter(|name| name.starts_with(NAME) && name.ends_with(".json")).min() {
        app.warn(Level::Warning, &format!("an earlier workbench left unsaved edits: `task {name}` opens them"));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::tui::app::testing::{app, empty, press, typical};

    #[test]
    fn unsaved_edits_go_to_a_new_file_and_are_reported() {
        let folder = tempfile::tempdir().unwrap();
        for file in ["unsaved-task1.json", "unsaved-task1-2.json"] {
            let report = keep(&typical(), &[folder.path().to_owned()]);
            assert!(report.contains(file), "{report}");
            let kept = task::load(&folder.path().join(file).display().to_string()).unwrap();
            assert_eq!(kept.subgoals, typical().task.subgoals);
        }
        for other in ["mine.json", "unsaved-notes.txt"] {
            std::fs::write(folder.path().join(other), "").unwrap();
        }
        let (mut app, _) = app(empty());
        report_recovered_edits(&mut app, folder.path());
        assert!(app.message().contains("`task unsaved-task1"));
        assert!(keep(&typical(), &["/nowhere".into()]).contains("are lost"));
        let fallback = keep(&typical(), &["/nowhere".into(), folder.path().to_owned()]);
        assert!(fallback.contains("are kept in") && fallback.contains("unsaved-task1-3.json"), "{fallback}");
    }

    #[test]
    fn a_schedule_that_is_being_drawn_is_told_if_a_signal_ends_the_workbench() {
        let told = |keys: &str| {
            let (mut app, _) = app(empty());
            app.keeps_edits = true;
            press(&mut app, keys);
            drop(app);
            terminal::take_held().concat().contains("`epsilon points:0=0.81,1500=0.05` sets it")
        };
        assert!(told("3 up") && !told("3 up q y"));
    }

    #[test]
    fn no_file_is_kept_without_unsaved_edits_or_after_leaving() {
        let named = |mut view: ViewModel| {
            Arc::make_mut(&mut view.task).name = "never-kept".to_owned();
            view
        };
        let guarded = |view| {
            let (mut app, _) = app(named(view));
            app.keeps_edits = true;
            app
        };
        drop(guarded(empty()));
        let mut left = guarded(typical());
        press(&mut left, "q y");
        assert!(left.is_leaving());
        drop(left);
        assert!(std::fs::remove_file(format!("{NAME}never-kept.json")).is_err(), "it was kept");
    }
}
