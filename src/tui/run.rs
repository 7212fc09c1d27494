//! The event loop: takes in events and elapsed time, draws frames.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use signal_hook::consts::SIGHUP;

use super::app::{App, Remembered, TerminalRequest, report_recovered_edits};
use super::input::fill;
use super::terminal::events::{self, Event};
use super::terminal::{self, Notify, Screen, TerminalError, graphics};
use super::view::{Level, SessionWorkspace};
use super::widgets::theme::Theme;
use mge_workbench::Session;

/// Minimum time between two frames.
const FRAME: Duration = Duration::from_micros(16_667);
/// Longest wait for input before the session is polled again; also the frame time of an episode being played.
const IDLE: Duration = Duration::from_millis(60);

/// How the workbench opens.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Greet the user, who has no runs yet.
    pub greet: bool,
    /// Forget what earlier sessions with the folder of runs have chosen.
    pub fresh: bool,
    /// The session has the task that the user named, not the one of the last session.
    pub keeps_task: bool,
    /// Do not capture the mouse.
    pub no_mouse: bool,
    /// How the terminal announces that long work has ended.
    pub notify: Notify,
}

/// Why the workbench was left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExitReason {
    /// The user quit.
    Quit,
    /// The user quit and wants these runs to continue in the background.
    Background(Vec<PathBuf>),
    /// A signal with this number arrived, or the terminal hung up (SIGHUP).
    Signal(i32),
}

/// Opens the workbench and returns once the user leaves it. The session is then dropped: a
/// running training ends with a checkpoint.
///
/// # Errors
/// When there is no terminal, reading or writing it fails, or the workbench panics: unsaved edits are then kept, as
/// after a signal.
pub fn run(session: Session, options: &Options) -> Result<ExitReason, TerminalError> {
    let folder = session.folder().to_owned();
    // Before the terminal is taken over: until then, a signal ends the program, which would leave it as it is.
    let (sender, events) = events::listen()?;
    let screen = Screen::open(!options.no_mouse)?;
    let variable = |name: &str| std::env::var(name).ok();
    let (graphics, is_light) = graphics::ask(variable);
    events::read_input(sender)?;
    // The screen must outlive the app: it prints the app's final messages after restoring the terminal.
    let mut display = Display { screen, events, drawn: None, notify: options.notify };
    let mut app = App::new(Box::new(SessionWorkspace::new(session)), Theme::from_env(variable, is_light));
    app.keeps_edits = true;
    app.screens.preview.graphics = graphics;
    if let Some(remembered) = Remembered::load(&folder).filter(|_| !options.fresh) {
        app.restore(remembered, options.keeps_task);
    }
    app.follow_watched(true);
    report_recovered_edits(&mut app, Path::new("."));
    if options.greet {
        app.show_message(
            Level::Info,
            fill("welcome: {train} trains, {help} shows all keys, {palette} finds any action"),
        );
    }
    let mut writes = None;
    let outcome = catch_unwind(AssertUnwindSafe(|| until_left(&mut app, &mut display, &folder, &mut writes)));
    // The choices of the end come last.
    let _ = writes.map(JoinHandle::join);
    let reason = outcome.map_err(|_| TerminalError::Panic(terminal::take_held().join("; ")))??;
    if let Err(error) = app.remembered().save(&folder) {
        terminal::report_at_the_end(format!("the choices of this session are not remembered: {error}"));
    }
    Ok(reason)
}

/// Handles events and draws frames until the workbench is left; returns why it was. Writes the choices when other runs are
/// trained, for the case that the program is killed; that they cannot be written is told at its end.
fn until_left(
    app: &mut App,
    display: &mut Display,
    folder: &Path,
    writes: &mut Option<JoinHandle<()>>,
) -> Result<ExitReason, TerminalError> {
    let mut last = Instant::now();
    let mut is_due = false;
    while !app.is_leaving() {
        let now = Instant::now();
        let trained = app.training.clone();
        app.tick(now - last);
        is_due |= app.training != trained;
        if is_due && writes.as_ref().is_none_or(JoinHandle::is_finished) {
            is_due = false;
            let (choices, folder) = (app.remembered(), folder.to_owned());
            *writes = Some(thread::spawn(move || drop(choices.save(&folder))));
        }
        last = now;
        match display.turn(app) {
            Ok(Some(signal)) => return Ok(ExitReason::Signal(signal)),
            _ if events::is_hung_up() => return Ok(ExitReason::Signal(SIGHUP)),
            Ok(None) => {}
            Err(error) => return Err(error.into()),
        }
    }
    let runs = std::mem::take(&mut app.background);
    Ok(if runs.is_empty() { ExitReason::Quit } else { ExitReason::Background(runs) })
}

/// The terminal: output and input.
struct Display {
    screen: Screen,
    events: Receiver<Event>,
    /// When the latest frame was drawn.
    drawn: Option<Instant>,
    notify: Notify,
}

impl Display {
    /// Draws a frame if something has changed, handles events and carries out the app's request to the terminal.
    /// Returns the number of the signal that asks the workbench to end, if there was one.
    fn turn(&mut self, app: &mut App) -> io::Result<Option<i32>> {
        if self.drawn.is_none_or(|at| at.elapsed() >= FRAME) && app.is_changed() {
            self.screen.draw(|frame| app.draw(frame))?;
            self.drawn = Some(Instant::now());
        }
        let signal = self.take_events(app)?;
        self.fulfil(app)?;
        Ok(signal)
    }

    /// Waits for events, at most until the next frame or poll is due, then handles those that have arrived.
    fn take_events(&mut self, app: &mut App) -> io::Result<Option<i32>> {
        let mut pause = match self.drawn {
            Some(at) if app.is_changed() => FRAME.saturating_sub(at.elapsed()),
            Some(_) => IDLE,
            None => Duration::ZERO,
        };
        let started = Instant::now();
        while let Ok(event) = self.events.recv_timeout(pause) {
            match event {
                Event::Input(input) => app.event(input?),
                Event::Quit(signal) => return Ok(Some(signal)),
                Event::Suspend => self.screen.suspend(&app.standing_still()).map(|()| app.redraw())?,
                Event::Continue => self.screen.reenter().map(|()| app.redraw())?,
            }
            if app.is_leaving() || started.elapsed() > IDLE {
                break;
            }
            pause = Duration::ZERO;
        }
        Ok(None)
    }

    /// Carries out what the app requests of the terminal.
    fn fulfil(&mut self, app: &mut App) -> io::Result<()> {
        match app.request.take() {
            Some(TerminalRequest::Notify(text)) => self.screen.notify(self.notify, &text),
            Some(TerminalRequest::Suspend) => events::stop_job(),
            None => Ok(()),
        }
    }
}
