//! What the workbench remembers between sessions with one folder of runs.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::App;
use crate::tui::actions::Tab;
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
        let settings = &self.workspace.view().settings;
        let mut kept = non_default_settings(settings);
        kept.retain(|(key, _)| SETTINGS.contains(&&**key));
        kept.insert(0, ("method".to_owned(), settings.method.to_string()));
        Remembered { screen: self.tab, seeds: self.seeds, settings: kept }
    }

    /// Makes remembered choices again. Those that are no longer possible are logged.
    pub fn restore(&mut self, remembered: Remembered) {
        let Remembered { screen, seeds, settings } = remembered;
        self.seeds = seeds.max(1);
        for (key, value) in settings {
            let command: Command = match key.as_str() {
                "prior" => command::Model(value.into()).into(),
                _ => command::Set { key, value }.into(),
            };
            if let Err(error) = self.workspace.apply(command) {
                self.workspace.log(Level::Warning, format!("not as in the last session: {error}"));
            }
        }
        self.show(screen);
    }
}
