//! The workbench on screen: turns keys and mouse events into effects and effects into commands, and draws the
//! result.

mod mouse;
mod perform;
mod quit;
mod remembered;
#[cfg(test)]
pub(super) mod testing;
mod tick;

pub use quit::report_recovered_edits;
pub use remembered::Remembered;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crossterm::event::{Event, KeyEvent, KeyEventKind, KeyModifiers, MouseEvent, MouseEventKind};
use ratatui::Frame;

use super::actions::{Context, Entry, HAND, Tab};
use super::effect::{Effect, Layer, Response};
use super::input::{self, Key};
use super::screens::{Chrome, HitRegions, Screens, Ui, draw_frame};
use super::view::playback::Episode;
use super::view::{Choice, Level, Subject, Workspace};
use super::widgets::theme::Theme;

/// The state of the user interface.
pub struct App {
    workspace: Box<dyn Workspace>,
    theme: Theme,
    /// The screen being shown.
    tab: Tab,
    /// Layers over the screen, the topmost last.
    layers: Vec<Box<dyn Layer>>,
    /// The state of each screen.
    pub(super) screens: Screens,
    /// What the scene shows.
    subject: Subject,
    /// The latest message, its severity, and how long it has been shown.
    message: Option<(Level, String, Duration)>,
    /// Where things were drawn, for the mouse.
    regions: HitRegions,
    /// The terminal is too small to show anything.
    is_too_small: bool,
    /// What the mouse is dragging.
    drag: Option<Drag>,
    /// What only the owner of the terminal can fulfil.
    pub(super) request: Option<TerminalRequest>,
    /// Whether unsaved edits are saved to a new file if the app is dropped without having been left.
    pub(super) keeps_edits: bool,
    leaving: QuitState,
    /// The runs that were being trained at the last poll.
    pub(super) training: Vec<PathBuf>,
    /// Runs to continue in the background after the workbench is left and its trainings have stopped.
    pub(super) background: Vec<PathBuf>,
    /// The greedy episode that was shown last.
    greedy: Option<Arc<Episode>>,
    /// The past episode to show once it has been read.
    awaited: Option<Awaited>,
    /// Commands typed in the palette, the oldest first.
    typed: Vec<String>,
    /// Number of seeds of the training started last.
    pub(super) seeds: u32,
    /// Time since the visible curves were last requested.
    since_request: Duration,
    /// Whether the session has changes that are not yet due to be drawn.
    news: bool,
    /// Time since changes of the session were last due to be drawn.
    since_news: Duration,
    /// Whether the screen must be redrawn.
    changed: bool,
}

/// Whether and when the workbench is to be left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuitState {
    No,
    WhenIdle,
    Now,
}

/// What a press grabbed and a drag moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Drag {
    /// An object of the scene.
    Object,
    /// The selected point of the schedule.
    SchedulePoint,
    /// The crosshair of the curves.
    Crosshair,
}

/// A past episode of the watched run that is being read.
struct Awaited {
    /// Folder of the run.
    run: PathBuf,
    /// Number of the episode, counted from 1.
    number: u64,
    /// Show it at the step of the episode before it, so that one moment can be followed through the training.
    keeps_step: bool,
}

/// A request that only the owner of the terminal can fulfil.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TerminalRequest {
    /// Suspend the program until the shell continues it.
    Suspend,
    /// Notify the user that long work has ended.
    Notify(String),
}

impl App {
    /// The user interface of a workspace.
    pub fn new(workspace: Box<dyn Workspace>, theme: Theme) -> Self {
        let subject = Subject::choose(workspace.view(), &Choice::default(), None, false);
        Self {
            workspace,
            theme,
            tab: Tab::Scene,
            layers: Vec::new(),
            screens: Screens::default(),
            subject,
            message: None,
            regions: HitRegions::new(),
            is_too_small: false,
            drag: None,
            request: None,
            keeps_edits: false,
            leaving: QuitState::No,
            training: Vec::new(),
            background: Vec::new(),
            greedy: None,
            awaited: None,
            typed: Vec::new(),
            seeds: 1,
            since_request: Duration::ZERO,
            news: false,
            since_news: Duration::ZERO,
            changed: true,
        }
    }

    /// Whether the workbench is to be left.
    pub fn is_leaving(&self) -> bool {
        self.leaving == QuitState::Now
    }

    /// Whether there is something new to draw.
    pub fn is_changed(&self) -> bool {
        self.changed
    }

    /// Requests a full redraw, for a terminal that has lost its contents.
    pub fn redraw(&mut self) {
        self.screens.preview.forget();
        self.changed = true;
    }

    /// Whether runs are being read from their folder.
    pub fn is_reading_runs(&self) -> bool {
        self.workspace.view().runs_unread > 0
    }

    /// What the screens draw from.
    fn ui(&self) -> Ui<'_> {
        Ui { view: self.workspace.view(), subject: &self.subject, theme: &self.theme }
    }

    /// The mutable state of the screens, and what they draw from.
    fn screens_and_ui(&mut self) -> (&mut Screens, Ui<'_>) {
        let Self { workspace, subject, theme, screens, .. } = self;
        (screens, Ui { view: workspace.view(), subject, theme })
    }

    /// Changes the state of the screens, and carries out what else is to be done.
    fn act(&mut self, act: impl FnOnce(&mut Screens, &Ui<'_>) -> Vec<Effect>) {
        let (screens, ui) = self.screens_and_ui();
        let effects = act(screens, &ui);
        self.carry_out(effects);
    }

    /// The contexts in which keys are looked up now, the innermost first.
    fn contexts(&self) -> Vec<Context> {
        // The task can be changed on the Scene screen, too, whose footer does not name these keys.
        let by_hand = self.screens.scene.hand.is_some();
        let outer = (self.tab == Tab::Scene || by_hand).then_some(Context::Edit);
        let inner = match self.tab {
            Tab::Scene | Tab::Edit if by_hand => HAND,
            tab => tab.contexts(),
        };
        inner.iter().copied().chain([Context::Everywhere, Context::Typed]).chain(outer).collect()
    }

    /// Handles an event of the terminal.
    pub fn event(&mut self, event: Event) {
        self.screens.scene.player.wake();
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.key(key),
            Event::Mouse(mouse) => self.mouse_event(mouse),
            Event::Paste(text) => {
                if let Some(layer) = self.layers.last_mut() {
                    layer.paste(&text);
                    self.changed = true;
                }
            }
            Event::Resize(..) => self.changed = true,
            _ => {}
        }
    }

    fn key(&mut self, key: KeyEvent) {
        self.changed = true;
        let entry = input::entry(Key::from(key), &self.contexts());
        // With Ctrl, quit and suspend work over any layer.
        let is_over_layers = |entry: &&Entry| ["quit", "suspend"].contains(&entry.name);
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        if let Some(entry) = entry.filter(|entry| control && is_over_layers(entry)) {
            return self.perform(entry);
        }
        if self.is_too_small {
            // Nothing that cannot be seen is done, except leaving.
            entry.filter(|entry| entry.name == "quit").into_iter().for_each(|entry| self.perform(entry));
        } else if let Some(layer) = self.layers.last_mut() {
            let response = layer.key(key);
            self.respond(response);
        } else if let Some(entry) = entry {
            self.message = None;
            self.perform(entry);
        }
    }

    fn mouse_event(&mut self, mouse: MouseEvent) {
        let hovering = mouse.kind == MouseEventKind::Moved;
        if self.layers.is_empty() {
            self.changed |= self.mouse(mouse);
        } else if !hovering {
            self.changed = true;
            if let Some(layer) = self.layers.last_mut() {
                let response = layer.mouse(mouse);
                self.respond(response);
            }
        }
    }

    fn respond(&mut self, response: Response) {
        match response {
            Response::Stay => {}
            Response::Leave => _ = self.layers.pop(),
            Response::Keep(effect) => self.carry_out(vec![effect]),
            Response::Do(effect) => {
                self.layers.pop();
                self.carry_out(vec![effect]);
            }
            Response::Try(effect) => {
                let depth = self.layers.len();
                match effect.carry_out(self) {
                    // The effect may have opened a question on top: remove the answered layer below it.
                    Ok(()) => _ = self.layers.remove(depth - 1),
                    Err(error) => {
                        if let Some(layer) = self.layers.last_mut() {
                            layer.refuse(error);
                        }
                    }
                }
            }
        }
    }

    /// Carries out effects in order. The first failure is shown and skips the rest.
    fn carry_out(&mut self, effects: Vec<Effect>) {
        if let Err(error) = Effect::all(effects).carry_out(self) {
            self.show_message(Level::Error, error);
        }
    }

    /// Shows a message.
    pub fn show_message(&mut self, level: Level, text: impl Into<String>) {
        self.message = Some((level, text.into(), Duration::ZERO));
        self.changed = true;
    }

    /// Shows a message and keeps it in the log.
    pub fn warn(&mut self, level: Level, text: &str) {
        self.workspace.log(level, text.to_owned());
        self.show_message(level, text);
    }

    /// Draws the screen and its layers.
    pub fn draw(&mut self, frame: &mut Frame) {
        self.changed = false;
        let contexts = self.contexts();
        let leaves = (self.leaving == QuitState::WhenIdle)
            .then_some((Level::Warning, "leaves as soon as no run is in training; quit again to stay"));
        let chrome = Chrome {
            tab: self.tab,
            contexts: &contexts,
            message: self.message.as_ref().map(|(level, text, _)| (*level, &**text)).or(leaves),
            covered: !self.layers.is_empty(),
        };
        let area = frame.area();
        self.regions = draw_frame(&self.ui(), &self.screens, &chrome, area, frame.buffer_mut());
        self.is_too_small = self.regions.is_empty();
        let mut cursor = None;
        // A terminal too small for a screen is too small for layers.
        if !self.is_too_small {
            for layer in &mut self.layers {
                cursor = layer.draw(area, &self.theme, frame.buffer_mut());
            }
        }
        if let Some(cursor) = cursor {
            frame.set_cursor_position(cursor);
        }
        self.theme.make_safe(frame.buffer_mut());
    }
}
