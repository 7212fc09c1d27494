//! Leaving the workbench.

use super::{App, QuitState};
use crate::tui::effect::Effect;
use crate::tui::view::Level;
use mge_run::RunState;

impl App {
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
                _ if run.queued => "waits for a core",
                RunState::Paused => "is paused",
                _ => "is being trained",
            };
            // No number of episodes: it would be out of date while the question is open.
            text.push(format!("{} {doing}.", run.name));
        }
        let trained = !text.is_empty();
        if trained {
            text.push("A run that is stopped keeps a checkpoint and can be continued later.".to_owned());
        }
        if let Some((work, _)) = &view.model_work {
            text.push(format!("{work} ends and its progress is lost."));
        }
        if view.dirty {
            text.push(format!("The edits of {} are not saved and will be lost.", view.task.name));
        }
        if self.screens.schedule.is_edited() {
            text.push("The schedule you have drawn is not in use and will be lost.".to_owned());
        }
        if text.is_empty() {
            self.leaving = QuitState::Now;
            return;
        }
        let leave = if trained { "keep a checkpoint, stop and leave" } else { "leave" };
        let mut answers = vec![('y', leave, Effect::call(|app| app.leave(QuitState::Now)))];
        if view.training_runs().next().is_some() {
            answers.push(('b', "leave it training in the background", Effect::call(Self::leave_to_background)));
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
            QuitState::WhenIdle => self.warn(Level::Info, "leaving when all runs are done; quit again to change that"),
            QuitState::No => self.warn(Level::Info, "staying when all runs are done"),
            QuitState::Now => {}
        }
    }

    /// Leaves the workbench; trainings continue in the background.
    fn leave_to_background(&mut self) {
        self.background = self.workspace.view().training_runs().map(|run| run.path.clone()).collect();
        self.leave(QuitState::Now);
    }
}
