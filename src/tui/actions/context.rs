//! The screens of the workbench, and where actions apply.

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

/// Where an action applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Context {
    /// On every screen.
    Everywhere,
    /// Where a scene is shown: the Scene and the Edit screen.
    Scene,
    /// Where the task is changed: the Edit and the Scene screen.
    Edit,
    /// Where an episode is played: with a scene, and beside the curves.
    Playback,
    /// Where something can be moved in two directions: with a scene, a schedule or curves.
    Move,
    /// In hand play, where a person places the tools.
    Hand,
    /// The Schedule screen.
    Schedule,
    /// The Training screen.
    Curves,
    /// The Runs screen.
    Runs,
    /// The Models screen.
    Models,
    /// The Figures screen.
    Figures,
    /// The Log screen.
    Log,
    /// The Runs, Models, Figures and Log screens.
    List,
    /// Typed into the palette or a script; no default key.
    Typed,
}

/// The contexts of hand play, on the Scene and the Edit screen, the innermost first.
pub const HAND: &[Context] = &[Context::Hand, Context::Move, Context::Playback, Context::Scene];

impl Tab {
    /// The contexts of the screen without hand play, the innermost first.
    pub fn contexts(self) -> &'static [Context] {
        match self {
            Self::Scene => &[Context::Move, Context::Playback, Context::Scene],
            Self::Edit => &[Context::Edit, Context::Move, Context::Scene, Context::Playback],
            Self::Schedule => &[Context::Move, Context::Schedule],
            Self::Training => &[Context::Move, Context::Playback, Context::Curves],
            Self::Runs => &[Context::Runs, Context::List],
            Self::Models => &[Context::Models, Context::List],
            Self::Figures => &[Context::Figures, Context::List],
            Self::Log => &[Context::Log, Context::List],
        }
    }
}

impl Context {
    /// The screen it belongs to, or the first of several; none if it belongs to all.
    pub fn tab(self) -> Option<Tab> {
        Tab::ALL.into_iter().find(|tab| tab.contexts().contains(&self) || HAND.contains(&self))
    }

    /// Heading in the help and in the manual.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}
