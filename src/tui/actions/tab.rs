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

// In the order of their numbers, with the titles of the tabs.
mge_base::names!(Tab {
    Scene = "Scene", Edit = "Edit", Schedule = "Schedule", Training = "Training",
    Runs = "Runs", Models = "Models", Figures = "Figures", Log = "Log"
});
