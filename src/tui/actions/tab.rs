//! The screens of the workbench.

use serde::{Deserialize, Serialize};

/// A screen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tab {
    /// Scene, curves and status together.
    #[default]
    Scene,
    /// The task being edited.
    Edit,
    /// The epsilon schedule.
    Schedule,
    /// The curves of the training.
    Training,
    /// Past and current runs.
    Runs,
    /// Dynamics models.
    Models,
    /// Figures.
    Figures,
    /// The log.
    Log,
}

impl Tab {
    /// All screens, in the order of their numbers.
    pub const ALL: [Self; 8] =
        [Self::Scene, Self::Edit, Self::Schedule, Self::Training, Self::Runs, Self::Models, Self::Figures, Self::Log];

    /// Title of the tab.
    pub fn title(self) -> &'static str {
        ["Scene", "Edit", "Schedule", "Training", "Runs", "Models", "Figures", "Log"][self as usize]
    }

    /// Whether it shows a scene.
    pub fn has_scene(self) -> bool {
        matches!(self, Self::Scene | Self::Edit)
    }
}
