//! What lies over the screen: each layer takes the keys until it is left.

mod help;
mod palette;
mod prompt;
mod question;
mod tools;
mod tour;

pub use help::Help;
pub use palette::{Arguments, Palette};
pub use prompt::Prompt;
pub use question::Question;
pub use tools::{Offer, Tools, tool_in_words};
pub use tour::Tour;

use crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use crate::tui::effect::Effect;
use crate::tui::input::Keymap;
use crate::tui::widgets::theme::Theme;

/// Something over the screen.
pub trait Layer {
    /// Applies a key.
    fn key(&mut self, key: KeyEvent) -> Response;

    /// Applies a click.
    fn click(&mut self, _at: Position) -> Response {
        Response::Stay
    }

    /// Applies the mouse: the wheel goes up and down, a click chooses.
    fn mouse(&mut self, mouse: MouseEvent) -> Response {
        match mouse.kind {
            MouseEventKind::ScrollUp => self.key(KeyCode::Up.into()),
            MouseEventKind::ScrollDown => self.key(KeyCode::Down.into()),
            MouseEventKind::Down(MouseButton::Left) => self.click((mouse.column, mouse.row).into()),
            _ => Response::Stay,
        }
    }

    /// Takes pasted text, where text is typed.
    fn paste(&mut self, _text: &str) {}

    /// Shows why what was asked for could not be done.
    fn refuse(&mut self, _reason: String) {}

    /// Whether it asks before something is lost.
    fn is_warning(&self) -> bool {
        false
    }

    /// Draws it over the screen; where the cursor is, if it has one.
    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position>;
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
