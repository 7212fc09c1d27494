//! The screens: state, drawing and actions of each. A screen draws from a [`Ui`] and answers actions with effects; it
//! has no access to the session or the terminal.

mod charts;
pub mod edit;
pub mod figures;
mod frame;
pub mod log;
pub mod models;
mod pane;
pub mod run_form;
pub mod runs;
pub mod scene;
pub mod schedule;
mod status;
pub mod training;
mod workbench;

use frame::row_regions;
pub use frame::{Chrome, HitRegion, HitRegions, draw_frame};

use super::actions::Tab;
use super::input;
use super::view::{RunSummary, Subject, ViewModel};
use super::widgets::preview::Preview;
use super::widgets::theme::Theme;
use mge_results::Composition;
use mge_workbench::FigureKind;

/// The state of the screens.
#[derive(Default)]
pub struct Screens {
    /// Of the Scene and the Edit screen.
    pub scene: scene::Scene,
    /// Of the curves on the Training screen.
    pub curves: charts::CurvesState,
    /// Of those on the Scene screen.
    pub beside: charts::CurvesState,
    /// Of the schedule's editor.
    pub schedule: schedule::Schedule,
    /// Of the list of runs.
    pub runs: runs::Runs,
    /// The selected line of the Models screen.
    pub model: usize,
    /// That of the Figures screen.
    pub figure: usize,
    /// What the figure of learning curves shows, and how, apart from its runs.
    pub composition: Composition,
    /// The name of its file without suffix; empty for the usual one.
    pub file: String,
    /// Which lines the Log screen shows.
    pub log: log::LogState,
    /// The preview on the Figures screen.
    pub preview: Preview,
}

impl Screens {
    /// The state of the curves on a screen, and that of the list of runs.
    pub fn curves_on(&mut self, tab: Tab) -> (&mut charts::CurvesState, &runs::Runs) {
        (if tab == Tab::Scene { &mut self.beside } else { &mut self.curves }, &self.runs)
    }

    /// The runs that actions on a screen apply to: those chosen in the list, or the watched one.
    pub fn acted_on<'a>(&self, ui: &Ui<'a>, tab: Tab) -> Vec<&'a RunSummary> {
        if tab == Tab::Runs { self.runs.acted_on(ui) } else { ui.subject.run().into_iter().collect() }
    }

    /// Selects the line of the list on a screen that `line` returns for the selected and the last one, or the last one.
    pub fn select_line(&mut self, ui: &Ui, tab: Tab, line: impl Fn(usize, usize) -> usize) {
        let line = |now: usize, last: usize| line(now.min(last), last).min(last);
        match tab {
            Tab::Runs => self.runs.select_line(ui, line),
            Tab::Models => self.model = line(self.model, ui.view.models.len().saturating_sub(1)),
            Tab::Figures => self.figure = line(self.figure, FigureKind::ALL.len() - 1),
            Tab::Log => {
                let last = self.log.lines(ui).len().saturating_sub(1);
                // Counted from the end.
                let selected = &self.log.selected;
                selected.set(last - line(last - selected.get().min(last), last));
            }
            Tab::Scene | Tab::Edit | Tab::Schedule | Tab::Training => {}
        }
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
