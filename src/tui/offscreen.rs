//! The workbench without a terminal: for benchmarks and for screenshots.

use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::{Backend, TestBackend};

use super::app::App;
use super::input::{Key, KeyError, Keymap};
use super::view::SessionWorkspace;
use super::widgets::screenshot;
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
        Self { app: App::new(Box::new(SessionWorkspace::new(session)), theme, Keymap::default()) }
    }

    /// Presses keys, written as in key files and separated by spaces.
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

    /// Draws the screen at a size as SVG, once background work on it has finished; `head` is inserted
    /// after the opening tag.
    pub fn picture(&mut self, width: u16, height: u16, head: &str) -> String {
        /// Parts that depend on the layout of the previous frame appear in the second frame.
        const FRAMES: usize = 2;
        let mut terminal = match Terminal::new(TestBackend::new(width, height)) {
            Ok(terminal) => terminal,
            Err(never) => match never {},
        };
        let mut drawn = 0;
        while drawn < FRAMES || self.app.is_drawing_figure() || self.is_reading_runs() {
            self.pass(Duration::from_millis(20));
            match self.draw(&mut terminal) {
                Ok(()) => drawn += 1,
                Err(never) => match never {},
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        screenshot::svg(terminal.backend().buffer(), head)
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

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::RunDirectory;

    #[test]
    fn a_picture_of_the_runs_is_drawn_once_they_have_been_read() {
        let folder = tempfile::tempdir().unwrap();
        let session = Session::on_task("task1", folder.path().to_owned()).unwrap();
        RunDirectory::create(folder.path().join("zebra"), session.config()).unwrap();
        let mut workbench = OffscreenWorkbench::new(session);
        assert!(!workbench.is_reading_runs());
        workbench.press("5").unwrap();
        assert!(workbench.is_reading_runs());
        assert!(workbench.picture(120, 40, "").contains("zebra"));
        assert!(!workbench.is_reading_runs());
    }
}
