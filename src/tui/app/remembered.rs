//! What the workbench remembers between sessions with one folder of runs.

use std::path::{Path, PathBuf, absolute};

use serde::{Deserialize, Serialize};

use super::App;
use crate::tui::actions::Tab;
use crate::tui::input::fill;
use crate::tui::layers::some_of;
use crate::tui::screens::runs::Runs;
use crate::tui::view::Level;
use mge_base::atomic::{Format, Target};
use mge_base::{bounded, json};
use mge_run::{RunDirectory, RunState};
use mge_task::shipped_name;
use mge_trainer::non_default_settings;
use mge_workbench::{Command, command};

/// The name of the file in the folder of runs.
const FILE: &str = ".workbench.json";
/// The format of the file.
const FORMAT: Format<'_> = Format { name: "a session's choices", is: &|found| json::keys(found).contains("screen") };

/// The choices of a session.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Remembered {
    screen: Tab,
    /// The order of the list of runs, and its columns.
    by_success: bool,
    columns: Vec<String>,
    /// The name of the task, or its file; empty if it has none.
    task: String,
    /// Number of seeds of the training started last.
    seeds: u32,
    /// The method of the next run, and settings that are not its defaults.
    settings: Vec<(String, String)>,
    /// The folders of the runs that were being trained, or waited for it, when something else than its user ended the
    /// session.
    cut_off: Vec<PathBuf>,
}

impl Remembered {
    /// Reads what was remembered in a folder of runs; nothing if there is no valid file. What was cut off, and is not being
    /// trained by another program, is told once, whatever ends the session that tells it.
    pub fn load(folder: &Path) -> Option<Self> {
        let mut remembered: Self = serde_json::from_str(&bounded::read_text(&folder.join(FILE)).ok()?).ok()?;
        remembered.cut_off.retain(|run| {
            let state = RunDirectory::open(run).and_then(|run| run.status()).map(|status| status.state);
            !matches!(state, Err(_) | Ok(RunState::Running | RunState::Paused | RunState::Finished))
        });
        if !remembered.cut_off.is_empty() {
            // If that fails, it is told again.
            let _ = Self { cut_off: Vec::new(), ..remembered.clone() }.save(folder);
        }
        Some(remembered)
    }

    /// Writes it to a folder of runs, if that exists.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, folder: &Path) -> std::io::Result<()> {
        match folder.is_dir() {
            true => Target::from(&folder.join(FILE)).write(json::pretty(self).as_bytes(), &FORMAT),
            false => Ok(()),
        }
    }
}

impl App {
    /// The choices to remember.
    pub fn remembered(&self) -> Remembered {
        let view = self.workspace.view();
        let mut settings = non_default_settings(&view.settings);
        settings.retain(|(key, _)| key != "method");
        settings.insert(0, ("method".to_owned(), view.settings.method.to_string()));
        let file = view.file.as_ref().map(|file| absolute(file).unwrap_or(file.clone()).display().to_string());
        let task = file.or_else(|| shipped_name(&view.task.name)).unwrap_or_default();
        let cut_off = view.active_runs().filter(|_| !self.is_leaving()).filter_map(|run| absolute(&run.path).ok());
        let cut_off = cut_off.collect();
        let Runs { by_success, ref columns, .. } = self.screens.runs;
        Remembered {
            screen: self.tab,
            by_success,
            columns: columns.clone(),
            task,
            seeds: self.seeds,
            settings,
            cut_off,
        }
    }

    /// Makes remembered choices again, that of the task unless the user named one. Those that are no longer possible
    /// are told.
    pub fn restore(&mut self, remembered: Remembered, keeps_task: bool) {
        let Remembered { screen, by_success, columns, task, seeds, settings, cut_off } = remembered;
        (self.screens.runs.by_success, self.screens.runs.columns) = (by_success, columns);
        self.seeds = seeds.max(1);
        let task = Some(task).filter(|task| !keeps_task && !task.is_empty()).map(|task| command::Task(task).into());
        let settings = settings.into_iter().map(|(key, value)| match key.as_str() {
            "prior" => command::Model(value.into()).into(),
            _ => command::Set { key, value }.into(),
        });
        for command in task.into_iter().chain(settings).collect::<Vec<Command>>() {
            match self.workspace.apply(command) {
                Ok(report) => self.workspace.log(Level::Info, report),
                Err(error) => self.warn(Level::Warning, &format!("not as in the last session: {error}")),
            }
        }
        self.choose_subject(None, false);
        self.show(screen);
        if !cut_off.is_empty() {
            let names = some_of(cut_off.iter().map(|run| RunDirectory::at(run).name()));
            let remedy = fill("{continue-run} on the Runs screen ({screen-runs}) continues a run");
            self.warn(Level::Warning, &format!("cut off when the last session ended: {names}; {remedy}"));
        }
    }
}
