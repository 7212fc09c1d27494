//! The workbench without a terminal of its own: for benchmarks, and wherever a screen is
//! wanted as cells.

use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::Backend;

use super::app::App;
use super::input::{Key, KeyError, Keymap};
use super::view::SessionWorkspace;
use super::widgets::theme::{Depth, Marker, Palette, Theme};
use crate::workbench::Session;

/// A workbench that is looked at, not run.
pub struct Still {
    app: App,
}

impl Still {
    /// The workbench of a session, in true colour and braille.
    pub fn new(session: Session) -> Self {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        Self { app: App::new(Box::new(SessionWorkspace::new(session)), theme, Keymap::default()) }
    }

    /// Presses keys as key files name them, separated by spaces.
    ///
    /// # Errors
    /// When a word is no key.
    pub fn press(&mut self, keys: &str) -> Result<(), KeyError> {
        for key in keys.split_whitespace() {
            let key: Key = key.parse()?;
            self.app.event(crossterm::event::Event::Key(key.event()));
        }
        Ok(())
    }

    /// Whether runs are being read from their folder.
    pub fn is_reading_runs(&self) -> bool {
        self.app.is_reading_runs()
    }

    /// Lets time pass.
    pub fn pass(&mut self, time: Duration) {
        self.app.tick(time);
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// When the backend fails.
    pub fn draw<B: Backend>(&mut self, terminal: &mut Terminal<B>) -> Result<(), B::Error> {
        terminal.draw(|frame| self.app.draw(frame)).map(|_| ())
    }
}
