//! The screens: state, drawing and actions of each. A screen draws from a [`Ui`] and answers actions with effects; it
//! has no access to the session or the terminal.

mod charts;
mod curves;
pub mod edit;
mod figure_in_cells;
pub mod figures;
mod frame;
pub mod lists;
pub mod log;
pub mod models;
mod pane;
mod regions;
pub mod run_form;
pub mod runs;
pub mod scene;
pub mod scene_actions;
mod scene_pane;
pub mod schedule;
mod status;
pub mod tools;
pub mod training;
mod workbench;

pub use frame::{Chrome, draw_frame};
use regions::row_regions;
pub use regions::{HitRegion, HitRegions};

use super::actions::Tab;
use super::input;
use super::view::{RunSummary, Subject, ViewModel};
use super::widgets::preview::Preview;
use super::widgets::theme::Theme;

/// The state of the screens.
#[derive(Default)]
pub struct Screens {
    /// Of the Scene and the Edit screen.
    pub scene: scene::Scene,
    /// Of the curves on the Training screen.
    pub curves: curves::CurvesState,
    /// Of those on the Scene screen.
    pub beside: curves::CurvesState,
    /// Of the schedule's editor.
    pub schedule: schedule::Schedule,
    /// Of the list of runs.
    pub runs: runs::Runs,
    /// Selected lines of the Models, Figures and Log screens.
    pub lists: lists::Lists,
    /// The preview on the Figures screen.
    pub preview: Preview,
}

impl Screens {
    /// The state of the curves on a screen, and that of the list of runs.
    pub fn curves_on(&mut self, tab: Tab) -> (&mut curves::CurvesState, &runs::Runs) {
        (if tab == Tab::Scene { &mut self.beside } else { &mut self.curves }, &self.runs)
    }
}

/// What screens draw from.
#[derive(Clone, Copy)]
pub struct Ui<'a> {
    /// The view of the session.
    pub view: &'a ViewModel,
    /// What the scene shows.
    pub subject: &'a Subject,
    /// Colours and markers.
    pub theme: &'a Theme,
}

impl Ui<'_> {
    /// Replaces each `{name}` of an action in a text by its key.
    pub fn text(&self, text: &str) -> String {
        input::fill(text)
    }

    /// Whether it is the watched run.
    fn is_watched(&self, run: &RunSummary) -> bool {
        self.subject.run().is_some_and(|watched| watched.path == run.path)
    }
}
