//! Recovery from panics on the screen's thread: a panic becomes an error message with a report in a file, and the
//! session and its trainings continue.

use std::path::{Path, PathBuf};

use super::App;
use crate::tui::actions::Tab;
use crate::tui::terminal;
use crate::tui::view::Level;

/// Maximum number of report files in a folder, so that a recurring panic does not fill it.
const MAX_REPORTS: usize = 20;

impl App {
    /// Runs `work`. A panic in it is reported on the screen and in a file in the current folder; false in that case.
    pub fn guarded(&mut self, work: impl FnOnce(&mut Self)) -> bool {
        self.guarded_in(Path::new(""), work)
    }

    /// Like [`App::guarded`], with the report in `folder`.
    pub(super) fn guarded_in(&mut self, folder: &Path, work: impl FnOnce(&mut Self)) -> bool {
        match terminal::catch(|| work(self)) {
            Ok(()) => true,
            Err(report) => {
                self.report_panic(folder, &report);
                false
            }
        }
    }

    fn report_panic(&mut self, folder: &Path, report: &str) {
        let what = report.split("\n\n").next().unwrap_or_default().replace('\n', " ");
        let place = match write_report(folder, report) {
            Ok(path) => format!("a report is in {}", path.display()),
            Err(error) => format!("no report could be written: {error}"),
        };
        self.changed = true;
        self.warn(Level::Error, &format!("internal error; the session continues; {place}: {what}"));
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

/// Writes a report to a new file in `folder`.
fn write_report(folder: &Path, report: &str) -> std::io::Result<PathBuf> {
    let numbered = (1..=MAX_REPORTS).map(|number| folder.join(format!("mge-error-{number}.txt")));
    let mut free = numbered.filter(|path| !path.exists());
    let path = free.next().ok_or_else(|| std::io::Error::other(format!("there are {MAX_REPORTS} already")))?;
    let text = format!("mge {}\n{report}\n", mge_base::identity::version());
    mge_base::atomic::write(&path, text.as_bytes())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::app::testing::{app, empty, press, shot, text};

    #[test]
    fn a_panic_is_an_error_on_the_screen_with_a_report_and_the_session_goes_on() {
        terminal::install_panic_hook();
        let folder = tempfile::tempdir().unwrap();
        let (mut app, asked) = app(empty());
        assert!(app.guarded_in(folder.path(), |app| press(app, "t enter")));
        assert!(!app.guarded_in(folder.path(), |_| panic!("the model fits the task: on purpose")));
        assert!(text(&shot(&mut app, 200, 40)).contains("the model fits the task: on purpose"));
        let report = std::fs::read_to_string(folder.path().join("mge-error-1.txt")).unwrap();
        assert!(report.contains("on purpose") && report.contains(file!()), "{report}");
        assert!(!app.guarded_in(folder.path(), |_| panic!("another one")));
        assert!(folder.path().join("mge-error-2.txt").is_file());
        press(&mut app, "c");
        assert_eq!(*asked.borrow(), ["train", "clusters"], "keys still work");
    }
}
