//! Layers over the screen. The top layer receives the keys until it is closed.

mod help;
mod palette;
mod prompt;
mod question;
mod tools;
mod tour;

pub use help::Help;
pub use palette::{Arguments, CommandPalette};
pub use prompt::Prompt;
pub use question::Question;
pub use tools::{ToolItem, ToolPalette, tool_in_words};
pub use tour::Tour;

use crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use crate::tui::effect::Effect;
use crate::tui::input::Keymap;
use crate::tui::widgets::theme::Theme;

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
    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position>;
}

/// What to do after a layer has handled an event.
pub enum Response {
    /// Keep the layer open.
    Stay,
    /// Close the layer.
    Leave,
    /// Close the layer and pass the key on to what is under it.
    Pass,
    /// Close the layer and carry out an effect.
    Do(Effect),
    /// Carry out an effect; close the layer if it succeeds.
    Try(Effect),
}
