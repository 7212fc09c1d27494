//! The workbench without a terminal and an event loop: for benchmarks, which press keys, let time pass and draw.

use crossterm::event::Event;

use super::app::App;
use super::input::{Key, KeyError};
use super::view::SessionWorkspace;
use super::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_workbench::Session;

impl App {
    /// The workbench of a session, in true colour and braille.
    pub fn offscreen(session: Session) -> Self {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        Self::new(Box::new(SessionWorkspace::new(session)), theme)
    }

    /// Presses keys, written as in the help and separated by spaces.
    ///
    /// # Errors
    /// When a word is not a key.
    pub fn press_keys(&mut self, keys: &str) -> Result<(), KeyError> {
        for key in keys.split_whitespace() {
            self.event(Event::Key(key.parse::<Key>()?.event()));
        }
        Ok(())
    }
}
