//! What lies over the screen: each layer takes the keys until it is left.

mod choice;
mod help;
mod palette;
mod prompt;
mod tour;

pub use choice::{Chooser, Confirm};
pub use help::Help;
pub use palette::Palette;
pub use prompt::Prompt;
pub use tour::Tour;

use crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use crate::tui::effect::Effect;
use crate::tui::input::Keymap;
use crate::tui::widgets::theme::Theme;

/// Something over the screen.
pub enum Layer {
    /// All keys.
    Help(Help),
    /// The short tour.
    Tour(Tour),
    /// A line to be typed.
    Prompt(Prompt),
    /// Actions and commands by name.
    Palette(Palette),
    /// One of several.
    Chooser(Chooser),
    /// A question before something that cannot be taken back.
    Confirm(Confirm),
}

/// What a layer wants after a key.
pub enum Response {
    /// Nothing; it stays.
    Stay,
    /// To be left.
    Leave,
    /// To be left, and the key to go to what lies under it.
    Pass,
    /// To be left, and this to be done.
    Do(Effect),
    /// This to be done; to be left if it succeeds.
    Try(Effect),
}

impl Layer {
    /// Applies a key.
    pub fn key(&mut self, key: KeyEvent) -> Response {
        match self {
            Self::Help(help) => help.key(key),
            Self::Tour(tour) => tour.key(key),
            Self::Prompt(prompt) => prompt.key(key),
            Self::Palette(palette) => palette.key(key),
            Self::Chooser(chooser) => chooser.key(key),
            Self::Confirm(confirm) => confirm.key(key),
        }
    }

    /// Applies the mouse: the wheel goes up and down, a click chooses what it regions.
    pub fn mouse(&mut self, mouse: MouseEvent) -> Response {
        match mouse.kind {
            MouseEventKind::ScrollUp => self.key(KeyCode::Up.into()),
            MouseEventKind::ScrollDown => self.key(KeyCode::Down.into()),
            MouseEventKind::Down(MouseButton::Left) => self.click((mouse.column, mouse.row).into()),
            _ => Response::Stay,
        }
    }

    fn click(&mut self, at: Position) -> Response {
        match self {
            Self::Tour(tour) => tour.key(KeyCode::Enter.into()),
            Self::Help(_) => Response::Leave,
            Self::Chooser(chooser) => chooser.click(at),
            Self::Confirm(confirm) => confirm.click(at),
            Self::Palette(palette) => palette.click(at),
            Self::Prompt(_) => Response::Stay,
        }
    }

    /// Takes pasted text, where text is typed.
    pub fn paste(&mut self, text: &str) {
        match self {
            Self::Prompt(prompt) => prompt.input.insert(text),
            Self::Palette(palette) => palette.paste(text),
            _ => {}
        }
    }

    /// Shows why what was asked for could not be done.
    pub fn refuse(&mut self, reason: String) {
        match self {
            Self::Prompt(prompt) => prompt.error = Some(reason),
            Self::Palette(palette) => palette.error = Some(reason),
            _ => {}
        }
    }

    /// Draws it over the screen; where the cursor is, if it has one.
    pub fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<(u16, u16)> {
        match self {
            Self::Help(help) => help.draw(area, keymap, theme, buffer),
            Self::Tour(tour) => tour.draw(area, keymap, theme, buffer),
            Self::Prompt(prompt) => return Some(prompt.draw(area, theme, buffer)),
            Self::Palette(palette) => return Some(palette.draw(area, keymap, theme, buffer)),
            Self::Chooser(chooser) => chooser.draw(area, theme, buffer),
            Self::Confirm(confirm) => confirm.draw(area, theme, buffer),
        }
        None
    }
}
