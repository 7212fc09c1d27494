//! Effects: what screens and layers ask the app to do. Opening a layer is an effect, and a layer responds to events
//! with effects.

use crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::prelude::*;

use super::app::App;
use super::view::{Choice, Level};
use super::widgets::theme::Theme;
use mge_task::Object;
use mge_workbench::Command;

/// What an effect does; the error is shown.
type Work = dyn FnOnce(&mut App) -> Result<(), String>;

/// Something that the app is to do. When one in a list fails, the rest are skipped.
pub struct Effect(Box<Work>);

impl Effect {
    /// An effect that may fail; the error is shown.
    pub fn new(work: impl FnOnce(&mut App) -> Result<(), String> + 'static) -> Self {
        Self(Box::new(work))
    }

    /// An effect that does not fail.
    pub fn call(work: impl FnOnce(&mut App) + 'static) -> Self {
        Self::new(|app| {
            work(app);
            Ok(())
        })
    }

    /// Carries out a command; asks first if unsaved work or a file would be lost.
    pub fn apply(command: impl Into<Command>) -> Self {
        let command = command.into();
        Self::new(|app| app.try_apply(command))
    }

    /// Opens a layer over the screen.
    pub fn open(layer: impl Layer + 'static) -> Self {
        Self::call(|app| app.open(layer))
    }

    /// Opens the palette with a command typed in.
    pub fn palette(command: impl ToString) -> Self {
        let line = command.to_string();
        Self::call(move |app| app.open_palette(&line))
    }

    /// Shows a message.
    pub fn message(level: Level, text: impl Into<String>) -> Self {
        let text = text.into();
        Self::call(move |app| app.show_message(level, text))
    }

    /// Shows an informational message.
    pub fn info(text: impl Into<String>) -> Self {
        Self::message(Level::Info, text)
    }

    /// Selects an object of the scene, or none.
    pub fn select(object: Option<Object>) -> Self {
        Self::call(move |app| app.screens.scene.select(object))
    }

    /// Changes what the scene shows.
    pub fn show(choice: Choice) -> Self {
        Self::call(|app| app.choose_subject(Some(choice), false))
    }

    /// Several effects, in order.
    pub fn all(effects: Vec<Self>) -> Self {
        Self::new(|app| effects.into_iter().try_for_each(|effect| effect.carry_out(app)))
    }

    /// Effects that do not depend on one another: all are carried out, and the first error is shown.
    pub fn each(effects: Vec<Self>) -> Self {
        Self::new(|app| effects.into_iter().map(|effect| effect.carry_out(app)).fold(Ok(()), Result::and))
    }

    /// Carries it out.
    ///
    /// # Errors
    /// Why it failed.
    pub fn carry_out(self, app: &mut App) -> Result<(), String> {
        (self.0)(app)
    }
}

/// A popup over the screen.
pub trait Layer {
    /// Handles a key.
    fn key(&mut self, key: KeyEvent) -> Response;

    /// Handles a click.
    fn click(&mut self, _at: Position) -> Response {
        Response::Stay
    }

    /// Handles the mouse: the wheel acts like the arrow keys, the left button clicks.
    fn mouse(&mut self, mouse: MouseEvent) -> Response {
        match mouse.kind {
            MouseEventKind::ScrollUp => self.key(KeyCode::Up.into()),
            MouseEventKind::ScrollDown => self.key(KeyCode::Down.into()),
            MouseEventKind::Down(MouseButton::Left) => self.click((mouse.column, mouse.row).into()),
            _ => Response::Stay,
        }
    }

    /// Handles pasted text.
    fn paste(&mut self, _text: &str) {}

    /// Shows why the effect of [`Response::Try`] failed.
    fn refuse(&mut self, _reason: String) {}

    /// Whether it asks for confirmation before something is lost.
    fn is_warning(&self) -> bool {
        false
    }

    /// Draws it over the screen. Returns the position of the cursor, if it has one.
    fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Position>;
}

/// What to do after a layer has handled an event.
pub enum Response {
    /// Keep the layer open.
    Stay,
    /// Close the layer.
    Leave,
    /// Close the layer and carry out an effect.
    Do(Effect),
    /// Carry out an effect; close the layer if it succeeds.
    Try(Effect),
    /// Carry out an effect and keep the layer open.
    Keep(Effect),
}
