//! The workbench on screen: turns keys and mouse events into effects and effects into commands, and draws the
//! result.

mod mouse;
mod perform;
mod questions;
mod quit;
mod recovery;
#[cfg(test)]
pub(super) mod testing;
mod unsaved;

pub use unsaved::{Guarded, report_recovered_edits};

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crossterm::event::{Event, KeyEvent, KeyEventKind, KeyModifiers, MouseEvent, MouseEventKind};
use ratatui::Frame;
use ratatui::buffer::Buffer;

use super::actions::{Action, Context, Tab};
use super::effect::Effect;
use super::input::{Key, Keymap};
use super::layers::{Layer, Response, Tour};
use super::screens::{Chrome, HitRegions, Notice, Region, Screens, Ui, draw_frame, draw_scene, runs, training};
use super::terminal::{Graphics, Protocol, Received};
use super::view::playback::Episode;
use super::view::{Choice, Level, Subject, Workspace};
use super::widgets::theme::Theme;
use mouse::Drag;

/// The state of the user interface.
pub struct App {
    workspace: Box<dyn Workspace>,
    theme: Theme,
    keymap: Keymap,
    /// The screen being shown.
    tab: Tab,
    /// Layers over the screen, the topmost last.
    layers: Vec<Box<dyn Layer>>,
    /// The state of each screen.
    screens: Screens,
    /// What the scene shows.
    subject: Subject,
    /// The latest message, and how long it has been shown.
    notice: Option<(Notice, Duration)>,
    /// Where things were drawn, for the mouse.
    regions: HitRegions,
    /// What the mouse is dragging.
    drag: Option<Drag>,
    request: Option<TerminalRequest>,
    /// Whether the mouse is captured.
    mouse: bool,
    leaving: Leaving,
    /// Whether anything was being trained at the last poll.
    was_busy: bool,
    /// Runs to continue in the background after the workbench is left.
    background: Vec<PathBuf>,
    /// The greedy episode that was shown last.
    greedy: Option<Arc<Episode>>,
    /// Commands typed in the palette, the oldest first.
    typed: Vec<String>,
    /// Time since the visible curves were last requested.
    since_request: Duration,
    /// Whether the session has changes that are not yet due to be drawn.
    news: bool,
    /// Time since changes of the session were last due to be drawn.
    since_news: Duration,
    /// Whether the whole picture must be redrawn.
    changed: bool,
    /// Whether the scene must be redrawn.
    moved: bool,
    /// The latest picture of a screen with a scene, without layers.
    picture: Buffer,
}

/// Whether and when the workbench is to be left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leaving {
    No,
    WhenIdle,
    Now,
}

/// How long a message other than an error is shown.
const NOTICE: Duration = Duration::from_secs(6);
/// Interval between requests for curves while nothing else happens; other processes may be training the runs.
const LOOK: Duration = Duration::from_secs(2);
/// Least time between two pictures that only show changes of the session, such as training progress.
const NEWS: Duration = Duration::from_millis(240);
/// Most that one tick adds to the time for which a message has been shown.
const BLINK: Duration = Duration::from_millis(100);

/// A request that only the owner of the terminal can fulfil.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TerminalRequest {
    /// Suspend the program until the shell continues it.
    Suspend,
    /// Switch mouse capture.
    Mouse(bool),
    /// Copy a text to the clipboard.
    Copy(String),
    /// Notify the user that long work has ended.
    Notify(String),
}

impl App {
    /// The user interface of a workspace.
    pub fn new(workspace: Box<dyn Workspace>, theme: Theme, keymap: Keymap) -> Self {
        let subject = Subject::choose(workspace.view(), &Choice::default(), None, false);
        Self {
            workspace,
            theme,
            keymap,
            tab: Tab::Scene,
            layers: Vec::new(),
            screens: Screens::default(),
            subject,
            notice: None,
            regions: HitRegions::default(),
            drag: None,
            request: None,
            mouse: true,
            leaving: Leaving::No,
            was_busy: false,
            background: Vec::new(),
            greedy: None,
            typed: Vec::new(),
            since_request: Duration::ZERO,
            news: false,
            since_news: Duration::ZERO,
            changed: true,
            moved: false,
            picture: Buffer::default(),
        }
    }

    /// Leaves the mouse to the terminal.
    pub fn without_mouse(mut self) -> Self {
        self.mouse = false;
        self
    }

    /// Opens the tour over the screen.
    pub fn show_tour(&mut self) {
        self.open(Tour::default());
    }

    /// Whether the workbench is to be left.
    pub fn is_leaving(&self) -> bool {
        self.leaving == Leaving::Now
    }

    /// Runs to continue in the background once the workbench is left and its trainings have stopped.
    pub fn background_runs(&self) -> Vec<PathBuf> {
        self.background.clone()
    }

    /// Scans the folder of runs in the background.
    pub fn look_for_runs(&mut self) {
        self.workspace.look_for_runs();
    }

    /// Takes the pending request to the owner of the terminal, if there is one.
    pub fn take_request(&mut self) -> Option<TerminalRequest> {
        self.request.take()
    }

    /// Whether there is something new to draw.
    pub fn is_changed(&self) -> bool {
        self.changed || self.moved
    }

    /// Requests a full redraw, for a terminal that has lost its contents.
    pub fn redraw(&mut self) {
        self.screens.preview.forget();
        self.changed = true;
    }

    /// Sets which images the terminal can show.
    pub fn set_graphics(&mut self, graphics: Graphics) {
        self.screens.preview.set_graphics(graphics);
        self.changed = true;
    }

    /// Handles what the terminal sent.
    pub fn receive(&mut self, received: Received) {
        let graphics = self.screens.preview.graphics();
        match received {
            Received::Event(event) => {
                self.event(event);
                self.screens.scene.player.wake();
            }
            Received::CellSize(cell) => self.set_graphics(Graphics { cell, ..graphics }),
            Received::Attributes { sixel: true } => {
                self.set_graphics(Graphics { protocol: Protocol::Sixel, ..graphics });
            }
            Received::Attributes { sixel: false } => {}
        }
    }

    /// Whether runs are being read from their folder.
    pub fn is_reading_runs(&self) -> bool {
        self.workspace.view().runs_unread > 0
    }

    /// What the screens draw from.
    fn ui(&self) -> Ui<'_> {
        Ui { view: self.workspace.view(), subject: &self.subject, keymap: &self.keymap, theme: &self.theme }
    }

    /// The mutable state of the screens, and what they draw from.
    fn screens_and_ui(&mut self) -> (&mut Screens, Ui<'_>) {
        let Self { workspace, subject, keymap, theme, screens, .. } = self;
        (screens, Ui { view: workspace.view(), subject, keymap, theme })
    }

    /// The contexts in which keys are looked up now, the innermost first.
    fn contexts(&self) -> Vec<Context> {
        let inner = match self.tab {
            Tab::Scene | Tab::Edit if self.screens.scene.hand.is_some() => vec![Context::Hand, Context::Scene],
            Tab::Scene | Tab::Edit => vec![Context::Scene],
            Tab::Schedule => vec![Context::Schedule],
            Tab::Training => vec![Context::Curves],
            Tab::Runs => vec![Context::Runs],
            Tab::Models => vec![Context::Models, Context::List],
            Tab::Figures if self.screens.lists.composer.is_open() => {
                vec![Context::Compose, Context::Figures, Context::List]
            }
            Tab::Figures => vec![Context::Figures, Context::List],
            Tab::Log => vec![Context::List],
        };
        inner.into_iter().chain([Context::Everywhere, Context::Typed]).collect()
    }

    /// Advances time and polls the session.
    pub fn tick(&mut self, elapsed: Duration) {
        let lines = self.workspace.view().log_total;
        let is_changed = self.workspace.poll();
        if is_changed {
            self.note_busy();
        }
        self.show_news(is_changed, elapsed);
        let view = self.workspace.view();
        let fresh = view.log_total.saturating_sub(lines).min(view.log.len());
        let news = view.log[view.log.len() - fresh..].iter().rev().find(|line| line.level != Level::Info);
        if let Some(line) = news.cloned() {
            self.say(line.level, line.text);
        }
        self.age_notice(elapsed);
        if self.leaving == Leaving::WhenIdle && self.workspace.view().training_runs().next().is_none() {
            self.quit();
        }
        if is_changed {
            self.choose_subject(None, false);
            self.show_greedy();
        }
        if self.shows_scene() {
            self.tick_scene(elapsed);
        }
        if self.is_time_to_ask(elapsed) {
            self.request_curves();
        }
        if self.tab == Tab::Runs && self.screens.runs.is_scan_due(elapsed) {
            self.workspace.look_for_runs();
        }
        if self.tab == Tab::Figures {
            self.update_preview();
        }
    }

    /// Requests a redraw for changes of the session, at most once per `NEWS`.
    fn show_news(&mut self, is_changed: bool, elapsed: Duration) {
        self.news |= is_changed;
        self.since_news += elapsed;
        if self.news && self.since_news >= NEWS {
            (self.news, self.since_news) = (false, Duration::ZERO);
            self.changed = true;
        }
    }

    /// Requests a notification when the last training of a run or a model has ended.
    fn note_busy(&mut self) {
        let view = self.workspace.view();
        let is_busy = view.model_work.is_some() || view.training_runs().next().is_some();
        if std::mem::replace(&mut self.was_busy, is_busy) && !is_busy {
            self.request = Some(TerminalRequest::Notify("nothing is being trained any more".to_owned()));
        }
    }

    /// Whether to request the visible curves again. This is not done at every tick: finding out which they are
    /// takes milliseconds with thousands of runs.
    fn is_time_to_ask(&mut self, elapsed: Duration) -> bool {
        self.since_request += elapsed;
        let is_time = self.changed || self.since_request >= LOOK;
        if is_time {
            self.since_request = Duration::ZERO;
        }
        is_time
    }

    /// Requests the curves of the visible runs, and the files of the previewed run.
    fn request_curves(&mut self) {
        let ui = self.ui();
        let (wanted, previewed) = match self.tab {
            Tab::Scene | Tab::Training => (training::wanted(&self.screens.curves, &self.screens.runs, &ui), None),
            Tab::Runs => runs::wanted(&self.screens.runs, &ui),
            _ => return,
        };
        self.workspace.request_curves(wanted);
        if let Some(run) = previewed {
            self.workspace.request_details(&run);
        }
    }

    /// Whether a scene is visible: on the screens that have one, and beside the curves for a past episode.
    fn shows_scene(&self) -> bool {
        self.tab.has_scene() || (self.tab == Tab::Training && matches!(self.subject.choice(), Choice::Past(_)))
    }

    /// Shows a requested greedy episode once it is available.
    fn show_greedy(&mut self) {
        let Some(greedy) = self.workspace.view().watched.as_ref().and_then(|watched| watched.greedy.clone()) else {
            return;
        };
        if self.greedy.as_ref().is_none_or(|known| !Arc::ptr_eq(known, &greedy)) {
            self.greedy = Some(greedy.clone());
            self.choose_subject(Some(Choice::Past(greedy)), false);
        }
    }

    fn tick_scene(&mut self, elapsed: Duration) {
        self.screens.scene.show_all(self.tab == Tab::Training);
        if let Some(episode) = self.subject.needed_agent() {
            self.workspace.request_agent(episode);
        }
        if self.screens.scene.needs_model(&self.subject) {
            let model = self.workspace.model_for(&self.subject.task().clone());
            self.subject.set_model(model);
        }
        let (moved, effects) = self.screens.scene.update(&self.subject, elapsed);
        self.moved |= moved;
        self.carry_out(effects);
        // Request a training episode until there is one to show.
        let watched = self.workspace.view().watched.as_ref();
        if watched.is_some_and(|watched| watched.run.active && watched.live.is_none()) {
            self.workspace.request_live();
        }
    }

    /// Updates what the scene shows from the current view.
    fn choose_subject(&mut self, choice: Option<Choice>, next: bool) {
        let choice = choice.unwrap_or_else(|| self.subject.choice().clone());
        // A player that has stopped repeating its episode moves on as soon as there is another.
        let next = next || self.screens.scene.player.is_resting();
        let subject = Subject::choose(self.workspace.view(), &choice, Some(&self.subject), next);
        let is_other = !Arc::ptr_eq(subject.episode(), self.subject.episode());
        if subject.run().map(|run| &run.path) != self.subject.run().map(|run| &run.path) {
            self.screens.curves.forget_window();
        }
        self.screens.curves.follow(self.subject.past_episode(), subject.past_episode());
        self.subject = subject;
        self.show_beside();
        if is_other || next {
            self.screens.scene.begin(&self.subject, is_other);
            self.changed = true;
            if self.subject.is_of_run() {
                // Request the following episode in advance.
                self.workspace.request_live();
            }
        }
    }

    fn age_notice(&mut self, elapsed: Duration) {
        let Some((notice, shown)) = &mut self.notice else { return };
        // Work that blocks the screen must not use up the display time of its own message.
        *shown += elapsed.min(BLINK);
        if notice.level != Level::Error && *shown > NOTICE {
            self.notice = None;
            self.changed = true;
        }
    }

    /// Handles an event of the terminal.
    pub fn event(&mut self, event: Event) {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.key(key),
            Event::Mouse(mouse) => self.mouse_event(mouse),
            Event::Paste(text) => {
                if let Some(layer) = self.layers.last_mut() {
                    layer.paste(&text);
                    self.changed = true;
                }
            }
            Event::Resize(..) => self.changed = true,
            _ => {}
        }
    }

    fn key(&mut self, key: KeyEvent) {
        self.changed = true;
        let action = self.keymap.action(Key::from(key), &self.contexts());
        // With Ctrl, quit and suspend work over any layer.
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        if let Some(action @ (Action::Quit | Action::Suspend)) = action
            && control
        {
            self.perform(action);
            return;
        }
        if let Some(layer) = self.layers.last_mut() {
            match layer.key(key) {
                Response::Pass => {
                    self.layers.pop();
                    self.key(key);
                }
                response => self.respond(response),
            }
        } else if let Some(action) = action {
            self.notice = None;
            self.perform(action);
        }
    }

    fn mouse_event(&mut self, mouse: MouseEvent) {
        let hovering = mouse.kind == MouseEventKind::Moved;
        if self.layers.is_empty() {
            self.changed |= self.mouse(mouse);
        } else if !hovering {
            self.changed = true;
            if let Some(layer) = self.layers.last_mut() {
                let response = layer.mouse(mouse);
                self.respond(response);
            }
        }
    }

    fn respond(&mut self, response: Response) {
        match response {
            Response::Stay => {}
            Response::Leave | Response::Pass => _ = self.layers.pop(),
            Response::Do(effect) => {
                self.layers.pop();
                self.carry_out(vec![effect]);
            }
            Response::Try(effect) => {
                let depth = self.layers.len();
                match self.try_effect(effect) {
                    // The effect may have opened a question on top: remove the answered layer below it.
                    Ok(()) => _ = self.layers.remove(depth - 1),
                    Err(error) => {
                        if let Some(layer) = self.layers.last_mut() {
                            layer.refuse(error);
                        }
                    }
                }
            }
        }
    }

    /// Carries out effects in order. The first failure is shown and skips the rest.
    fn carry_out(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            if let Err(error) = self.try_effect(effect) {
                return self.say(Level::Error, error);
            }
        }
    }

    /// Shows a message.
    pub fn say(&mut self, level: Level, text: impl Into<String>) {
        self.notice = Some((Notice { level, text: text.into() }, Duration::ZERO));
        self.changed = true;
    }

    /// Shows a message and keeps it in the log.
    pub fn warn(&mut self, level: Level, text: &str) {
        self.workspace.log(level, text.to_owned());
        self.say(level, text);
    }

    /// Whether the preview of a figure is still being drawn.
    pub fn is_drawing_figure(&self) -> bool {
        self.screens.preview.is_drawing()
    }

    /// Draws the screen and its layers. While only the scene has changed, as during playback, everything else is
    /// copied from the previous picture.
    pub fn draw(&mut self, frame: &mut Frame) {
        let only_moved = std::mem::take(&mut self.moved) & !std::mem::take(&mut self.changed);
        // A small terminal shows no scene.
        let has_scene = self.regions.all().iter().any(|(_, region)| matches!(region, Region::Scene(_)));
        let known = self.picture.area == frame.area() && has_scene;
        if only_moved && known && self.tab.has_scene() && self.layers.is_empty() {
            let notice = self.notice.as_ref().map(|(notice, _)| notice);
            draw_scene(&self.ui(), &self.screens.scene, notice, &self.picture, frame.buffer_mut());
            return self.theme.make_plain(frame.buffer_mut());
        }
        let contexts = self.contexts();
        let chrome = Chrome {
            tab: self.tab,
            contexts: &contexts,
            notice: self.notice.as_ref().map(|(notice, _)| notice),
            covered: !self.layers.is_empty(),
        };
        let area = frame.area();
        self.regions = draw_frame(&self.ui(), &self.screens, &chrome, area, frame.buffer_mut());
        self.screens.curves.cache.end_frame();
        if self.tab.has_scene() {
            self.picture.resize(area);
            self.picture.content.clone_from_slice(&frame.buffer_mut().content);
        }
        let mut cursor = None;
        // A terminal too small for a screen is too small for layers.
        if !self.regions.all().is_empty() {
            for layer in &mut self.layers {
                cursor = layer.draw(area, &self.keymap, &self.theme, frame.buffer_mut());
            }
        }
        if let Some(cursor) = cursor {
            frame.set_cursor_position(cursor);
        }
        self.theme.make_plain(frame.buffer_mut());
    }
}
