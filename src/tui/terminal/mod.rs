//! Takes over the terminal and restores it on every exit path.
//!
//! Raw mode, alternate screen, mouse capture, bracketed paste and hidden cursor are switched
//! together. [`leave`] may be called any number of times, from any thread.

pub mod events;
pub mod graphics;

use std::io::{self, BufWriter, IsTerminal, Stdout, Write};
use std::mem::ManuallyDrop;
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};
use std::thread;
use std::time::Duration;

use crossterm::cursor::{Hide, Show};
use crossterm::event::{DisableBracketedPaste, DisableMouseCapture, EnableBracketedPaste, EnableMouseCapture};
use crossterm::style::Print;
use crossterm::terminal::{
    BeginSynchronizedUpdate, EndSynchronizedUpdate, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode,
    enable_raw_mode,
};
use crossterm::{execute, queue};
use ratatui::backend::CrosstermBackend;
use ratatui::prelude::*;

use mge_base::stop::run_abandonable;
use mge_base::sync::lock;
use mge_base::text::printable;

/// Whether the workbench currently controls the terminal.
static ACTIVE: AtomicBool = AtomicBool::new(false);
/// How long a terminal that accepts no output may delay an exit.
const EXIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Panics and final messages, held back while the workbench is on screen.
static HELD: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// How the terminal announces that long work has ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Notify {
    /// Ring its bell.
    #[default]
    Bell,
    /// Show a desktop notification (OSC 9).
    Desktop,
    /// Do nothing.
    Off,
}

/// Why the workbench could not open or continue.
#[derive(Debug, thiserror::Error)]
pub enum TerminalError {
    /// Standard input or output is not a terminal, or the terminal is dumb.
    #[error(
        "the workbench needs a terminal: without one use `mge script FILE`, `mge train TASK`, `mge reproduce --quick` or another command of `mge help`"
    )]
    NotATerminal,
    /// Reading or writing failed.
    #[error("the terminal: {0}")]
    Io(#[from] io::Error),
    /// The workbench panicked: where and why.
    #[error("internal error: {0}")]
    Panic(String),
}

/// The terminal while it shows the workbench; dropping it restores the terminal.
pub struct Screen {
    /// Never dropped: [`leave`] restores the cursor, whereas ratatui's `Drop` panics when the
    /// terminal has hung up.
    terminal: ManuallyDrop<Terminal<CrosstermBackend<BufWriter<Stdout>>>>,
    mouse: bool,
}

impl Screen {
    /// Takes over the terminal.
    ///
    /// # Errors
    /// When standard input or output is not a terminal, or setting it up fails.
    pub fn open(mouse: bool) -> Result<Self, TerminalError> {
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        if is_dumb || !io::stdout().is_terminal() || !io::stdin().is_terminal() {
            return Err(TerminalError::NotATerminal);
        }
        install_panic_hook();
        let terminal = Terminal::new(CrosstermBackend::new(BufWriter::with_capacity(1 << 16, io::stdout())))?;
        enter(mouse)?;
        Ok(Self { terminal: ManuallyDrop::new(terminal), mouse })
    }

    /// Draws a frame in one synchronised update.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn draw(&mut self, render: impl FnOnce(&mut Frame)) -> io::Result<()> {
        queue!(self.terminal.backend_mut(), BeginSynchronizedUpdate)?;
        self.terminal.draw(render)?;
        execute!(self.terminal.backend_mut(), EndSynchronizedUpdate)
    }

    /// Announces that long work has ended.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn notify(&mut self, how: Notify, text: &str) -> io::Result<()> {
        execute!(io::stdout(), Print(notification(how, text)))
    }

    /// Restores the terminal, says what stands still, if anything, and stops the process until the shell continues it.
    /// Where no shell could (the process group is orphaned) the process goes on.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn suspend(&mut self, standing_still: &str) -> io::Result<()> {
        leave();
        if !standing_still.is_empty() {
            writeln!(io::stdout(), "mge: {standing_still}")?;
        }
        // SIGTSTP has a handler, and SIGSTOP would stop an orphan for good. SIGTTIN has its default action, which is to
        // stop, but which the system discards in an orphaned process group.
        signal_hook::low_level::raise(signal_hook::consts::SIGTTIN)?;
        self.reenter()
    }

    /// Takes over the terminal again and makes the next frame draw everything.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn reenter(&mut self) -> io::Result<()> {
        leave();
        enter(self.mouse)?;
        // Ratatui's `clear` queries the terminal for the cursor position and fails if the reply is slow.
        let size = self.terminal.size()?;
        self.terminal.resize(Rect::from((Position::ORIGIN, size)))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        leave();
        for panic in take_held() {
            // Standard error may be closed.
            let _ = writeln!(io::stderr(), "{panic}");
        }
    }
}

fn enter(mouse: bool) -> io::Result<()> {
    ACTIVE.store(true, Ordering::SeqCst);
    let entered = enable_raw_mode().and_then(|()| {
        execute!(io::stdout(), EnterAlternateScreen, EnableBracketedPaste, Hide)?;
        if mouse { execute!(io::stdout(), EnableMouseCapture) } else { Ok(()) }
    });
    if entered.is_err() {
        leave();
    }
    entered
}

/// Restores the terminal if the workbench controls it; otherwise does nothing.
pub fn leave() {
    if ACTIVE.swap(false, Ordering::SeqCst) {
        // Try both steps even if one fails; a failure cannot be reported.
        let _ = execute!(
            io::stdout(),
            EndSynchronizedUpdate,
            DisableMouseCapture,
            DisableBracketedPaste,
            LeaveAlternateScreen,
            Show
        );
        let _ = disable_raw_mode();
    }
}

/// Restores the terminal and exits.
fn exit(status: i32) -> ! {
    if run_abandonable(|| true, EXIT_TIMEOUT, leave).is_none() {
        let _ = disable_raw_mode();
    }
    std::process::exit(status)
}

/// Prints a line to standard error once the terminal is restored.
pub fn report_at_the_end(line: String) {
    lock(&HELD).push(line);
}

/// Takes the held-back panics and messages, one line each.
pub fn take_held() -> Vec<String> {
    std::mem::take(&mut *lock(&HELD))
}

/// Installs the panic hook: while the workbench is on screen, the message of a panic is held back so that it does not
/// garble the screen.
fn install_panic_hook() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if ACTIVE.load(Ordering::SeqCst) {
                let name = thread::current().name().unwrap_or("unnamed").to_owned();
                report_at_the_end(format!("thread `{name}` {info}").replace('\n', " "));
            } else {
                previous(info);
            }
        }));
    });
}

/// The bytes of a notification.
fn notification(how: Notify, text: &str) -> String {
    match how {
        Notify::Bell => "\x07".to_owned(),
        Notify::Desktop => format!("\x1b]9;mge: {}\x07", printable(text)),
        Notify::Off => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notifications_are_valid_sequences_with_a_single_terminator() {
        assert_eq!(notification(Notify::Bell, "done"), "\x07");
        assert_eq!(notification(Notify::Desktop, "done"), "\x1b]9;mge: done\x07");
        assert_eq!(notification(Notify::Off, "done"), "");
        let hostile = notification(Notify::Desktop, "a\x07b\x1b]0;c");
        assert_eq!(hostile.matches('\x07').count(), 1, "{hostile:?}");
    }
}
