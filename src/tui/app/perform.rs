//! What actions do with the app.

use std::path::{Path, PathBuf};
use std::thread;

use super::{App, Awaited};
use crate::tui::actions::{Entry, Run, Tab};
use crate::tui::effect::{Effect, Layer};
use crate::tui::input::fill;
use crate::tui::layers::{Arguments, CommandPalette, Question, some_of};
use crate::tui::screens::{Ui, figures, run_form, runs, scene, schedule, training};
use crate::tui::terminal::report_at_the_end;
use crate::tui::view::playback::Player;
use crate::tui::view::{Choice, Level, RunSummary, ViewModel};
use crate::tui::widgets::theme::{Palette, Theme};
use mge_base::text::counted;
use mge_run::deletions;
use mge_task::Object;
use mge_workbench::{Command, command};

/// Number of typed commands that are kept.
const MAX_HISTORY: usize = 100;

impl App {
    /// Carries out an action.
    pub fn perform(&mut self, entry: &Entry) {
        match entry.run {
            Run::Verb => match Command::parse(entry.verb) {
                Ok(Some(command)) => self.apply(command),
                _ => self.open_palette(entry.verb),
            },
            Run::Do(work) => work(self),
            Run::Change(change) => {
                let (screens, ui) = self.screens_and_ui();
                change(screens, &ui);
            }
            Run::Effects(act) => self.act(act),
        }
    }

    /// Carries out a command, and shows its report or its error; asks first if unsaved work or a file would be lost.
    pub fn apply(&mut self, command: impl Into<Command>) {
        self.carry_out(vec![Effect::apply(command)]);
    }

    /// Like [`App::apply`], but returns the error.
    ///
    /// # Errors
    /// When the command fails.
    pub fn try_apply(&mut self, command: Command) -> Result<(), String> {
        if let Command::Model(command::Model(source)) = &command
            && let Some(unfit) = self.workspace.view().models.iter().find(|it| !it.fits && it.name == source.place())
        {
            return Err(format!("{}: {}", unfit.name, unfit.about.split(';').next().unwrap_or_default()));
        }
        match command {
            Command::Quit(_) => self.quit(),
            Command::Task(_) if !self.unsaved().is_empty() => {
                let open = Effect::new(|app| app.apply_confirmed(command));
                self.ask("open another task?", self.unsaved().join("\n"), vec![('y', "open the other task", open)]);
            }
            command => {
                let ViewModel { file, folder, .. } = self.workspace.view();
                let (lost, what, verb) = match &command {
                    Command::EmptyTrash(trash) => {
                        let runs = deletions(trash.0.as_ref().unwrap_or(folder)).unwrap_or_default();
                        (runs.concat(), "deleted run", "remove")
                    }
                    _ => (command.overwrites(), "file", "overwrite"),
                };
                let lost: Vec<PathBuf> = lost.into_iter().filter(|path| file.as_ref() != Some(path)).collect();
                if lost.is_empty() {
                    return self.apply_confirmed(command);
                }
                let title = format!("{verb} {}?", counted(lost.len(), what));
                let names = some_of(lost.iter().map(|path| path.display().to_string()));
                let go = Effect::new(|app| app.apply_confirmed(command.forced()));
                self.ask(&title, format!("What they contain will be lost: {names}."), vec![('y', verb, go)]);
            }
        }
        Ok(())
    }

    /// Carries out a typed command. On the Runs screen, one on a run is on the selected run, as one by a key is.
    ///
    /// # Errors
    /// When the command fails.
    pub fn apply_typed(&mut self, command: Command) -> Result<(), String> {
        let chosen = self.screens.acted_on(&self.ui(), self.tab);
        let is_on_run = match &command {
            Command::Continue(continued) => continued.folder.is_none(),
            Command::Pause(_) | Command::Resume(_) | Command::Stop(_) | Command::Guide(_) => true,
            Command::Evaluate(_) | Command::Checkpoint(_) | Command::Fork(_) => true,
            // The next runs get the schedule, too, for which none has to be chosen or watched.
            Command::Epsilon(_) => chosen.len() == 1 && self.subject.run().is_some(),
            _ => false,
        };
        match chosen.as_slice() {
            [run] if is_on_run => self.apply_to(&run.path.clone(), command),
            [_, _, ..] if is_on_run => Err(fill(&format!("what is typed is for a single run: {}", runs::SINGLE))),
            _ => self.try_apply(command),
        }
    }

    /// Carries out a command on a run. The watched run stays the same, unless the command plays or trains the other.
    ///
    /// # Errors
    /// When the command fails.
    pub fn apply_to(&mut self, run: &Path, command: Command) -> Result<(), String> {
        let watched = self.subject.run().map(|watched| watched.path.clone());
        let is_other = watched.as_deref() != Some(run);
        let stays = matches!(command, Command::Evaluate(_) | Command::Fork(_) | Command::Continue(_));
        if is_other {
            self.workspace.apply(command::Open(run.to_owned()).into())?;
        }
        let outcome = self.try_apply(command);
        if let Some(watched) = watched.filter(|_| is_other && (outcome.is_err() || !stays)) {
            self.workspace.apply(command::Open(watched).into())?;
        }
        self.choose_subject(None, false);
        outcome
    }

    /// Selects the watched run in the list of runs, or its group, unless it is to be `alone`.
    pub fn follow_watched(&mut self, alone: bool) {
        if let Some(run) = self.subject.run() {
            self.screens.runs.follow(&run.path, alone);
        }
    }

    /// Carries out a command whose loss of work the user has confirmed.
    ///
    /// # Errors
    /// When the command fails.
    pub fn apply_confirmed(&mut self, command: Command) -> Result<(), String> {
        let [is_schedule, is_task] = [matches!(command, Command::Epsilon(_)), matches!(command, Command::Task(_))];
        let is_training = matches!(command, Command::Train(_));
        let begins_hand_play = matches!(command, Command::Place(_)) && self.screens.scene.hand.is_none();
        let ViewModel { runs, settings, .. } = self.workspace.view();
        let same = match &command {
            Command::Train(train) => run_form::same(runs, settings, train.seeds.unwrap_or(1)),
            _ => None,
        };
        let report = self.workspace.apply(command)? + &same.map_or_else(String::new, |same| format!("; {same}"));
        if !report.is_empty() {
            self.workspace.log(Level::Info, report.clone());
        }
        if is_schedule {
            self.screens.schedule.discard();
        }
        // What was selected in another task, or is gone, is no longer selected.
        let objects = self.workspace.view().objects();
        let is_there = |object: &Object| !is_task && objects.position(*object).is_some();
        self.screens.scene.select(self.screens.scene.selected().filter(is_there));
        // The command succeeds even if the tool could not be placed.
        let level = if report.starts_with("not placed") { Level::Warning } else { Level::Good };
        self.show_message(level, report);
        // Update the subject at once: the next effect may refer to it.
        let choice = begins_hand_play.then(|| self.screens.scene.take_tool(self.workspace.view()));
        self.choose_subject(choice, false);
        if is_training {
            self.follow_watched(false);
        }
        Ok(())
    }

    /// Carries out commands, unless one of them would be refused: nothing has changed then.
    ///
    /// # Errors
    /// When one of them is refused.
    pub fn apply_all(&mut self, commands: Vec<Command>) -> Result<(), String> {
        self.workspace.check(&commands)?;
        commands.into_iter().try_for_each(|command| self.try_apply(command))
    }

    /// Opens a layer over the screen.
    pub fn open(&mut self, layer: impl Layer + 'static) {
        self.layers.push(Box::new(layer));
    }

    pub(super) fn ask(&mut self, title: &str, text: String, answers: Vec<(char, &str, Effect)>) {
        self.open(Question::warning(title, text, answers));
    }

    /// Opens the palette with the command that saves the task as another file.
    pub fn save_as(&mut self) {
        let view = self.workspace.view();
        let path =
            view.file.clone().unwrap_or_else(|| format!("my-{}.json", view.task.name.trim_start_matches("my-")).into());
        self.open_palette(&Command::from(command::Save(Some((&path).into()))).to_string());
    }

    /// Opens the dialog that starts a training.
    pub fn ask_to_train(&mut self) {
        self.open(run_form::form(&self.ui(), self.seeds));
        if self.screens.schedule.is_edited() {
            let text = fill("the drawn schedule is not in use: {apply} on the Schedule screen uses it");
            self.show_message(Level::Warning, text);
        }
    }

    /// On the Models screen, stops the training of a model, if there is one, after a question; else that of runs.
    pub fn stop(&mut self) {
        match &self.workspace.view().model_work {
            Some((work, _)) if self.tab == Tab::Models => {
                let text = format!("{work} ends and its progress is lost.");
                let stop = Effect::apply(command::ModelStop);
                self.ask("stop the training of the model?", text, vec![('y', "stop", stop)]);
            }
            _ => self.on_chosen(runs::stop),
        }
    }

    /// What opening another task, or leaving, loses.
    pub(super) fn unsaved(&self) -> Vec<String> {
        let ViewModel { task, dirty, proposed, proposing, .. } = self.workspace.view();
        let search = proposing.map(|_| "The search for subgoals ends without a result.".to_owned());
        let edits = dirty.then(|| format!("The task {} is edited and not saved: the edits would be lost.", task.name));
        let (count, name) = (proposed.len(), &task.name);
        let proposals = format!("{} for {name}, not accepted yet, would be lost.", counted(count, "proposal"));
        edits.into_iter().chain(search).chain(Some(proposals).filter(|_| count > 0)).collect()
    }

    /// Carries out an action on runs: on the Runs screen on the marked ones or those of the selected line, elsewhere on
    /// the watched one.
    pub fn on_chosen(&mut self, act: fn(&[&RunSummary], &Ui<'_>) -> Vec<Effect>) {
        let effects = match self.screens.acted_on(&self.ui(), self.tab).as_slice() {
            [] => vec![Effect::info("there is no run")],
            runs => act(runs, &self.ui()),
        };
        self.carry_out(effects);
    }

    /// Exports the selected figure.
    pub fn export_selected(&mut self, format: &str) {
        let kind = figures::selected(&self.screens);
        let figure = figures::export(kind, format, &self.screens, &self.ui());
        self.apply(figure);
    }

    /// Opens the selected figure, once exported, in the system's viewer.
    pub fn view_figure(&mut self) {
        let file = figures::file(figures::selected(&self.screens), "png", &self.screens, &self.ui());
        if !file.exists() {
            let export = fill("{export-figure} exports it");
            return self.show_message(Level::Info, format!("{} does not exist yet: {export}", file.display()));
        }
        self.show_message(Level::Good, format!("opening {}", file.display()));
        // This waits for the viewer.
        thread::spawn(move || {
            if let Err(error) = open::that_detached(&file) {
                report_at_the_end(format!("no viewer opens {}: {error}", file.display()));
            }
        });
    }

    /// Undoes the latest edit of the schedule on its screen, the latest deletion on the Runs screen, or else the latest
    /// edit of the task.
    pub fn undo(&mut self) {
        match self.tab {
            Tab::Schedule if self.screens.schedule.undo() => {}
            Tab::Schedule => {
                let text = "there is no schedule edit to undo; task edits are undone on the Scene and Edit screens";
                self.show_message(Level::Info, text);
            }
            Tab::Runs => self.apply(command::Restore(None)),
            _ => self.apply(command::Undo),
        }
    }

    /// Saves the task to its file; without one, asks for it.
    pub fn save(&mut self) {
        match self.workspace.view().file {
            Some(_) => self.apply(command::Save(None)),
            None => self.save_as(),
        }
    }

    /// Opens the palette, with the beginning of a command typed in.
    pub fn open_palette(&mut self, words: &str) {
        let mut palette = self.palette();
        if !words.is_empty() {
            palette.paste(&format!("{words} "));
        }
        self.open(palette);
    }

    /// Opens the palette with the keys of the screen first.
    pub fn show_help(&mut self) {
        self.open(self.palette().with_screen_first(&self.contexts()));
    }

    fn palette(&self) -> CommandPalette {
        let run = self.screens.acted_on(&self.ui(), self.tab).first().copied();
        CommandPalette::new(&self.contexts(), Arguments::new(self.workspace.view(), run), self.typed.clone())
    }

    /// Adds a typed command to the palette's history.
    pub fn remember(&mut self, line: String) {
        self.typed.retain(|known| *known != line);
        self.typed.push(line);
        self.typed.drain(..self.typed.len().saturating_sub(MAX_HISTORY));
    }

    /// Shows another screen.
    pub fn show(&mut self, tab: Tab) {
        self.tab = tab;
        self.screens.scene.player.hold(tab == Tab::Edit);
    }

    /// Changes to the next palette.
    pub fn change_theme(&mut self) {
        let Theme { palette, depth, marker, .. } = self.theme;
        self.theme = Theme::new(Palette::ALL[(palette as usize + 1) % Palette::ALL.len()], depth, marker);
        self.show_message(Level::Info, format!("colours: {}", self.theme.palette.name()));
    }

    /// Moves what is selected in a direction: an object, the tool in hand, a point, or the crosshair and the curves.
    pub fn move_by(&mut self, direction: [f32; 2], far: bool) {
        let tab = self.tab;
        self.act(|screens, ui| match tab {
            Tab::Scene | Tab::Edit => scene::move_by(&mut screens.scene, ui, direction, far),
            Tab::Schedule => schedule::move_by(&mut screens.schedule, ui, direction, far),
            Tab::Training => training::move_by(screens, ui, direction, far),
            _ => Vec::new(),
        });
    }

    /// Selects a line of the list on the screen, given the present and the last one.
    pub fn select_line(&mut self, line: fn(usize, usize) -> usize) {
        let tab = self.tab;
        let (screens, ui) = self.screens_and_ui();
        screens.select_line(&ui, tab, line);
    }

    /// Changes the playback of the episode that is shown, given its number of steps.
    pub fn play(&mut self, change: fn(&mut Player, usize)) {
        change(&mut self.screens.scene.player, self.subject.episode.steps());
    }

    /// Shows a past episode of the watched run as soon as it has been read; with `keeps_step` at the step of the one
    /// shown now, so that one moment can be followed through the training.
    ///
    /// # Errors
    /// When there is no such episode.
    pub fn await_episode(&mut self, number: u64, keeps_step: bool) -> Result<(), String> {
        if keeps_step && self.subject.past_episode() == Some(number) {
            return Ok(());
        }
        let run = self.subject.run().ok_or("no run is being watched")?.path.clone();
        self.awaited = Some(Awaited { run, number, keeps_step });
        self.show_awaited()
    }

    /// Shows the awaited episode if it has been read.
    pub(super) fn show_awaited(&mut self) -> Result<(), String> {
        let Some(&Awaited { ref run, number, keeps_step }) = self.awaited.as_ref() else { return Ok(()) };
        let Some(episode) = self.workspace.past_episode(run, number) else { return Ok(()) };
        self.awaited = None;
        let episode = episode?;
        let step = self.subject.past_episode().map_or(0, |_| self.screens.scene.player.step());
        if !keeps_step {
            let last = self.subject.run().map_or(0, |run| run.done);
            let goal = if episode.trace.reached_goal() { ", which reached the goal" } else { "" };
            let leave = fill("{back} returns to the latest episode");
            self.show_message(Level::Info, format!("episode {} of {last}{goal}; {leave}", episode.trace.episode));
        }
        self.choose_subject(Some(Choice::Past(episode)), false);
        if keeps_step {
            self.screens.scene.player.seek(step.min(self.subject.episode.steps()));
        }
        Ok(())
    }

    /// Leaves what is open or selected on the screen; never the screen itself.
    pub fn back(&mut self) {
        let is_past = matches!(self.subject.choice, Choice::Past(_));
        let choice = match self.tab {
            Tab::Scene | Tab::Edit if self.screens.scene.drop_dragged().is_some() => None,
            Tab::Scene | Tab::Edit if self.screens.scene.hand.is_some() => Some(self.screens.scene.put_tool_down()),
            Tab::Training if self.screens.curves.leave() => None,
            Tab::Scene | Tab::Edit | Tab::Training if is_past => Some(Choice::Latest),
            Tab::Scene | Tab::Edit if self.screens.scene.selected().is_some() => {
                return self.screens.scene.select(None);
            }
            Tab::Runs if self.screens.runs.leave() => None,
            Tab::Log if self.screens.log.leave() => None,
            _ => {
                let text = fill("nothing is open: {screen-scene} shows the scene, {quit} leaves");
                return self.show_message(Level::Info, text);
            }
        };
        if let Some(choice) = choice {
            self.choose_subject(Some(choice), false);
        }
    }

    /// Keeps the preview of the selected figure up to date.
    pub(super) fn update_preview(&mut self) {
        let wanted = figures::wanted(&self.screens, &self.ui(), &self.regions);
        if let Some(wanted) = wanted {
            let workspace = &self.workspace;
            self.changed |= self.screens.preview.update(&wanted, || workspace.figure(wanted.kind, &wanted.composition));
        }
    }

    /// Selects a row of a list: an object, a run, a model or a figure. A run that is selected already is watched.
    pub(super) fn select_row(&mut self, row: usize) {
        let tab = self.tab;
        self.act(|screens, ui| {
            match tab {
                Tab::Edit => screens.scene.select(ui.view.objects().all().get(row).copied()),
                Tab::Runs if screens.runs.is_selected(ui, row) => {
                    return runs::on_line(&mut screens.runs, ui, runs::watch);
                }
                _ => screens.select_line(ui, tab, |_, _| row),
            }
            Vec::new()
        });
    }
}
