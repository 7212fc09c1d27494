//! The workbench on screen: what is shown, and what keys and mouse make of it.

use std::time::Duration;

use crossterm::event::{Event, KeyEvent, KeyEventKind, MouseEvent};
use ratatui::layout::Rect;

use super::desk::Desk;
use super::facts::Level;
use super::key::Key;
use super::keymap::Keymap;
use super::layers::{Deed, Layer, Wish};
use super::mouse::Grip;
use super::preview::Preview;
use super::screens::{Curves, Hits, Lists, Runs, Scene, Schedule, Tab};
use super::theme::Theme;
use crate::tui::actions::{Action, Context};

/// Everything the screen knows of its own.
pub struct App {
    /// The session.
    pub desk: Box<dyn Desk>,
    /// Colours and markers.
    pub theme: Theme,
    /// Keys.
    pub keymap: Keymap,
    /// The screen being shown.
    pub tab: Tab,
    /// What lies over it, the top one last.
    pub layers: Vec<Layer>,
    /// What the Scene and the Edit screen show.
    pub scene: Scene,
    /// What the curves show.
    pub curves: Curves,
    /// The schedule being edited.
    pub schedule: Schedule,
    /// The list of runs.
    pub runs: Runs,
    /// Selected lines of the Models, Figures and Log screens.
    pub lists: Lists,
    /// The figure that is shown on the Figures screen.
    pub preview: Preview,
    /// The latest message, and how long it has been shown.
    pub notice: Option<Notice>,
    /// Where things were drawn, for the mouse.
    pub hits: Hits,
    /// What the mouse took hold of.
    pub grip: Option<Grip>,
    /// What only the owner of the terminal can do.
    pub wish: Option<TerminalWish>,
    /// Whether the mouse is captured.
    pub mouse: bool,
    /// The workbench is to be left.
    pub leaving: bool,
    /// The workbench is to be left once nothing is trained any more.
    pub leaving_later: bool,
    changed: bool,
}

/// A message in the last line.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// How much it matters.
    pub level: Level,
    /// What it says.
    pub text: String,
    shown: Duration,
}

/// How long a message stays that is no error.
const NOTICE: Duration = Duration::from_secs(6);
/// Time that can pass for a message between two looks at it.
const BLINK: Duration = Duration::from_millis(100);

/// What only the owner of the terminal can do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TerminalWish {
    /// Stop until the shell continues the program.
    Suspend,
    /// Switch mouse capture.
    Mouse(bool),
    /// Put a text on the clipboard.
    Copy(String),
}

impl App {
    /// The workbench of a session.
    pub fn new(desk: Box<dyn Desk>, theme: Theme, keymap: Keymap) -> Self {
        Self {
            desk,
            theme,
            keymap,
            tab: Tab::Scene,
            layers: Vec::new(),
            scene: Scene::default(),
            curves: Curves::default(),
            schedule: Schedule::default(),
            runs: Runs::default(),
            lists: Lists::default(),
            preview: Preview::default(),
            notice: None,
            hits: Hits::default(),
            grip: None,
            wish: None,
            mouse: true,
            leaving: false,
            leaving_later: false,
            changed: true,
        }
    }

    /// Whether there is something new to draw; asking forgets it.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Whether there is something new to draw.
    pub fn is_changed(&self) -> bool {
        self.changed
    }

    /// Draws everything anew.
    pub fn touch(&mut self) {
        self.changed = true;
    }

    /// Whether something moves, so that time must pass often.
    pub fn is_animated(&self) -> bool {
        self.tab.has_scene() && self.scene.is_animated()
    }

    /// Where actions are looked for now, the innermost first.
    pub fn contexts(&self) -> Vec<Context> {
        let inner = match self.tab {
            Tab::Scene | Tab::Edit if self.scene.hand.is_some() => vec![Context::Hand, Context::Scene],
            Tab::Scene | Tab::Edit => vec![Context::Scene],
            Tab::Schedule => vec![Context::Schedule],
            Tab::Training => vec![Context::Curves],
            Tab::Runs => vec![Context::Runs],
            Tab::Models => vec![Context::Models, Context::List],
            Tab::Figures => vec![Context::Figures, Context::List],
            Tab::Log => vec![Context::List],
        };
        inner.into_iter().chain([Context::Everywhere, Context::Typed]).collect()
    }

    /// Lets time pass and takes in what the session did.
    pub fn tick(&mut self, elapsed: Duration) {
        let lines = self.desk.facts().log_total;
        self.changed |= self.desk.poll();
        let facts = self.desk.facts();
        let told = facts.log_total.saturating_sub(lines).min(facts.log.len());
        let news = facts.log[facts.log.len() - told..].iter().rev().find(|line| line.level != Level::Info);
        if let Some(line) = news.cloned() {
            self.say(line.level, line.text);
        }
        self.age_notice(elapsed);
        if self.leaving_later && self.desk.facts().training_runs().next().is_none() {
            self.leaving_later = false;
            self.quit();
            self.changed = true;
        }
        if self.tab.has_scene() {
            self.changed |= self.scene.update(&mut *self.desk, elapsed);
        }
        if self.tab == Tab::Runs && self.runs.is_time_to_look(elapsed) {
            self.desk.look_for_runs();
            self.changed = true;
        }
        if self.tab == Tab::Figures {
            self.changed |= super::screens::figures::update(self);
        }
    }

    fn age_notice(&mut self, elapsed: Duration) {
        let Some(notice) = &mut self.notice else { return };
        // Work that keeps the screen waiting must not use up the time of its own message.
        notice.shown += elapsed.min(BLINK);
        if notice.level != Level::Error && notice.shown > NOTICE {
            self.notice = None;
            self.changed = true;
        }
    }

    /// Takes in an event of the terminal.
    pub fn event(&mut self, event: Event) {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.key(key),
            Event::Mouse(mouse) => self.mouse(mouse),
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
        let action = self.keymap.action(Key::from(key), &self.contexts());
        // Leaving and stopping work from everywhere, whatever lies over the screen.
        let control = key.modifiers.contains(crossterm::event::KeyModifiers::CONTROL);
        if let Some(action @ (Action::Quit | Action::Suspend)) = action
            && control
        {
            self.perform(action);
            return;
        }
        if let Some(layer) = self.layers.last_mut() {
            let wish = layer.key(key);
            self.grant(wish);
        } else if let Some(action) = action {
            self.notice = None;
            self.perform(action);
        }
    }

    fn grant(&mut self, wish: Wish) {
        match wish {
            Wish::Stay => {}
            Wish::Leave => _ = self.layers.pop(),
            Wish::Do(deed) => {
                self.layers.pop();
                if let Err(error) = self.do_deed(deed) {
                    self.say(Level::Error, error);
                }
            }
            Wish::Try(deed) => {
                let depth = self.layers.len();
                match self.do_deed(deed) {
                    // A question that came up lies on top: the answered layer is below it.
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

    fn do_deed(&mut self, deed: Deed) -> Result<(), String> {
        match deed {
            Deed::Line(line) if line.trim() == "quit" => self.quit(),
            Deed::Line(line) if self.desk.facts().dirty && line.starts_with("task ") => self.ask_to_discard(line),
            Deed::Line(line) if self.would_overwrite(&line).is_some() => self.ask_to_overwrite(line),
            Deed::Line(line) | Deed::Certainly(line) => {
                let told = self.desk.apply(&line)?;
                self.say(Level::Good, told);
            }
            Deed::Action(action) => self.perform(action),
            Deed::Filter(text) => self.runs.filter(text),
            Deed::TypeTask => self.ask_for_task_file(),
            Deed::Quit => self.leaving = true,
            Deed::QuitLater => {
                self.leaving_later = true;
                self.say(Level::Info, "leaving when all runs are done; quit again to change that");
            }
        }
        Ok(())
    }

    /// Carries out a line of the command language and shows what came of it.
    pub fn line(&mut self, line: &str) {
        match self.desk.apply(line) {
            Ok(told) => self.say(Level::Good, told),
            Err(error) => self.say(Level::Error, error),
        }
    }

    /// Shows a message.
    pub fn say(&mut self, level: Level, text: impl Into<String>) {
        let notice = Notice { level, text: text.into(), shown: Duration::ZERO };
        self.notice = Some(notice).filter(|notice| !notice.text.is_empty());
        self.changed = true;
    }

    fn mouse(&mut self, mouse: MouseEvent) {
        let hovering = mouse.kind == crossterm::event::MouseEventKind::Moved;
        if self.layers.is_empty() {
            self.changed |= super::mouse::handle(self, mouse);
        } else if !hovering {
            self.changed = true;
            if let Some(layer) = self.layers.last_mut() {
                let wish = layer.mouse(mouse);
                self.grant(wish);
            }
        }
    }

    /// The area's layers, drawn; where the cursor is.
    pub fn draw_layers(&mut self, area: Rect, buffer: &mut ratatui::buffer::Buffer) -> Option<(u16, u16)> {
        let mut cursor = None;
        for layer in &mut self.layers {
            cursor = layer.draw(area, &self.keymap, &self.theme, buffer);
        }
        cursor
    }
}
