//! Leaving the workbench, and recovery of unsaved edits: when a signal or a panic ends it, the task is saved to a new file
//! in the current folder, or else in the folder for temporary files. The next start in the current folder reports it.

use std::path::{Path, PathBuf};

use super::{App, QuitState};
use crate::tui::effect::Effect;
use crate::tui::layers::some_of;
use crate::tui::terminal;
use crate::tui::view::{Level, ViewModel};
use mge_run::RunState;
use mge_task as task;
use mge_workbench::command::Save;
use mge_workbench::free_name;

/// Prefix of the file names of saved tasks.
const NAME: &str = "unsaved-";
/// The end of the name of a task file, and what is before the number of a further one.
const OF_TASK: [&str; 2] = ["-", ".json"];

impl App {
    /// What stands still while the process does, in words; empty if nothing does.
    pub fn standing_still(&self) -> String {
        let names: Vec<String> = self.workspace.view().training_runs().map(|run| run.name.clone()).collect();
        if names.is_empty() { String::new() } else { some_of(names.into_iter()) + ": not trained until `fg`" }
    }

    /// Leaves the workbench; asks first if something would be lost or stopped. Does nothing while a question is open.
    /// A wait for the end of all runs goes on, unless it is ended by its answer.
    pub fn quit(&mut self) {
        if self.layers.iter().any(|layer| layer.is_warning()) {
            return;
        }
        let view = self.workspace.view();
        let mut text = Vec::new();
        for run in view.active_runs() {
            let doing = match run.state {
                _ if run.queued => "was waiting for a core",
                RunState::Paused => "was paused",
                _ => "was being trained",
            };
            // No number of episodes, and no present: they would be out of date while the question is open.
            text.push(format!("{} {doing} when you asked.", run.name));
        }
        let trained = !text.is_empty();
        if trained {
            text.push("A run that is stopped keeps a checkpoint and can be continued later.".to_owned());
        }
        for (work, _) in view.model_work.iter().chain(&view.forking) {
            text.push(format!("{work} ends and its progress is lost."));
        }
        text.extend(self.unsaved());
        if self.screens.schedule.is_edited() {
            text.push("The schedule you have drawn is not in use and will be lost.".to_owned());
        }
        if text.is_empty() {
            return self.leave(QuitState::Now);
        }
        let unsaved = if view.dirty { " without saving" } else { "" };
        let leave = format!("{}leave{unsaved}", if trained { "keep a checkpoint, stop and " } else { "" });
        let mut answers = vec![('y', &*leave, Effect::call(|app| app.leave(QuitState::Now)))];
        let file = view
            .file
            .clone()
            .unwrap_or_else(|| free_name(Path::new(""), &format!("my-{}", view.task.name), OF_TASK).into());
        let name = file.file_name().unwrap_or_default().display();
        let save = format!("save {name}{} leave", if trained { ", stop and" } else { " and" });
        let in_background = format!("leave it training in the background{unsaved}");
        if view.dirty {
            let save_and_leave = move |app: &mut Self| {
                app.apply_confirmed(Save(Some((&file).into())).into())?;
                app.leave(QuitState::Now);
                Ok(())
            };
            answers.push(('s', &save, Effect::new(save_and_leave)));
        }
        if view.training_runs().next().is_some() {
            let leave_training = |app: &mut Self| {
                app.background = app.workspace.view().training_runs().map(|run| run.path.clone()).collect();
                app.leave(QuitState::Now);
            };
            answers.push(('b', &*in_background, Effect::call(leave_training)));
            let (when, name) = match self.leaving {
                QuitState::WhenIdle => (QuitState::No, "wait no longer: stay when all runs are done"),
                _ => (QuitState::WhenIdle, "wait: leave when all runs are done"),
            };
            answers.push(('w', name, Effect::call(move |app| app.leave(when))));
        }
        self.changed = true;
        self.ask("leave the workbench?", text.join("\n"), answers);
    }

    /// Leaves the workbench now, or when all runs are done.
    fn leave(&mut self, when: QuitState) {
        self.leaving = when;
        match when {
            QuitState::WhenIdle => {
                let is_paused = self.workspace.view().active_runs().any(|run| run.state == RunState::Paused);
                let asks = is_paused || !self.unsaved().is_empty() || self.screens.schedule.is_edited();
                let asks = if asks { ", after a question about what is paused or not saved" } else { "" };
                self.warn(Level::Info, &format!("leaving when all runs are done{asks}; quit again to change that"));
            }
            QuitState::No => self.warn(Level::Info, "staying when all runs are done"),
            QuitState::Now => {}
        }
    }
}

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
