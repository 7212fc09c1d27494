//! Effects: what screens and layers return for the app to carry out. Opening a layer is an effect, and a layer
//! responds to events with effects.

use crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use super::actions::{Tab, UiAction};
use super::input::Keymap;
use super::scene::Object;
use super::view::{Choice, Level};
use super::widgets::theme::Theme;
use mge_workbench::{Command, FigureKind};

/// An effect. When one in a list fails, the rest are skipped.
pub enum Effect {
    /// Carry out a command; asks first if unsaved work or a file would be lost.
    Apply(Command),
    /// Carry out a command whose loss of work the user has confirmed.
    ApplyConfirmed(Command),
    /// Perform an action.
    Perform(UiAction),
    /// Switch to a screen and perform an action there.
    PerformOn(Tab, UiAction),
    /// Show a message.
    ShowMessage(Level, String),
    /// Open a layer over the screen.
    Open(Box<dyn Layer>),
    /// Select an object of the scene, or none.
    Select(Option<Object>),
    /// Take a tool in hand: one of CREATE's catalogue, or the task's own.
    Hold(Option<usize>),
    /// Change what the scene shows.
    Show(Choice),
    /// Replay a past episode of the watched run.
    Replay(u64),
    /// Show a past episode of the watched run without changing the playback position.
    Scrub(u64),
    /// The episode being shown is over: show the next one.
    NextEpisode,
    /// List only the runs that match a filter.
    Filter(String),
    /// Show these columns in the list of runs.
    Columns(String),
    /// Make the groups with a label the baseline of comparisons.
    PinBaseline(String),
    /// Rename a curve of the learning figure; an empty name restores the label.
    NameCurve { label: String, name: String },
    /// Show the curves of the marked runs together.
    Compare,
    /// Add a typed command to the palette's history.
    Remember(String),
    /// Carry out several effects, in order.
    All(Vec<Effect>),
    /// Export figures, each in a file format, to the folder for figures.
    Export(Vec<(FigureKind, &'static str)>),
    /// Leave the workbench.
    Quit,
    /// Leave the workbench; trainings continue in the background.
    QuitToBackground,
    /// Leave the workbench once all trainings are done.
    QuitWhenIdle,
}

impl Effect {
    /// The effect of a command.
    pub fn apply(command: impl Into<Command>) -> Self {
        Self::Apply(command.into())
    }

    /// Opens a layer.
    pub fn open(layer: impl Layer + 'static) -> Self {
        Self::Open(Box::new(layer))
    }

    /// Shows an informational message.
    pub fn info(text: impl Into<String>) -> Self {
        Self::ShowMessage(Level::Info, text.into())
    }
}

/// A popup over the screen.
pub trait Layer {
    /// Handles a key.
    fn key(&mut self, key: KeyEvent) -> Response;

    /// Handles a click.
    fn click(&mut self, _at: Position) -> Response {
        Response::Stay
    }

    /// Handles the mouse: the wheel acts like the arrow keys, the left button clicks.
    fn mouse(&mut self, mouse: MouseEvent) -> Response {
        match mouse.kind {
            MouseEventKind::ScrollUp => self.key(KeyCode::Up.into()),
            MouseEventKind::ScrollDown => self.key(KeyCode::Down.into()),
            MouseEventKind::Down(MouseButton::Left) => self.click((mouse.column, mouse.row).into()),
            _ => Response::Stay,
        }
    }

    /// Handles pasted text.
    fn paste(&mut self, _text: &str) {}

    /// Shows why the effect of [`Response::Try`] failed.
    fn refuse(&mut self, _reason: String) {}

    /// Whether it asks for confirmation before something is lost.
    fn is_warning(&self) -> bool {
        false
    }

    /// Draws it over the screen. Returns the position of the cursor, if it has one.
    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position>;
}

/// What to do after a layer has handled an event.
pub enum Response {
    /// Keep the layer open.
    Stay,
    /// Close the layer.
    Leave,
    /// Close the layer and pass the key on to what is under it.
    Pass,
    /// Close the layer and carry out an effect.
    Do(Effect),
    /// Carry out an effect; close the layer if it succeeds.
    Try(Effect),
}
