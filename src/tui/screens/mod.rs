//! The screens: state, drawing and actions of each. A screen draws from a [`Ui`] and answers actions with effects; it
//! has no access to the session or the terminal.

mod charts;
pub mod edit;
pub mod figures;
mod frame;
pub mod lists;
pub mod log;
pub mod models;
mod pane;
mod regions;
pub mod runs;
pub mod scene;
pub mod schedule;
mod schedule_points;
mod status;
pub mod tools;
pub mod training;
mod workbench;

pub use frame::{Chrome, Message, beside_scene, draw_frame, draw_scene};
pub use regions::{HitRegion, HitRegions};

use super::input::Keymap;
use super::view::{RunSummary, Subject, ViewModel};
use super::widgets::preview::Preview;
use super::widgets::theme::Theme;

/// What screens draw from.
#[derive(Clone, Copy)]
pub struct Ui<'a> {
    /// The view of the session.
    pub view: &'a ViewModel,
    /// What the scene shows.
    pub subject: &'a Subject,
    /// The key map, to name keys in texts.
    pub keymap: &'a Keymap,
    /// Colours and markers.
    pub theme: &'a Theme,
}

impl Ui<'_> {
    /// Replaces each `{name}` of an action in a text by its key.
    pub fn text(&self, text: &str) -> String {
        self.keymap.fill(text)
    }

    /// Whether it is the watched run.
    fn is_watched(&self, run: &RunSummary) -> bool {
        self.subject.run().is_some_and(|watched| watched.path == run.path)
    }
}

/// The state of the screens.
#[derive(Default)]
pub struct Screens {
    /// Of the Scene and the Edit screen.
    pub scene: scene::Scene,
    /// Of the curves.
    pub curves: training::CurvesState,
    /// Of the schedule's editor.
    pub schedule: schedule::Schedule,
    /// Of the list of runs.
    pub runs: runs::Runs,
    /// Selected lines of the Models, Figures and Log screens.
    pub lists: lists::Lists,
    /// The preview on the Figures screen.
    pub preview: Preview,
}
