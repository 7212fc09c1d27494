//! The event loop: events and time in, pictures out.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};

use super::app::{App, Guarded, TerminalRequest, report_kept};
use super::input::{Keymap, KeymapError};
#[cfg(unix)]
use super::terminal::signals::{self, Listener, Request};
use super::terminal::{Graphics, Screen, TerminalError};
#[cfg(unix)]
use super::terminal::{Input, wait_for_input};
use super::view::SessionWorkspace;
use super::widgets::theme::Theme;
use crate::workbench::Session;

/// Time between two pictures at least.
const FRAME: Duration = Duration::from_micros(16_667);
/// Time between two looks at the session while nothing moves.
const IDLE: Duration = Duration::from_millis(40);

/// How the workbench opens.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A key file.
    pub keys: Option<PathBuf>,
    /// Show the tour first.
    pub tour: bool,
    /// Leave the mouse to the terminal.
    pub no_mouse: bool,
}

/// Why the workbench could not open or go on.
#[derive(Debug, thiserror::Error)]
pub enum TuiError {
    /// The terminal.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// The key file.
    #[error(transparent)]
    Keys(#[from] KeymapError),
}

impl From<io::Error> for TuiError {
    fn from(error: io::Error) -> Self {
        Self::Terminal(error.into())
    }
}

/// How the workbench was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leaving {
    /// By the person.
    Quit,
    /// By a signal of this number.
    Signal(i32),
    /// Because the terminal went away.
    HungUp,
}

/// Opens the workbench and returns once it is left. The session is dropped then: a
/// running training ends with a checkpoint.
///
/// # Errors
/// When there is no terminal, it fails, or the key file is wrong.
pub fn run(session: Session, options: &Options) -> Result<Leaving, TuiError> {
    let keymap = options.keys.as_deref().map_or_else(|| Ok(Keymap::default()), Keymap::load)?;
    let theme = Theme::from_env(|name| std::env::var(name).ok());
    let mut screen = Screen::open(!options.no_mouse)?;
    #[cfg(unix)]
    let listener = Listener::start()?;
    let app = App::new(Box::new(SessionWorkspace::new(session)), theme, keymap);
    let mut app = Guarded(if options.no_mouse { app.without_mouse() } else { app });
    report_kept(&mut app, Path::new("."));
    if options.tour {
        app.show_tour();
    }
    let mut drawn: Option<Instant> = None;
    let mut last = Instant::now();
    while !app.is_leaving() {
        let now = Instant::now();
        app.tick(now - last);
        last = now;
        let mut there = unless_gone(turn(&mut app, &mut screen, &mut drawn))?;
        #[cfg(unix)]
        while let Some(request) = listener.next() {
            match request {
                Request::Quit(signal) => return Ok(Leaving::Signal(signal)),
                Request::Suspend => there &= unless_gone(screen.suspend().map(|()| true))?,
                Request::Continue => there &= unless_gone(screen.reenter().map(|()| true))?,
            }
            app.redraw();
        }
        if !there {
            #[cfg(unix)]
            listener.note_leaving();
            return Ok(Leaving::HungUp);
        }
    }
    Ok(Leaving::Quit)
}

/// Draws what has changed, takes in events and does what they ask of the terminal. False
/// if the terminal is gone.
fn turn(app: &mut App, screen: &mut Screen, drawn: &mut Option<Instant>) -> io::Result<bool> {
    if drawn.is_none_or(|at| at.elapsed() >= FRAME) && app.take_changed() {
        screen.draw(|frame| app.draw(frame))?;
        if drawn.replace(Instant::now()).is_none() {
            find_graphics(app);
        }
    }
    let there = wait_for_events(app, *drawn)?;
    fulfil(app, screen)?;
    Ok(there)
}

/// False if the terminal is gone, whether it said so in so many words or not.
fn unless_gone(there: io::Result<bool>) -> io::Result<bool> {
    if there.as_ref().is_err_and(is_gone) { Ok(false) } else { there }
}

/// Whether an error says that the terminal went away.
fn is_gone(error: &io::Error) -> bool {
    // A hung-up terminal answers with an input/output error.
    const EIO: i32 = 5;
    matches!(error.kind(), io::ErrorKind::BrokenPipe | io::ErrorKind::UnexpectedEof)
        || (cfg!(unix) && error.raw_os_error() == Some(EIO))
}

/// Waits until something may have changed, then takes in all events that are there. False
/// if the terminal is gone: the event reader would try to read from it for ever.
fn wait_for_events(app: &mut App, drawn: Option<Instant>) -> io::Result<bool> {
    let pause = if app.is_animated() || app.is_changed() {
        drawn.map_or(Duration::ZERO, |at| FRAME.saturating_sub(at.elapsed()))
    } else {
        IDLE
    };
    #[cfg(unix)]
    let pause = match wait_for_input(pause)? {
        Input::Gone => return Ok(false),
        Input::There | Input::None => Duration::ZERO,
    };
    if event::poll(pause)? {
        app.event(event::read()?);
        while event::poll(Duration::ZERO)? && !app.is_leaving() {
            app.event(event::read()?);
        }
    }
    Ok(true)
}

/// Finds out what pictures the terminal can show. The first frame is drawn by then; what
/// was typed while the terminal answered counts.
fn find_graphics(app: &mut App) {
    let (graphics, typed) = Graphics::detect();
    app.set_graphics(graphics);
    for character in typed.chars() {
        app.event(Event::Key(typed_key(character)));
    }
}

/// The key that sends a character.
fn typed_key(character: char) -> KeyEvent {
    match character {
        '\r' => KeyCode::Enter.into(),
        '\t' => KeyCode::Tab.into(),
        '\x7f' => KeyCode::Backspace.into(),
        '\x01'..='\x1a' => KeyEvent::new(KeyCode::Char((character as u8 - 1 + b'a') as char), KeyModifiers::CONTROL),
        other => KeyCode::Char(other).into(),
    }
}

fn fulfil(app: &mut App, screen: &mut Screen) -> io::Result<()> {
    match app.take_request() {
        Some(TerminalRequest::Mouse(on)) => screen.set_mouse(on),
        Some(TerminalRequest::Copy(text)) => screen.copy(&text),
        #[cfg(unix)]
        Some(TerminalRequest::Suspend) => signals::stop_job(),
        #[cfg(not(unix))]
        Some(TerminalRequest::Suspend) => Ok(()),
        None => Ok(()),
    }
}
