//! Layers over the screen, and questions before something is lost.

use std::path::{Path, PathBuf};

use super::App;
use crate::tui::effect::{Effect, Layer};
use crate::tui::layers::Question;
use mge_workbench::{Command, command};

impl App {
    /// Opens a layer over the screen.
    pub fn open(&mut self, layer: impl Layer + 'static) {
        self.layers.push(Box::new(layer));
    }

    pub(super) fn ask(&mut self, title: &str, text: String, answers: Vec<(char, &str, Effect)>) {
        self.open(Question::warning(title, text, answers));
    }

    /// Asks before a task with unsaved edits is left.
    pub(super) fn ask_to_discard(&mut self, command: Command) {
        let text = format!("The edits of {} are not saved and will be lost.", self.workspace.view().task.name);
        let open = Effect::new(|app| app.apply_confirmed(command));
        self.ask("lose the edits?", text, vec![('y', "open the other task", open)]);
    }

    /// The file that a command would overwrite, other than the task's own.
    pub(super) fn would_overwrite(&self, command: &Command) -> Option<PathBuf> {
        command.overwrites().filter(|path| self.workspace.view().file.as_ref() != Some(path))
    }

    /// Asks before a file is overwritten.
    pub(super) fn ask_to_overwrite(&mut self, path: &Path, command: Command) {
        let mut text = format!("{} exists. What is in it now will be lost.", path.display());
        let table = path.with_extension("csv");
        if matches!(command, Command::Figure(_)) && table.exists() {
            text += &format!(" So will what is in {}.", table.display());
        }
        let overwrite = Effect::new(|app| app.apply_confirmed(command.forced()));
        self.ask("overwrite the file?", text, vec![('y', "overwrite it", overwrite)]);
    }

    /// Opens the palette with the command that saves the task as another file.
    pub fn save_as(&mut self) {
        let view = self.workspace.view();
        let path = view.file.clone().unwrap_or_else(|| format!("my-{}.json", view.task.name).into());
        self.open_palette(&Command::from(command::Save(Some((&path).into()))).to_string());
    }
}
