//! Recovery from panics on the screen's thread: a panic becomes an error message, and the session and its trainings
//! continue.

use super::App;
use crate::tui::actions::Tab;
use crate::tui::terminal;
use crate::tui::view::Level;

impl App {
    /// Runs a closure on the app. False if it panicked, which an error message then reports.
    pub fn guarded(&mut self, work: impl FnOnce(&mut Self)) -> bool {
        match terminal::catch(|| work(self)) {
            Ok(()) => true,
            Err(panic) => {
                let text = format!("internal error; the session continues: {}", panic.replace('\n', " "));
                self.warn(Level::Error, &text);
                false
            }
        }
    }

    /// Closes all layers and shows the Log screen, which is the simplest to draw.
    pub fn show_log_alone(&mut self) {
        self.layers.clear();
        self.drag = None;
        self.tab = Tab::Log;
    }

    /// The latest message.
    pub fn message(&self) -> String {
        self.message.as_ref().map_or_else(String::new, |(message, _)| message.text.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::app::testing::{app, empty, press, shot, text};

    #[test]
    fn a_panic_is_an_error_on_the_screen_and_the_session_goes_on() {
        terminal::install_panic_hook();
        let (mut app, asked) = app(empty());
        assert!(app.guarded(|app| press(app, "t enter")));
        assert!(!app.guarded(|_| panic!("the model fits the task: on purpose")));
        let screen = text(&shot(&mut app, 200, 40));
        assert!(screen.contains("the model fits the task: on purpose") && screen.contains("recovery.rs"), "{screen}");
        press(&mut app, "c");
        assert_eq!(*asked.borrow(), ["train", "clusters"], "keys still work");
    }
}
