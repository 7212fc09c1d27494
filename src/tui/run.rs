//! The event loop: takes in events and elapsed time, draws frames.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::io::Errno;

use super::app::{App, Remembered, TerminalRequest, report_recovered_edits};
use super::input::{Keymap, KeymapError};
use super::terminal::signals::{self, Listener, Request};
use super::terminal::{self, Graphics, Input, Notify, Screen, TerminalError};
use super::view::SessionWorkspace;
use super::widgets::theme::{Palette, Theme};
use mge_workbench::Session;

/// Minimum time between two frames.
const FRAME: Duration = Duration::from_micros(16_667);
/// Longest wait for input before the session is polled again; also the frame time of an episode being played.
const IDLE: Duration = Duration::from_millis(60);

/// How the workbench opens.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A key file.
    pub keys: Option<PathBuf>,
    /// Show the tour first.
    pub tour: bool,
    /// Forget what earlier sessions with the folder of runs have chosen.
    pub fresh: bool,
    /// Do not capture the mouse.
    pub no_mouse: bool,
    /// How the terminal announces that long work has ended.
    pub notify: Notify,
}

/// Why the workbench could not open or continue.
#[derive(Debug, thiserror::Error)]
pub enum TuiError {
    /// The terminal cannot be used.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// The key file is invalid.
    #[error(transparent)]
    Keys(#[from] KeymapError),
}

impl From<io::Error> for TuiError {
    fn from(error: io::Error) -> Self {
        Self::Terminal(error.into())
    }
}

/// Why the workbench was left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExitReason {
    /// The user quit.
    Quit,
    /// The user quit and wants these runs to continue in the background.
    Background(Vec<PathBuf>),
    /// A signal with this number arrived.
    Signal(i32),
    /// The terminal hung up.
    HungUp,
}

/// Opens the workbench and returns once the user leaves it. The session is then dropped: a
/// running training ends with a checkpoint.
///
/// # Errors
/// When there is no terminal, reading or writing it fails, or the key file is invalid.
pub fn run(session: Session, options: &Options) -> Result<ExitReason, TuiError> {
    let keymap = options.keys.as_deref().map_or_else(|| Ok(Keymap::default()), Keymap::load)?;
    let variable = |name: &str| std::env::var(name).ok();
    let theme = Theme::from_env(variable);
    let folder = session.folder().to_owned();
    // Before the terminal is taken over: until then, a signal ends the program, which would leave it as it is.
    let (listener, wake) = Listener::start()?;
    let screen = Screen::open(!options.no_mouse)?;
    let input = Input::new(wake);
    // The screen must outlive the app: it prints the app's final messages after restoring the terminal.
    let mut display = Display { screen, input, drawn: None, asked: false, notify: options.notify };
    let mut app = App::new(Box::new(SessionWorkspace::new(session)), theme, keymap);
    (app.mouse, app.follows_background, app.keeps_edits) =
        (!options.no_mouse, Palette::from_env(variable).is_none(), true);
    if let Some(remembered) = Remembered::load(&folder).filter(|_| !options.fresh) {
        app.restore(remembered);
    }
    report_recovered_edits(&mut app, Path::new("."));
    if options.tour {
        app.show_tour();
    }
    let reason = until_left(&mut app, &mut display, &listener)?;
    if let Err(error) = app.remembered().save(&folder) {
        terminal::report_at_the_end(format!("the choices of this session are not remembered: {error}"));
    }
    Ok(reason)
}

/// Handles events and draws frames until the workbench is left; returns why it was.
fn until_left(app: &mut App, display: &mut Display, listener: &Listener) -> Result<ExitReason, TuiError> {
    let mut last = Instant::now();
    while !app.is_leaving() {
        let now = Instant::now();
        app.guarded(|app| app.tick(now - last));
        last = now;
        let mut connected = false_if_hung_up(display.turn(app))?;
        while let Some(request) = listener.next() {
            match request {
                Request::Quit(signal) => return Ok(ExitReason::Signal(signal)),
                Request::Suspend => connected &= false_if_hung_up(display.screen.suspend().map(|()| true))?,
                Request::Continue => connected &= false_if_hung_up(display.screen.reenter().map(|()| true))?,
                Request::Resize => {}
            }
            app.redraw();
        }
        if !connected {
            listener.set_leaving();
            return Ok(ExitReason::HungUp);
        }
    }
    let runs = std::mem::take(&mut app.background);
    Ok(if runs.is_empty() { ExitReason::Quit } else { ExitReason::Background(runs) })
}

/// Turns an error caused by a hang-up into false.
fn false_if_hung_up(connected: io::Result<bool>) -> io::Result<bool> {
    if connected.as_ref().is_err_and(is_hang_up) { Ok(false) } else { connected }
}

/// Whether an error means that the terminal hung up.
fn is_hang_up(error: &io::Error) -> bool {
    // Reading or writing a hung-up terminal fails with EIO.
    matches!(error.kind(), io::ErrorKind::BrokenPipe | io::ErrorKind::UnexpectedEof)
        || error.raw_os_error() == Some(Errno::IO.raw_os_error())
}

/// The terminal: output and input.
struct Display {
    screen: Screen,
    input: Input,
    /// When the latest frame was drawn.
    drawn: Option<Instant>,
    /// Whether the terminal has been queried for what it supports.
    asked: bool,
    notify: Notify,
}

impl Display {
    /// Draws a frame if something has changed, handles events and carries out the app's request to the
    /// terminal. False if the terminal has hung up.
    fn turn(&mut self, app: &mut App) -> io::Result<bool> {
        if self.drawn.is_none_or(|at| at.elapsed() >= FRAME) && app.is_changed() {
            self.draw(app)?;
            self.drawn = Some(Instant::now());
            self.ask_terminal(app)?;
        }
        let connected = self.take_events(app)?;
        self.fulfil(app)?;
        Ok(connected)
    }

    /// Draws a frame. If that panics, the panic is reported on a screen that can be drawn.
    fn draw(&mut self, app: &mut App) -> io::Result<()> {
        let mut drawn = Ok(());
        if app.guarded(|app| drawn = self.screen.draw(|frame| app.draw(frame))) {
            return drawn;
        }
        // Discard the half-drawn frame.
        self.screen.redraw()?;
        app.show_log_alone();
        let message = app.message();
        match terminal::catch(|| self.screen.draw(|frame| app.draw(frame))) {
            Ok(drawn) => drawn,
            Err(_) => {
                self.screen.redraw()?;
                self.screen.draw(|frame| frame.render_widget(message.as_str(), frame.area()))
            }
        }
    }

    /// Waits for events, at most until the next frame or poll is due, then handles all that have arrived.
    /// False if the terminal has hung up.
    fn take_events(&mut self, app: &mut App) -> io::Result<bool> {
        let pause = match self.drawn {
            Some(at) if app.is_changed() => FRAME.saturating_sub(at.elapsed()),
            Some(_) => IDLE,
            None => Duration::ZERO,
        };
        let mut received = Vec::new();
        let connected = self.input.wait(pause, &mut received)?;
        for received in received {
            app.guarded(|app| app.receive(received));
            if app.is_leaving() {
                break;
            }
        }
        Ok(connected)
    }

    /// Asks the terminal, once, for its graphics protocol and its background. Called after the first frame.
    fn ask_terminal(&mut self, app: &mut App) -> io::Result<()> {
        if std::mem::replace(&mut self.asked, true) {
            return Ok(());
        }
        app.set_graphics(Graphics::find(app.follows_background)?);
        Ok(())
    }

    /// Carries out what the app requests of the terminal.
    fn fulfil(&mut self, app: &mut App) -> io::Result<()> {
        match app.request.take() {
            Some(TerminalRequest::Mouse(on)) => self.screen.set_mouse(on),
            Some(TerminalRequest::Copy(text)) => self.screen.copy(&text),
            Some(TerminalRequest::Notify(text)) => self.screen.notify(self.notify, &text),
            Some(TerminalRequest::Suspend) => signals::stop_job(),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_errors_of_a_closed_terminal_count_as_a_hang_up() {
        use std::io::ErrorKind::{BrokenPipe, PermissionDenied, UnexpectedEof};
        for (kind, is_closed) in [(BrokenPipe, true), (UnexpectedEof, true), (PermissionDenied, false)] {
            assert_eq!(is_hang_up(&kind.into()), is_closed, "{kind:?}");
        }
        // EIO
        assert!(is_hang_up(&io::Error::from_raw_os_error(5)));
        assert!(!false_if_hung_up(Err(BrokenPipe.into())).unwrap());
        assert!(false_if_hung_up(Err(PermissionDenied.into())).is_err());
        assert!(false_if_hung_up(Ok(true)).unwrap() && !false_if_hung_up(Ok(false)).unwrap());
    }
}
