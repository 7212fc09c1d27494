//! What screens and layers ask of the workbench; the app carries it out.

use super::actions::{Action, Tab};
use super::layers::Layer;
use super::scene::Object;
use super::view::{Choice, Level};
use crate::workbench::{Command, FigureKind};

/// Something to be done. Of several, one that fails ends the rest.
pub enum Effect {
    /// Carry out a command, after a question if unsaved work or a file would be lost.
    Apply(Command),
    /// Carry out a command whose loss has been agreed to.
    ApplyConfirmed(Command),
    /// Do what an action asks for.
    Perform(Action),
    /// Do what an action asks for on its screen.
    PerformOn(Tab, Action),
    /// Show a message.
    Say(Level, String),
    /// Lay something over the screen.
    Open(Box<dyn Layer>),
    /// Select an object of the scene, or none.
    Select(Option<Object>),
    /// Take a tool of CREATE's catalogue in hand, or the task's own.
    Hold(Option<usize>),
    /// Show something else in the scene.
    Show(Choice),
    /// Play an episode of the watched run's past again.
    Replay(u64),
    /// Move the scene to an episode of the watched run's past; the time in it stays where it is.
    Scrub(u64),
    /// The episode being shown is over: the next one is due.
    NextEpisode,
    /// List only the runs that a text describes.
    Filter(String),
    /// Show these columns of the list of runs.
    Columns(String),
    /// Compare groups of runs with those of a label.
    PinBaseline(String),
    /// Give a curve of the learning figure another name; an empty one takes it away.
    NameCurve { label: String, name: String },
    /// Show the curves of the marked runs together.
    Compare,
    /// Keep a command that was typed, to be typed again.
    Remember(String),
    /// Carry out several effects, in order.
    All(Vec<Effect>),
    /// Export figures, each in a file format, into the folder for figures.
    Export(Vec<(FigureKind, &'static str)>),
    /// Leave the workbench.
    Quit,
    /// Leave the workbench; what is being trained goes on in the background.
    QuitToBackground,
    /// Leave the workbench once nothing is trained any more.
    QuitWhenIdle,
}

impl Effect {
    /// Carries out a command.
    pub fn apply(command: impl Into<Command>) -> Self {
        Self::Apply(command.into())
    }

    /// Lays something over the screen.
    pub fn open(layer: impl Layer + 'static) -> Self {
        Self::Open(Box::new(layer))
    }

    /// Says what is so.
    pub fn info(text: impl Into<String>) -> Self {
        Self::Say(Level::Info, text.into())
    }
}
