//! Takes over the terminal and restores it on every exit path.
//!
//! Raw mode, alternate screen, mouse capture, bracketed paste and hidden cursor are switched
//! together. [`leave`] may be called any number of times, from any thread.

mod graphics;
mod input;
mod parser;
pub mod signals;

pub use graphics::{Graphics, Protocol};
pub use input::Input;
#[cfg(any(test, fuzzing))]
pub use parser::Parser;
pub use parser::Received;

use std::cell::RefCell;
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
use ratatui::backend::{Backend, CrosstermBackend};
use ratatui::layout::{Rect, Size};
use ratatui::{Frame, Terminal, TerminalOptions, Viewport};

use mge_base::stop::run_abandonable;
use mge_base::sync::lock;
use mge_base::text::printable;
use mge_trainer::panic_message;

/// Whether the workbench currently controls the terminal.
static ACTIVE: AtomicBool = AtomicBool::new(false);
/// Held while raw mode is switched. True once the program is about to exit: then the terminal is not taken over again.
static EXITING: Mutex<bool> = Mutex::new(false);
/// How long a terminal that accepts no output may delay an exit.
const EXIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Largest number of columns and of rows used, and of cells: more than any real screen shows. A terminal may claim to
/// have billions of cells, each of which takes memory.
const MAX_SIDE: u16 = 2048;
const MAX_CELLS: u32 = 1 << 19;
/// Panics of other threads and final messages, held back while the workbench is on screen.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// How the terminal announces that long work has ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Notify {
    /// Ring its bell.
    #[default]
    Bell,
    /// Show a desktop notification (OSC 9).
    Desktop,
    /// Show a desktop notification with OSC 777, for terminals such as rxvt-unicode.
    Osc777,
    /// Do nothing.
    Off,
}

/// Why the terminal cannot be used.
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
        enter(mouse)?;
        // From here on, a failure must restore the terminal.
        let guard = Restore;
        let backend = CrosstermBackend::new(BufWriter::with_capacity(1 << 16, io::stdout()));
        let viewport = Viewport::Fixed(used(backend.size()?));
        let terminal = Terminal::with_options(backend, TerminalOptions { viewport })?;
        std::mem::forget(guard);
        Ok(Self { terminal: ManuallyDrop::new(terminal), mouse })
    }

    /// Draws a frame in one synchronised update.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn draw(&mut self, render: impl FnOnce(&mut Frame)) -> io::Result<()> {
        if used(self.terminal.size()?) != self.terminal.get_frame().area() {
            self.redraw()?;
        }
        queue!(self.terminal.backend_mut(), BeginSynchronizedUpdate)?;
        self.terminal.draw(render)?;
        execute!(self.terminal.backend_mut(), EndSynchronizedUpdate)
    }

    /// Switches mouse capture on or off; the terminal's own text selection works only without it.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn set_mouse(&mut self, mouse: bool) -> io::Result<()> {
        self.mouse = mouse;
        if mouse { execute!(io::stdout(), EnableMouseCapture) } else { execute!(io::stdout(), DisableMouseCapture) }
    }

    /// Asks the terminal to put `text` on the clipboard (OSC 52).
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn copy(&mut self, text: &str) -> io::Result<()> {
        execute!(io::stdout(), crossterm::clipboard::CopyToClipboard::to_clipboard_from(text))
    }

    /// Announces that long work has ended.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn notify(&mut self, how: Notify, text: &str) -> io::Result<()> {
        execute!(io::stdout(), Print(notification(how, text)))
    }

    /// Restores the terminal and stops the process until the shell continues it. Where no shell could (the process group
    /// is orphaned) the process goes on.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn suspend(&mut self) -> io::Result<()> {
        leave();
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
        self.redraw()
    }

    /// Discards what the terminal shows, so that the next frame draws everything. (Ratatui's `clear`
    /// queries the terminal for the cursor position and fails if the reply is slow.)
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn redraw(&mut self) -> io::Result<()> {
        let size = self.terminal.size()?;
        self.terminal.resize(used(size))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        leave();
        for panic in take_panics() {
            // Standard error may be closed.
            let _ = writeln!(io::stderr(), "{panic}");
        }
    }
}

struct Restore;

impl Drop for Restore {
    fn drop(&mut self) {
        leave();
    }
}

/// The part of a terminal that is used.
fn used(size: Size) -> Rect {
    let width = size.width.min(MAX_SIDE);
    let most = MAX_CELLS / u32::from(width.max(1));
    Rect::new(0, 0, width, size.height.min(MAX_SIDE).min(u16::try_from(most).unwrap_or(u16::MAX)))
}

fn enter(mouse: bool) -> io::Result<()> {
    let switch = lock(&EXITING);
    if *switch {
        drop(switch);
        loop {
            // Another thread exits.
            thread::park();
        }
    }
    ACTIVE.store(true, Ordering::SeqCst);
    let raw = enable_raw_mode();
    drop(switch);
    let entered = raw.and_then(|()| {
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
        let _switch = lock(&EXITING);
        let _ = disable_raw_mode();
    }
}

/// Restores the terminal, even while another thread is taking it over, and exits.
fn exit(status: i32) -> ! {
    *lock(&EXITING) = true;
    if run_abandonable(|| true, EXIT_TIMEOUT, leave).is_none() {
        let _ = disable_raw_mode();
    }
    std::process::exit(status)
}

/// Prints a line to standard error once the terminal is restored.
pub fn report_at_the_end(line: String) {
    lock(&PANICS).push(line);
}

/// Takes the held-back panics and messages, one line each.
pub fn take_panics() -> Vec<String> {
    std::mem::take(&mut *lock(&PANICS))
}

thread_local! {
    /// The report of the latest panic while [`catch`] is active on this thread; None otherwise.
    static CAUGHT: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs a closure on the UI thread. A panic leaves the terminal as it is and is returned as an error.
///
/// # Errors
/// When the closure panics: message and location.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    CAUGHT.set(Some(String::new()));
    // State may be left inconsistent; the caller copes with that.
    let outcome = panic::catch_unwind(panic::AssertUnwindSafe(work));
    let report = CAUGHT.take().unwrap_or_default();
    outcome.map_err(|payload| {
        // A panic resumed from another thread does not call this thread's hook, so it left no report.
        if report.is_empty() { panic_message(&*payload).to_owned() } else { report }
    })
}

/// Installs the panic hook. An uncaught panic of the UI thread restores the terminal before its message is
/// printed. The message of a panic on another thread is held back so that it does not garble the screen.
pub(super) fn install_panic_hook() {
    static ONCE: Once = Once::new();
    let screen_thread = thread::current().id();
    ONCE.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let is_caught = CAUGHT.with_borrow_mut(|caught| match caught {
                Some(report) => {
                    *report = info.to_string();
                    true
                }
                None => false,
            });
            if is_caught {
                return;
            }
            if thread::current().id() == screen_thread || !ACTIVE.load(Ordering::SeqCst) {
                leave();
                previous(info);
            } else {
                let name = thread::current().name().unwrap_or("unnamed").to_owned();
                let line = format!("thread `{name}` {info}").replace('\n', " ");
                lock(&PANICS).push(line);
            }
        }));
    });
}

/// The bytes of a notification. Only one sequence is sent: a terminal that supports both would show two notifications.
fn notification(how: Notify, text: &str) -> String {
    match how {
        Notify::Bell => "\x07".to_owned(),
        Notify::Desktop => format!("\x1b]9;mge: {}\x07", printable(text)),
        // Semicolons separate the title from the text.
        Notify::Osc777 => format!("\x1b]777;notify;mge;{}\x07", printable(text).to_string().replace(';', ",")),
        Notify::Off => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_bounded_part_of_a_terminal_is_used() {
        let size = |width, height| used(Size { width, height }).as_size();
        assert_eq!(size(0, 0), Size::new(0, 0));
        assert_eq!(size(1280, 360), Size::new(1280, 360));
        assert_eq!(size(u16::MAX, 3), Size::new(2048, 3));
        assert_eq!(size(3, u16::MAX), Size::new(3, 2048));
        assert_eq!(size(u16::MAX, u16::MAX), Size::new(2048, 256));
    }

    #[test]
    fn notifications_are_valid_sequences_with_a_single_terminator() {
        assert_eq!(notification(Notify::Bell, "done"), "\x07");
        assert_eq!(notification(Notify::Desktop, "done"), "\x1b]9;mge: done\x07");
        assert_eq!(notification(Notify::Osc777, "all; done"), "\x1b]777;notify;mge;all, done\x07");
        assert_eq!(notification(Notify::Off, "done"), "");
        let hostile = notification(Notify::Osc777, "a\x07b\x1b]0;c");
        assert_eq!(hostile.matches('\x07').count(), 1, "{hostile:?}");
    }
}
