//! Carries out actions and effects.

use std::path::Path;

use rand::Rng;

use super::{App, QuitState, TerminalRequest};
use crate::tui::actions::{Tab, UiAction};
use crate::tui::effect::Effect;
use crate::tui::layers::{Arguments, CommandPalette, Help};
use crate::tui::screens::{figures, lists, log, models, runs, scene_actions, schedule, training};
use crate::tui::view::{Choice, ComparedEpisode, Level};
use mge_env::Placement;
use mge_guidance::EpsilonSchedule;
use mge_run::RunState;
use mge_task as task;
use mge_trainer::non_default_settings;
use mge_workbench::{Command, FigureKind, command};

/// Number of typed commands that are kept.
const MAX_HISTORY: usize = 100;

impl App {
    /// Carries out an action.
    pub(super) fn perform(&mut self, action: UiAction) {
        match action {
            // On the Runs screen, these apply to the marked runs or the selected line.
            UiAction::Pause | UiAction::Stop | UiAction::Export | UiAction::Fork if self.tab == Tab::Runs => {
                self.perform_on_screen(action)
            }
            // The Training screen shows groups of seeds: ask how many to train.
            UiAction::Train if self.tab == Tab::Training => self.ask_for_seeds(),
            UiAction::Train => self.apply(command::Train::default()),
            UiAction::Pause => match self.subject.run() {
                Some(run) if run.state == RunState::Paused => self.apply(command::Resume { until: None }),
                _ => self.apply(command::Pause),
            },
            UiAction::Stop => {
                let stop = match self.subject.run() {
                    Some(run) => runs::stop(&[run], &self.ui()),
                    None => vec![Effect::apply(command::Stop)],
                };
                self.carry_out(stop);
            }
            UiAction::Fork => match self.subject.run() {
                Some(run) => {
                    let episode = self.subject.past_episode().unwrap_or(run.done);
                    let prompt = runs::ask_to_fork(run, episode);
                    self.carry_out(vec![prompt]);
                }
                None => self.apply(command::Fork { episode: 0, changes: Vec::new(), folder: None, until: None }),
            },
            UiAction::Epsilon => self.ask_for_epsilon(),
            UiAction::EpsilonUp => self.change_epsilon(0.05),
            UiAction::EpsilonDown => self.change_epsilon(-0.05),
            UiAction::Clusters => self.apply(command::Clusters(None)),
            UiAction::Guide => self.apply(command::Guide),
            UiAction::Export => self.export_all(),
            UiAction::Method => self.choose_method(),
            UiAction::Task => self.choose_task(),
            // A short number, easy to note and to type.
            UiAction::Puzzle => self.apply(command::Puzzle(rand::thread_rng().gen_range(0..100_000))),
            UiAction::Model => self.choose_model(),
            UiAction::Seed => self.ask_for_seed(),
            UiAction::Episodes => self.ask_for_episodes(),
            UiAction::Undo if self.tab == Tab::Schedule => {
                if !self.screens.schedule.undo() {
                    self.show_message(
                        Level::Info,
                        "there is no schedule edit to undo; task edits are undone on the Scene and Edit screens",
                    );
                }
            }
            UiAction::Undo if self.tab == Tab::Runs => self.apply(command::Restore(None)),
            UiAction::Undo => self.apply(command::Undo),
            UiAction::Redo => self.apply(command::Redo),
            UiAction::Save if self.workspace.view().file.is_none() => self.ask_where_to_save(),
            UiAction::Save => self.apply(command::Save(None)),
            UiAction::SaveAs => self.ask_where_to_save(),
            UiAction::Copy => self.copy_command(),
            UiAction::Palette => self.open(self.palette()),
            UiAction::Type(words) => self.open(self.palette().with_text(words)),
            UiAction::Help => self.open(Help::new(&self.contexts())),
            UiAction::Tour => self.show_tour(),
            UiAction::Screen(tab) => self.show(tab),
            UiAction::NextScreen => self.show(self.tab.next()),
            UiAction::PreviousScreen => self.show(self.tab.previous()),
            UiAction::Colours => {
                self.follows_background = false;
                self.theme = self.theme.next_palette();
                self.show_message(Level::Info, format!("colours: {}", self.theme.palette.name()));
            }
            UiAction::Markers => {
                self.theme = self.theme.next_marker();
                self.show_message(Level::Info, format!("markers: {}", self.theme.marker.name()));
            }
            UiAction::Mouse => self.switch_mouse(),
            UiAction::Suspend => self.request = Some(TerminalRequest::Suspend),
            UiAction::Quit => self.quit(),
            UiAction::Back => self.back(),
            other => self.perform_on_screen(other),
        }
    }

    fn palette(&self) -> CommandPalette {
        CommandPalette::new(&self.contexts(), Arguments::new(self.workspace.view()), self.typed.clone())
    }

    fn perform_on_screen(&mut self, action: UiAction) {
        let tab = self.tab;
        let (screens, ui) = self.screens_and_ui();
        let effects = match tab {
            Tab::Scene | Tab::Edit => scene_actions::perform(&mut screens.scene, &ui, action),
            Tab::Schedule => schedule::perform(&mut screens.schedule, &ui, action),
            Tab::Training => match training::without_effect(&screens.curves, &ui, action) {
                Some(why) => vec![Effect::info(ui.text(why))],
                None if scene_actions::is_playback(action) => scene_actions::perform(&mut screens.scene, &ui, action),
                None => training::perform(&mut screens.curves, &screens.runs, &ui, action),
            },
            Tab::Runs => runs::perform(&mut screens.runs, &ui, action),
            Tab::Models => models::perform(&mut screens.lists, &ui, action),
            Tab::Figures => figures::perform(&mut screens.lists, &screens.runs, &ui, action),
            Tab::Log => log::perform(&mut screens.lists, &ui, action),
        };
        self.carry_out(effects);
        self.show_beside();
    }

    /// Carries out an effect.
    pub(super) fn try_effect(&mut self, effect: Effect) -> Result<(), String> {
        match effect {
            Effect::Apply(Command::Quit(_)) => self.quit(),
            Effect::Apply(command @ (Command::Task(_) | Command::Puzzle(_))) if self.workspace.view().dirty => {
                self.ask_to_discard(command)
            }
            Effect::Apply(command) => match self.would_overwrite(&command) {
                Some(path) => self.ask_to_overwrite(&path, command),
                None => self.report(command)?,
            },
            Effect::ApplyConfirmed(command) => self.report(command)?,
            Effect::Perform(action) => self.perform(action),
            Effect::PerformOn(tab, action) => {
                self.show(tab);
                self.perform(action);
            }
            Effect::ShowMessage(level, text) => self.show_message(level, text),
            Effect::Open(layer) => self.layers.push(layer),
            Effect::Select(object) => self.screens.scene.select(object),
            Effect::Hold(number) => self.screens.scene.hold(number),
            Effect::Show(choice) => self.choose_subject(Some(choice), false),
            Effect::Replay(episode) => self.replay(episode)?,
            Effect::Scrub(episode) => self.scrub(episode)?,
            Effect::NextEpisode => self.choose_subject(None, true),
            Effect::Filter(text) => self.screens.runs.filter(&text)?,
            Effect::Columns(text) => self.screens.runs.show_columns(&text)?,
            Effect::PinBaseline(label) => {
                let report = self.workspace.pin_baseline(&label);
                self.show_message(Level::Info, report);
            }
            Effect::NameCurve { label, name } => self.screens.lists.composer.name(&label, &name),
            Effect::Compare => {
                self.screens.curves.comparing = true;
                self.show(Tab::Training);
            }
            Effect::Remember(line) => {
                self.typed.retain(|known| *known != line);
                self.typed.push(line);
                self.typed.drain(..self.typed.len().saturating_sub(MAX_HISTORY));
            }
            Effect::All(effects) => {
                for effect in effects {
                    self.try_effect(effect)?;
                }
            }
            Effect::Export(figures) => {
                for (kind, format) in figures {
                    self.export(kind, format)?;
                }
            }
            Effect::Quit => self.leaving = QuitState::Now,
            Effect::QuitToBackground => {
                self.background = self.workspace.view().training_runs().map(|run| run.path.clone()).collect();
                self.leaving = QuitState::Now;
            }
            Effect::QuitWhenIdle => {
                self.leaving = QuitState::WhenIdle;
                self.show_message(Level::Info, "leaving when all runs are done; quit again to change that");
            }
        }
        Ok(())
    }

    /// Carries out a command and shows its result.
    fn report(&mut self, command: Command) -> Result<(), String> {
        let places = matches!(command, Command::Place(_));
        let report = self.workspace.apply(command)?;
        let latest = self.workspace.view().hand.trace.steps.last().map(|step| step.placement);
        // The command succeeds even if the tool could not be placed; that is shown as an error.
        let is_refused = places && latest.is_some_and(|placement| placement != Placement::Placed);
        self.show_message(if is_refused { Level::Error } else { Level::Good }, report);
        // Update the subject at once: the next effect may refer to it.
        self.choose_subject(None, false);
        Ok(())
    }

    fn apply(&mut self, command: impl Into<Command>) {
        self.carry_out(vec![Effect::apply(command)]);
    }

    /// Shows another screen.
    pub(super) fn show(&mut self, tab: Tab) {
        if tab == Tab::Runs {
            self.workspace.look_for_runs();
        }
        self.tab = tab;
        self.screens.scene.player.hold(tab == Tab::Edit);
    }

    /// Sets a constant threshold: the current one changed by `by`.
    fn change_epsilon(&mut self, by: f32) {
        let episode = self.subject.run().filter(|run| run.active).map_or(0, |run| run.done);
        let now = self.workspace.view().settings.epsilon.threshold(episode as u32);
        let value = ((now + by).clamp(0.0, 1.0) * 100.0).round() / 100.0;
        self.apply(command::Epsilon(EpsilonSchedule::Constant(value)));
    }

    /// Replays a past episode of the watched run.
    fn replay(&mut self, episode: u64) -> Result<(), String> {
        let run = self.subject.run().ok_or("no run is being watched")?;
        let last = run.done;
        let episode = self.workspace.past_episode(&run.path, episode)?;
        let goal = if episode.trace.reached_goal() { ", which reached the goal" } else { "" };
        let leave = self.keymap.fill("{source} returns to the latest episode");
        self.show_message(Level::Info, format!("episode {} of {last}{goal}; {leave}", episode.trace.episode));
        self.choose_subject(Some(Choice::Past(episode)), false);
        Ok(())
    }

    /// Exports every figure that has data, and reports which.
    fn export_all(&mut self) {
        let view = self.workspace.view();
        let mut kinds = vec![FigureKind::Scene];
        if view.prior.is_some() {
            kinds.push(FigureKind::Clusters);
        }
        if view.runs.iter().any(|run| run.done > 0) {
            kinds.push(FigureKind::Learning);
        }
        if view.watched_run().is_some_and(|run| run.done > 0) {
            kinds.push(FigureKind::Dashboard);
        }
        let names: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        let text = format!("drawing {} into figures/, with their numbers as CSV", names.join(", "));
        let figures = kinds.into_iter().map(|kind| (kind, "png")).collect();
        self.carry_out(vec![Effect::Export(figures), Effect::ShowMessage(Level::Good, text)]);
    }

    fn export(&mut self, kind: FigureKind, format: &str) -> Result<(), String> {
        let figure = figures::export(kind, format, &self.screens.lists, &self.screens.runs, &self.ui());
        self.try_effect(Effect::Apply(figure)).map_err(|error| format!("{}: {error}", kind.name()))
    }

    /// Shows a past episode of the watched run at the same step as before, so that one moment can be followed
    /// through the training.
    fn scrub(&mut self, episode: u64) -> Result<(), String> {
        if self.subject.past_episode() == Some(episode) {
            return Ok(());
        }
        let run = self.subject.run().ok_or("no run is being watched")?;
        let time = self.subject.past_episode().map_or(0, |_| self.screens.scene.player.step());
        let episode = self.workspace.past_episode(&run.path, episode)?;
        self.choose_subject(Some(Choice::Past(episode)), false);
        self.screens.scene.player.seek(time.min(self.subject.episode().steps()));
        Ok(())
    }

    /// Shows the same episode of the compared run beside a past episode of the watched run.
    pub(super) fn show_beside(&mut self) {
        let ui = self.ui();
        let other = training::pair(&self.screens.curves, &self.screens.runs, &ui).map(|[_, other]| other.path.clone());
        let beside = other.zip(self.subject.past_episode()).map(|(run, number)| match self.subject.beside() {
            // The subject drops one with another number.
            Some(known) if known.run == run => known.clone(),
            _ => ComparedEpisode { episode: self.workspace.past_episode(&run, number), run, number },
        });
        self.subject.set_beside(beside);
    }

    /// Copies the command that trains the next run to the clipboard.
    fn copy_command(&mut self) {
        let view = self.workspace.view();
        // The file of an edited task holds an older version.
        let saved = || view.file.as_ref().map(|file| file.display().to_string()).filter(|_| !view.dirty);
        let Some(task) = task::name_of(&view.task).or_else(saved) else {
            return self
                .show_message(Level::Error, self.keymap.fill("no command for an unsaved task: {save} saves it"));
        };
        let mut words = ["mge", "train", &task, "--method", view.settings.method.name()].map(str::to_owned).to_vec();
        for (key, value) in non_default_settings(&view.settings) {
            match key.as_str() {
                "method" => {}
                "tools" | "episodes" | "seed" | "epsilon" => words.extend([format!("--{key}"), value]),
                "prior" => words.extend(["--model".to_owned(), value]),
                _ => words.extend(["--set".to_owned(), format!("{key}={value}")]),
            }
        }
        if view.folder != Path::new("runs") {
            words.splice(..0, ["env".to_owned(), format!("MGE_RUNS={}", view.folder.display())]);
        }
        let text = shell_words::join(words);
        self.show_message(Level::Good, format!("copied: {text}"));
        self.request = Some(TerminalRequest::Copy(text));
    }

    fn switch_mouse(&mut self) {
        self.mouse = !self.mouse;
        self.request = Some(TerminalRequest::Mouse(self.mouse));
        let text = match self.mouse {
            true => "the workbench handles the mouse; {mouse} switches",
            false => "the terminal handles the mouse, for example to select text; {mouse} switches",
        };
        self.show_message(Level::Info, self.keymap.fill(text));
    }

    fn back(&mut self) {
        let effects = match self.tab {
            Tab::Scene | Tab::Edit => self.screens.scene.back(&self.subject),
            Tab::Training if self.screens.curves.leave() => Vec::new(),
            Tab::Training if matches!(self.subject.choice(), Choice::Past(_)) => vec![Effect::Show(Choice::Latest)],
            Tab::Runs if self.screens.runs.leave() => Vec::new(),
            Tab::Figures if self.screens.lists.composer.leave() => Vec::new(),
            _ => vec![Effect::Perform(UiAction::Screen(Tab::Scene))],
        };
        self.carry_out(effects);
    }

    /// Keeps the preview of the selected figure up to date.
    pub(super) fn update_preview(&mut self) {
        let wanted = figures::wanted(&self.screens.lists, &self.screens.runs, &self.ui(), &self.regions);
        if let Some((kind, composition, wanted)) = wanted {
            let workspace = &self.workspace;
            self.changed |= self.screens.preview.update(&wanted, || workspace.figure(kind, &composition));
        }
    }

    /// Selects a row of a list: an object, a run, a model or a figure.
    pub(super) fn select_row(&mut self, row: usize) {
        match self.tab {
            Tab::Edit => {
                let object = self.workspace.view().objects().all().get(row).copied();
                self.screens.scene.select(object);
            }
            Tab::Runs if self.screens.runs.is_selected(&self.ui(), row) => self.perform(UiAction::Confirm),
            Tab::Runs => {
                let (screens, ui) = self.screens_and_ui();
                screens.runs.select(&ui, row);
            }
            tab => lists::select_row(&mut self.screens.lists, tab, row),
        }
    }
}
