//! The screens of the workbench.

/// A screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Tab {
    /// Scene, curves and status together.
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

    /// Whether it shows a scene.
    pub fn has_scene(self) -> bool {
        matches!(self, Self::Scene | Self::Edit)
    }
}
