//! Leaving the workbench.

use std::path::Path;

use super::unsaved::OF_TASK;
use super::{App, QuitState};
use crate::tui::effect::Effect;
use crate::tui::layers::some_of;
use crate::tui::view::Level;
use mge_run::RunState;
use mge_workbench::command::Save;
use mge_workbench::free_name;

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
