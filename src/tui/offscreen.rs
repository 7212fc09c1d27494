//! The workbench without a terminal: for benchmarks.

use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::Backend;

use super::app::App;
use super::input::{Key, KeyError};
use super::view::SessionWorkspace;
use super::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_workbench::Session;

/// A workbench without an event loop: the caller presses keys, lets time pass and draws.
pub struct OffscreenWorkbench {
    app: App,
}

impl OffscreenWorkbench {
    /// The workbench of a session, in true colour and braille.
    pub fn new(session: Session) -> Self {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        Self { app: App::new(Box::new(SessionWorkspace::new(session)), theme) }
    }

    /// Presses keys, written as in the help and separated by spaces.
    ///
    /// # Errors
    /// When a word is not a key.
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

    /// Whether something has changed since the last frame.
    pub fn is_changed(&self) -> bool {
        self.app.is_changed()
    }

    /// Makes the next frame draw everything again.
    pub fn redraw(&mut self) {
        self.app.redraw();
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
