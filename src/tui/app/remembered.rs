//! What the workbench remembers between sessions with one folder of runs.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::App;
use crate::tui::actions::Tab;
use crate::tui::screens::runs::Sort;
use crate::tui::view::Level;
use mge_base::atomic::{Format, Target};
use mge_base::{bounded, json};
use mge_trainer::non_default_settings;
use mge_workbench::{Command, command};

/// The name of the file in the folder of runs.
const FILE: &str = ".workbench.json";
/// The settings of the next run that are remembered besides the method.
const SETTINGS: [&str; 5] = ["episodes", "epsilon", "prior", "stop.success", "stop.minutes"];
/// The format of the file.
const FORMAT: Format<'static> =
    Format { name: "the choices of a session", is: &|found| json::keys(found).contains("screen") };

/// The choices of a session.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Remembered {
    screen: Tab,
    /// The order of the list of runs.
    sort: Sort,
    /// Whether the order is reversed.
    reversed: bool,
    /// The columns of the list of runs, as they are typed.
    columns: String,
    /// Number of seeds of the training started last.
    seeds: u32,
    /// The method of the next run, and settings that are not its defaults.
    settings: Vec<(String, String)>,
}

impl Remembered {
    /// Reads what was remembered in a folder of runs; nothing if there is no valid file.
    pub fn load(folder: &Path) -> Option<Self> {
        serde_json::from_str(&bounded::read_text(&folder.join(FILE)).ok()?).ok()
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
        let (runs, settings) = (&self.screens.runs, &self.workspace.view().settings);
        let mut kept = non_default_settings(settings);
        kept.retain(|(key, _)| SETTINGS.contains(&&**key));
        kept.insert(0, ("method".to_owned(), settings.method.to_string()));
        let (sort, reversed, columns) = (runs.sort, runs.reversed, runs.columns());
        Remembered { screen: self.tab, sort, reversed, columns, seeds: self.seeds, settings: kept }
    }

    /// Makes remembered choices again. Those that are no longer possible are logged.
    pub fn restore(&mut self, remembered: Remembered) {
        let Remembered { screen, sort, reversed, columns, seeds, settings } = remembered;
        let runs = &mut self.screens.runs;
        (runs.sort, runs.reversed, self.seeds) = (sort, reversed, seeds.max(1));
        let mut outcomes = vec![runs.show_columns(&columns)];
        for (key, value) in settings {
            let command: Command = match key.as_str() {
                "prior" => command::Model(value.into()).into(),
                _ => command::Set { key, value }.into(),
            };
            outcomes.push(self.workspace.apply(command).map(drop));
        }
        for error in outcomes.into_iter().filter_map(Result::err) {
            self.workspace.log(Level::Warning, format!("not as in the last session: {error}"));
        }
        self.show(screen);
    }
}
