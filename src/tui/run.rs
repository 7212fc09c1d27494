//! The event loop: events and time in, pictures out.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::app::{App, Guarded, TerminalRequest, report_kept};
use super::input::{Keymap, KeymapError};
#[cfg(unix)]
use super::terminal::signals::{self, Listener, Request};
use super::terminal::{self, Graphics, Input, Screen, TerminalError};
use super::view::SessionWorkspace;
use super::widgets::theme::Theme;
use crate::workbench::Session;

/// Time between two pictures at least.
const FRAME: Duration = Duration::from_micros(16_667);
/// Time between two looks at the session, and between two pictures of an episode that is played.
const IDLE: Duration = Duration::from_millis(60);

/// How the workbench opens.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A key file.
    pub keys: Option<PathBuf>,
    /// Show the tour first.
    pub tour: bool,
    /// Leave the mouse to the terminal.
    pub no_mouse: bool,
    /// How the terminal says that something long has ended.
    pub notify: Notify,
}

/// How the terminal says that something long has ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Notify {
    /// By its bell.
    #[default]
    Bell,
    /// By a notification of the desktop (OSC 9).
    Desktop,
    /// By a notification of the desktop, for terminals that know only OSC 777, such as rxvt-unicode.
    Osc777,
    /// Not at all.
    Off,
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
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Leaving {
    /// By the person.
    Quit,
    /// By the person, who wants these runs to go on in the background.
    Background(Vec<PathBuf>),
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
    let screen = Screen::open(!options.no_mouse)?;
    #[cfg(unix)]
    let (listener, wake) = Listener::start()?;
    #[cfg(unix)]
    let input = Input::new(wake);
    #[cfg(not(unix))]
    let input = Input;
    // The screen outlives the workbench, whose final messages it shows once the terminal is given back.
    let mut display = Display { screen, input, drawn: None, asked: false, notify: options.notify };
    let app = App::new(Box::new(SessionWorkspace::new(session)), theme, keymap);
    let mut app = Guarded(if options.no_mouse { app.without_mouse() } else { app });
    report_kept(&mut app, Path::new("."));
    app.look_for_runs();
    if options.tour {
        app.show_tour();
    }
    let mut last = Instant::now();
    while !app.is_leaving() {
        let now = Instant::now();
        app.guarded(|app| app.tick(now - last));
        last = now;
        #[cfg_attr(not(unix), expect(unused_mut, reason = "only signals change it"))]
        let mut there = unless_gone(display.turn(&mut app))?;
        #[cfg(unix)]
        while let Some(request) = listener.next() {
            match request {
                Request::Quit(signal) => return Ok(Leaving::Signal(signal)),
                Request::Suspend => there &= unless_gone(display.screen.suspend().map(|()| true))?,
                Request::Continue => there &= unless_gone(display.screen.reenter().map(|()| true))?,
                Request::Resize => {}
            }
            app.redraw();
        }
        if !there {
            #[cfg(unix)]
            listener.note_leaving();
            return Ok(Leaving::HungUp);
        }
    }
    let runs = app.left_in_background();
    Ok(if runs.is_empty() { Leaving::Quit } else { Leaving::Background(runs) })
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

/// The terminal, out and in.
struct Display {
    screen: Screen,
    input: Input,
    /// When the latest picture was drawn.
    drawn: Option<Instant>,
    /// The terminal was asked what pictures it can show.
    asked: bool,
    notify: Notify,
}

impl Display {
    /// Draws what has changed, takes in events and does what they ask of the terminal. False
    /// if the terminal is gone.
    fn turn(&mut self, app: &mut App) -> io::Result<bool> {
        if self.drawn.is_none_or(|at| at.elapsed() >= FRAME) && app.is_changed() {
            self.draw(app)?;
            self.drawn = Some(Instant::now());
            self.find_graphics(app)?;
        }
        let there = self.take_events(app)?;
        self.fulfil(app)?;
        Ok(there)
    }

    /// Draws a frame. One that cannot be drawn is reported on a screen that can.
    fn draw(&mut self, app: &mut App) -> io::Result<()> {
        let mut drawn = Ok(());
        if app.guarded(|app| drawn = self.screen.draw(|frame| app.draw(frame))) {
            return drawn;
        }
        // What was half drawn is forgotten.
        self.screen.redraw()?;
        app.show_what_can_be_drawn();
        let message = app.message();
        match terminal::catch(|| self.screen.draw(|frame| app.draw(frame))) {
            Ok(drawn) => drawn,
            Err(_) => {
                self.screen.redraw()?;
                self.screen.draw(|frame| frame.render_widget(message.as_str(), frame.area()))
            }
        }
    }

    /// Waits until something may have changed, then takes in all events that are there. False
    /// if the terminal is gone.
    fn take_events(&mut self, app: &mut App) -> io::Result<bool> {
        let pause = match self.drawn {
            Some(at) if app.is_changed() => FRAME.saturating_sub(at.elapsed()),
            Some(_) => IDLE,
            None => Duration::ZERO,
        };
        let mut received = Vec::new();
        let there = self.input.wait(pause, &mut received)?;
        for received in received {
            app.guarded(|app| app.receive(received));
            if app.is_leaving() {
                break;
            }
        }
        Ok(there)
    }

    /// Finds out what pictures the terminal can show. The first frame is drawn by then.
    fn find_graphics(&mut self, app: &mut App) -> io::Result<()> {
        if std::mem::replace(&mut self.asked, true) {
            return Ok(());
        }
        app.set_graphics(Graphics::find()?);
        Ok(())
    }

    fn fulfil(&mut self, app: &mut App) -> io::Result<()> {
        match app.take_request() {
            Some(TerminalRequest::Mouse(on)) => self.screen.set_mouse(on),
            Some(TerminalRequest::Copy(text)) => self.screen.copy(&text),
            Some(TerminalRequest::Notify(text)) => self.screen.notify(self.notify, &text),
            #[cfg(unix)]
            Some(TerminalRequest::Suspend) => signals::stop_job(),
            #[cfg(not(unix))]
            Some(TerminalRequest::Suspend) => Ok(()),
            None => Ok(()),
        }
    }
}
