//! Prompts, selection lists, and questions before something is lost.

use std::path::{Path, PathBuf};

use super::App;
use crate::tui::effect::{Effect, Layer};
use crate::tui::layers::{Prompt, Question};
use mge_base::paths::expanded;
use mge_task as task;
use mge_trainer::{Method, PriorSource};
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
        self.ask(
            "lose the edits?",
            text,
            vec![('y', "open the other task", Effect::new(|app| app.apply_confirmed(command)))],
        );
    }

    /// The file that a command would overwrite, other than the task's own.
    pub(super) fn would_overwrite(&self, command: &Command) -> Option<PathBuf> {
        command.overwrites().filter(|path| path.exists() && self.workspace.view().file.as_ref() != Some(path))
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

    pub fn ask_for_epsilon(&mut self) {
        let now = self.workspace.view().settings.epsilon.to_string();
        let hint = "0.1 · linear:0.8:0.05:2000 · exp:0.8:0.05:0.999 · step:0.8:0.5:500 · points:0=0.8,1000=0.3 · \
                    need:0.5:0.25:20";
        self.open(Prompt::arguments("epsilon", "epsilon schedule", hint, now));
    }

    pub fn ask_for_seed(&mut self) {
        let now = self.workspace.view().settings.seed.to_string();
        self.open(Prompt::arguments("seed", "seed", "a whole number; it determines everything random", now));
    }

    pub fn ask_for_seeds(&mut self) {
        let first = self.workspace.view().settings.seed;
        let hint = format!("a number of seeds, from {first} on: a run is trained for each, and they are one group");
        self.open(Prompt::arguments("train seeds", "train: how many seeds?", hint, "1"));
    }

    pub fn ask_for_episodes(&mut self) {
        let now = self.workspace.view().settings.episodes.to_string();
        self.open(Prompt::arguments("episodes", "episodes", "episodes of the next run", now));
    }

    pub fn choose_method(&mut self) {
        let item = |method: Method| {
            (method.name().to_owned(), method.label().to_owned(), Effect::apply(command::Method(method)))
        };
        let now = self.workspace.view().settings.method;
        let selected = Method::ALL.iter().position(|method| *method == now).unwrap_or(0);
        let items = Method::ALL.into_iter().map(item).collect();
        self.open(Question::list("method of the next run", items, selected));
    }

    pub fn choose_task(&mut self) {
        let item = |task: task::Task| {
            let open = Effect::apply(command::Task(task.name.clone()));
            (task.name, task.description, open)
        };
        let mut items: Vec<(String, String, Effect)> = task::shipped().into_iter().map(item).collect();
        items.extend(task::level_names().map(|name| {
            let name = format!("create/{name}");
            (name.clone(), "a level of CREATE".to_owned(), Effect::apply(command::Task(name)))
        }));
        let read = |path: &str| Ok(Effect::apply(command::Task(path.to_owned())));
        let prompt = Prompt::new("open a task file", "path of a JSON file", "", read);
        let other = Effect::open(prompt);
        items.push(("another file".to_owned(), "type the path of a task file".to_owned(), other));
        let now = &self.workspace.view().task.name;
        let selected = items.iter().position(|(name, ..)| name == now).unwrap_or(0);
        self.open(Question::list("open a task", items, selected));
    }

    pub fn choose_model(&mut self) {
        let view = self.workspace.view();
        let choose = |name: &str| Effect::apply(command::Model(PriorSource::from(name.to_owned())));
        let items = view.models.iter().map(|m| (m.name.clone(), m.about.clone(), choose(&m.name))).collect();
        let selected = view.models.iter().position(|model| model.name == view.settings.prior.place()).unwrap_or(0);
        self.open(Question::list("what predicts the rollouts?", items, selected));
    }

    pub fn ask_where_to_save(&mut self) {
        let view = self.workspace.view();
        let path = view.file.clone().unwrap_or_else(|| format!("my-{}.json", view.task.name).into());
        let read = |path: &str| Ok(Effect::apply(command::Save(Some((&expanded(path)).into()))));
        self.open(Prompt::new("save the task as", "path of a JSON file", path.display().to_string(), read));
    }
}
