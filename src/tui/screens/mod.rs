//! The screens and what each of them remembers.

pub mod edit;
pub mod figures;
pub mod lists;
pub mod log;
pub mod models;
pub mod runs;
pub mod scene;
pub mod schedule;
mod status;
pub mod training;
mod workbench;

mod frame;

pub use frame::{draw, shortened};
pub use lists::Lists;
pub use runs::Runs;
pub use scene::Scene;
pub use schedule::Schedule;
pub use training::Curves;

use ratatui::layout::Rect;

use super::chart::Axes;
use super::metric::Metric;
use super::scene::View;
use crate::tui::actions::Action;

/// A screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tab {
    /// Scene, curves and status together.
    Scene,
    /// The task being edited.
    Edit,
    /// The epsilon schedule.
    Schedule,
    /// The curves of the training.
    Training,
    /// Past and running runs.
    Runs,
    /// Dynamics models.
    Models,
    /// Figures.
    Figures,
    /// What happened.
    Log,
}

impl Tab {
    /// All screens, in the order of their numbers.
    pub const ALL: [Self; 8] =
        [Self::Scene, Self::Edit, Self::Schedule, Self::Training, Self::Runs, Self::Models, Self::Figures, Self::Log];

    /// Title of the tab.
    pub fn title(self) -> &'static str {
        match self {
            Self::Scene => "Scene",
            Self::Edit => "Edit",
            Self::Schedule => "Schedule",
            Self::Training => "Training",
            Self::Runs => "Runs",
            Self::Models => "Models",
            Self::Figures => "Figures",
            Self::Log => "Log",
        }
    }

    /// The screen after it.
    pub fn next(self) -> Self {
        Self::ALL[(self as usize + 1) % Self::ALL.len()]
    }

    /// The screen before it.
    pub fn previous(self) -> Self {
        Self::ALL[(self as usize + Self::ALL.len() - 1) % Self::ALL.len()]
    }

    /// Whether a scene is shown on it.
    pub fn has_scene(self) -> bool {
        matches!(self, Self::Scene | Self::Edit)
    }
}

/// Where things were drawn, so that the mouse finds them.
#[derive(Debug, Default)]
pub struct Hits {
    /// The tabs.
    pub tabs: Vec<(Rect, Tab)>,
    /// The hints in the last line and what they ask for.
    pub hints: Vec<(Rect, Action)>,
    /// The scene.
    pub scene: Option<View>,
    /// Curves.
    pub charts: Vec<(Axes, Metric)>,
    /// The schedule's plot.
    pub schedule: Option<Axes>,
    /// Where the figure is shown.
    pub preview: Option<Rect>,
    /// Rows of a list and the index of the first.
    pub rows: Option<(Rect, usize)>,
}
