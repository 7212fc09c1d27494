//! The event loop: events and time in, pictures out.

use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crossterm::event;

use super::app::{App, TerminalWish};
use super::desk::SessionDesk;
use super::keymap::{Keymap, KeymapError};
use super::layers::{Layer, Tour};
use super::screens;
#[cfg(unix)]
use super::signals::{self, Listener, Request};
use super::terminal::{Screen, TerminalError};
use super::theme::Theme;
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
    let mut app = App::new(Box::new(SessionDesk::new(session)), theme, keymap);
    app.mouse = !options.no_mouse;
    if options.tour {
        app.layers.push(Layer::Tour(Tour::default()));
    }
    let mut drawn: Option<Instant> = None;
    let mut last = Instant::now();
    while !app.leaving {
        let now = Instant::now();
        app.tick(now - last);
        last = now;
        if drawn.is_none_or(|at| now - at >= FRAME) && app.take_changed() {
            screen.draw(|frame| screens::draw(&mut app, frame))?;
            drawn = Some(now);
        }
        wait_for_events(&mut app, drawn)?;
        #[cfg(unix)]
        while let Some(request) = listener.next() {
            match request {
                Request::Quit(signal) => return Ok(Leaving::Signal(signal)),
                Request::Suspend => screen.suspend()?,
                Request::Continue => screen.reenter()?,
            }
            app.touch();
        }
        fulfil(&mut app, &mut screen)?;
    }
    Ok(Leaving::Quit)
}

/// Waits until something may have changed, then takes in all events that are there.
fn wait_for_events(app: &mut App, drawn: Option<Instant>) -> io::Result<()> {
    let pause = if app.is_animated() || app.is_changed() {
        drawn.map_or(Duration::ZERO, |at| FRAME.saturating_sub(at.elapsed()))
    } else {
        IDLE
    };
    if event::poll(pause)? {
        app.event(event::read()?);
        while event::poll(Duration::ZERO)? && !app.leaving {
            app.event(event::read()?);
        }
    }
    Ok(())
}

fn fulfil(app: &mut App, screen: &mut Screen) -> io::Result<()> {
    match app.wish.take() {
        Some(TerminalWish::Mouse(on)) => screen.set_mouse(on),
        Some(TerminalWish::Copy(text)) => screen.copy(&text),
        #[cfg(unix)]
        Some(TerminalWish::Suspend) => signals::stop_job(),
        #[cfg(not(unix))]
        Some(TerminalWish::Suspend) => Ok(()),
        None => Ok(()),
    }
}
