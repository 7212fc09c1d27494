//! What the actions do that apply everywhere; the screens do the others.

use std::path::PathBuf;

use super::app::{App, TerminalWish};
use super::facts::Level;
use super::layers::{Chooser, Confirm, Deed, Help, Layer, Palette, Prompt, Then, Tour};
use super::screens::Tab;
use crate::guidance::EpsilonSchedule;
use crate::run::RunState;
use crate::task;
use crate::trainer::Method;
use crate::tui::actions::{Action, Context};
use crate::workbench::Command;

impl App {
    /// Does what an action asks for.
    pub fn perform(&mut self, action: Action) {
        match action {
            Action::Train => self.train(),
            Action::Pause => self.pause(),
            Action::Stop => self.ask_to_stop(),
            Action::Epsilon => self.ask_for_epsilon(),
            Action::EpsilonUp => self.change_epsilon(0.05),
            Action::EpsilonDown => self.change_epsilon(-0.05),
            Action::Clusters => self.line("clusters"),
            Action::Guide => self.line("guide"),
            Action::Export => self.export_all(),
            Action::Method => self.choose_method(),
            Action::Task => self.choose_task(),
            Action::Model => self.choose_model(),
            Action::Seed => self.ask_for_number("seed", "a whole number; it decides everything random"),
            Action::Episodes => self.ask_for_number("episodes", "episodes of the next run"),
            Action::Undo => self.line("undo"),
            Action::Redo => self.line("redo"),
            Action::Save if self.desk.facts().file.is_none() => self.ask_where_to_save(),
            Action::Save => self.line("save"),
            Action::SaveAs => self.ask_where_to_save(),
            Action::Copy => self.copy_command(),
            Action::Palette => self.layers.push(Layer::Palette(Palette::new(&self.contexts()))),
            Action::Type(words) => self.layers.push(Layer::Palette(Palette::begun(&self.contexts(), words))),
            Action::Help => self.layers.push(Layer::Help(Help::new(&self.contexts()))),
            Action::Tour => self.layers.push(Layer::Tour(Tour::default())),
            Action::Screen(index) => self.show(Tab::ALL[usize::from(index) % Tab::ALL.len()]),
            Action::NextScreen => self.show(self.tab.next()),
            Action::PreviousScreen => self.show(self.tab.previous()),
            Action::Colours => {
                self.theme = self.theme.next_palette();
                self.say(Level::Info, format!("colours: {}", self.theme.palette.name()));
            }
            Action::Markers => {
                self.theme = self.theme.next_marker();
                self.say(Level::Info, format!("markers: {}", self.theme.marker.name()));
            }
            Action::Mouse => self.switch_mouse(),
            Action::Suspend => self.wish = Some(TerminalWish::Suspend),
            Action::Quit => self.quit(),
            Action::Back => self.back(),
            other => self.perform_on_screen(other),
        }
    }

    fn perform_on_screen(&mut self, action: Action) {
        match self.tab {
            Tab::Scene | Tab::Edit => super::screens::scene::perform(self, action),
            Tab::Schedule => super::screens::schedule::perform(self, action),
            Tab::Training => super::screens::training::perform(self, action),
            Tab::Runs => super::screens::runs::perform(self, action),
            Tab::Models => super::screens::models::perform(self, action),
            Tab::Figures => super::screens::figures::perform(self, action),
            Tab::Log => super::screens::log::perform(self, action),
        }
    }

    /// Shows another screen.
    pub fn show(&mut self, tab: Tab) {
        if tab == Tab::Runs {
            self.desk.look_for_runs();
        }
        self.tab = tab;
    }

    fn train(&mut self) {
        self.line("train");
    }

    fn pause(&mut self) {
        match self.desk.facts().current_run() {
            Some(run) if run.state == RunState::Paused => self.line("resume"),
            _ => self.line("pause"),
        }
    }

    /// Asks a question over the screen; each answer has its key and its meaning.
    pub fn ask(&mut self, title: &str, text: String, answers: Vec<(char, &str, Deed)>) {
        let answers = answers.into_iter().map(|(key, meaning, deed)| (key, meaning.to_owned(), deed)).collect();
        self.layers.push(Layer::Confirm(Confirm { title: title.to_owned(), text, answers, shown: Default::default() }));
    }

    /// Asks before a task with unsaved edits is left.
    pub fn ask_to_discard(&mut self, line: String) {
        let name = &self.desk.facts().task.name;
        let text = format!("The edits of {name} are not saved and will be lost.");
        self.ask("lose the edits?", text, vec![('y', "open the other task", Deed::Certainly(line))]);
    }

    fn ask_to_stop(&mut self) {
        let Some(run) = self.desk.facts().current_run().filter(|run| run.active) else { return self.line("stop") };
        let text = format!(
            "{} ends after the present episode, {} of {}. Its checkpoint is kept: it can be continued later.",
            run.name, run.done, run.episodes
        );
        self.ask("stop the training?", text, vec![('y', "stop it", Deed::Line("stop".to_owned()))]);
    }

    fn ask_for_epsilon(&mut self) {
        let now = self.desk.facts().settings.epsilon.to_string();
        let hint = "0.1 · linear:0.8:0.05:2000 · exp:0.8:0.05:0.999 · step:0.8:0.5:500 · points:0=0.8,1000=0.3";
        let then = Then::Command("epsilon".to_owned());
        self.layers.push(Layer::Prompt(Prompt::new("epsilon schedule", hint, now, then)));
    }

    /// A constant threshold, starting from the one in use now.
    fn change_epsilon(&mut self, by: f32) {
        let facts = self.desk.facts();
        let episode = facts.current_run().filter(|run| run.active).map_or(0, |run| run.done);
        let now = facts.settings.epsilon.threshold(episode as u32);
        let value = ((now + by).clamp(0.0, 1.0) * 100.0).round() / 100.0;
        self.line(&format!("epsilon {}", EpsilonSchedule::Constant(value)));
    }

    fn ask_for_number(&mut self, what: &str, hint: &str) {
        let settings = &self.desk.facts().settings;
        let now = if what == "seed" { settings.seed } else { settings.episodes };
        let then = Then::Command(what.to_owned());
        self.layers.push(Layer::Prompt(Prompt::new(what, hint, now.to_string(), then)));
    }

    fn choose_method(&mut self) {
        let item = |method: Method| {
            (method.name().to_owned(), method.label().to_owned(), Deed::Line(format!("method {method}")))
        };
        let now = &self.desk.facts().settings.method;
        let selected = Method::ALL.iter().position(|method| method.name() == now).unwrap_or(0);
        let items = Method::ALL.into_iter().map(item).collect();
        self.layers.push(Layer::Chooser(Chooser {
            title: "method of the next run".to_owned(),
            items,
            selected,
            shown: Default::default(),
        }));
    }

    fn choose_task(&mut self) {
        let load = |name: &str| Deed::Line(format!("task {name}"));
        let mut items: Vec<(String, String, Deed)> =
            task::shipped().into_iter().map(|task| (task.name.clone(), task.description, load(&task.name))).collect();
        items.push(("another file".to_owned(), "type the path of a task file".to_owned(), Deed::TypeTask));
        let facts = self.desk.facts();
        let selected = items.iter().position(|(name, ..)| *name == facts.task.name).unwrap_or(0);
        self.layers.push(Layer::Chooser(Chooser {
            title: "open a task".to_owned(),
            items,
            selected,
            shown: Default::default(),
        }));
    }

    /// Asks for the path of a task.
    pub fn ask_for_task_file(&mut self) {
        let then = Then::Path("task".to_owned());
        self.layers.push(Layer::Prompt(Prompt::new("open a task file", "path of a JSON file", "", then)));
    }

    fn choose_model(&mut self) {
        let facts = self.desk.facts();
        let deed = |name: &str| Deed::Line(format!("model {}", shell_words::quote(name)));
        let items = facts.models.iter().map(|m| (m.name.clone(), m.about.clone(), deed(&m.name))).collect();
        let selected = facts.models.iter().position(|model| model.name == facts.settings.model).unwrap_or(0);
        let title = "what predicts the rollouts?".to_owned();
        self.layers.push(Layer::Chooser(Chooser { title, items, selected, shown: Default::default() }));
    }

    fn ask_where_to_save(&mut self) {
        let facts = self.desk.facts();
        let path = facts.file.clone().unwrap_or_else(|| format!("my-{}.json", facts.task.name).into());
        let prompt = Prompt::new(
            "save the task as",
            "path of a JSON file",
            path.display().to_string(),
            Then::Path("save".to_owned()),
        );
        self.layers.push(Layer::Prompt(prompt));
    }

    /// The file that a line would overwrite, other than the task's own and figures, which
    /// are made to be made again.
    pub fn would_overwrite(&self, line: &str) -> Option<PathBuf> {
        let command = Command::parse(line).ok().flatten()?;
        let path = command.overwrites()?.to_owned();
        let own = self.desk.facts().file.as_ref() == Some(&path);
        Some(path).filter(|path| path.exists() && !own)
    }

    /// Asks before a file is overwritten.
    pub fn ask_to_overwrite(&mut self, line: String) {
        let path = self.would_overwrite(&line).unwrap_or_default();
        let text = format!("{} exists. What is in it now will be lost.", path.display());
        self.ask("overwrite the file?", text, vec![('y', "overwrite it", Deed::Certainly(line))]);
    }

    /// Exports every figure there is something for, and tells what was left out.
    fn export_all(&mut self) {
        let facts = self.desk.facts();
        let mut kinds = vec!["scene"];
        if facts.prior.is_some() {
            kinds.push("clusters");
        }
        if facts.runs.iter().any(|run| run.opened && run.done > 0) {
            kinds.push("learning");
        }
        if facts.current_run().is_some_and(|run| run.done > 0) {
            kinds.push("dashboard");
        }
        let mut written = Vec::new();
        for kind in kinds {
            match self.write_figure(kind, "png") {
                Ok(_) => written.push(kind),
                Err(error) => return self.say(Level::Error, format!("{kind}: {error}")),
            }
        }
        self.say(Level::Good, format!("wrote {} into figures/, with their numbers as CSV", written.join(", ")));
    }

    /// Exports one figure.
    pub fn export(&mut self, kind: &str, format: &str) {
        match self.write_figure(kind, format) {
            Ok(told) => self.say(Level::Good, told),
            Err(error) => self.say(Level::Error, error),
        }
    }

    fn write_figure(&mut self, kind: &str, format: &str) -> Result<String, String> {
        std::fs::create_dir_all("figures").map_err(|error| format!("cannot make the folder figures: {error}"))?;
        let path = format!("figures/{}-{kind}.{format}", self.desk.facts().task.name);
        self.desk.apply(&format!("figure {kind} {}", shell_words::quote(&path)))
    }

    fn copy_command(&mut self) {
        let facts = self.desk.facts();
        let settings = &facts.settings;
        let task = facts.file.as_ref().map_or_else(|| facts.task.name.clone(), |file| file.display().to_string());
        let folder = settings.folder.join("copy").display().to_string();
        let mut words = ["mge", "train", &task, "--out", &folder].map(str::to_owned).to_vec();
        for (key, value) in self.desk.unusual_settings() {
            match key.as_str() {
                "method" | "episodes" | "seed" | "epsilon" => words.extend([format!("--{key}"), value]),
                "prior" => words.extend(["--model".to_owned(), value]),
                _ => words.extend(["--set".to_owned(), format!("{key}={value}")]),
            }
        }
        let text = shell_words::join(words);
        let unsaved = if facts.dirty { " (without the edits of the task: save them first)" } else { "" };
        self.say(Level::Good, format!("copied{unsaved}: {text}"));
        self.wish = Some(TerminalWish::Copy(text));
    }

    fn switch_mouse(&mut self) {
        self.mouse = !self.mouse;
        self.wish = Some(TerminalWish::Mouse(self.mouse));
        let key = self.keymap.key_for(Action::Mouse, Context::Everywhere);
        let text = if self.mouse { "the mouse works here" } else { "the mouse is the terminal's: select text with it" };
        self.say(Level::Info, format!("{text}; {key} switches"));
    }

    fn back(&mut self) {
        match self.tab {
            Tab::Scene | Tab::Edit => super::screens::scene::back(self),
            Tab::Training if self.curves.leave() => {}
            Tab::Runs if self.runs.leave() => {}
            _ => self.show(Tab::Scene),
        }
    }

    /// Leaves, asking first if something would be lost or stopped.
    pub fn quit(&mut self) {
        if self.layers.iter().any(|layer| matches!(layer, Layer::Confirm(_))) {
            return;
        }
        let facts = self.desk.facts();
        let mut text = Vec::new();
        for run in facts.active_runs() {
            let doing = if run.queued { "waits for a core" } else { "is being trained" };
            text.push(format!("{} {doing}, {} of {} episodes done.", run.name, run.done, run.episodes));
        }
        let trained = !text.is_empty();
        if trained {
            text.push("A run that is stopped keeps a checkpoint and can be continued later.".to_owned());
        }
        if let Some((work, _)) = &facts.model_work {
            text.push(format!("{work} ends, and nothing of it is kept."));
        }
        if facts.dirty {
            text.push(format!("The edits of {} are not saved and will be lost.", facts.task.name));
        }
        if self.schedule.draft.is_some() {
            text.push("The schedule you have drawn is not in use and will be lost.".to_owned());
        }
        if text.is_empty() {
            self.leaving = true;
            return;
        }
        let leave = if trained { "keep a checkpoint, stop and leave" } else { "leave" };
        let mut answers = vec![('y', leave, Deed::Quit)];
        if facts.training_runs().next().is_some() {
            answers.push(('w', "wait: leave when all runs are done", Deed::QuitLater));
        }
        self.leaving_later = false;
        self.ask("leave the workbench?", text.join("\n"), answers);
    }
}
