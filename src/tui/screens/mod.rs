//! The screens: what each remembers, how it is drawn, and what an action does on it. A screen gets
//! what it draws and answers with effects; it knows neither the session nor the terminal.

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

pub use frame::{Chrome, Notice, beside_scene, draw_frame, draw_scene};
pub use regions::{HitRegions, Region};

use super::input::Keymap;
use super::view::{Subject, ViewModel};
use super::widgets::preview::Preview;
use super::widgets::theme::Theme;

/// What screens draw from.
#[derive(Clone, Copy)]
pub struct Ui<'a> {
    /// Everything there is to see.
    pub view: &'a ViewModel,
    /// What the scene shows.
    pub subject: &'a Subject,
    /// Keys, to be named in texts.
    pub keymap: &'a Keymap,
    /// Colours and markers.
    pub theme: &'a Theme,
}

impl Ui<'_> {
    /// A text in which `{name}` stands for the key of an action.
    pub fn text(&self, text: &str) -> String {
        self.keymap.fill(text)
    }
}

/// What the screens remember.
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
    /// The figure that is shown on the Figures screen.
    pub preview: Preview,
}
