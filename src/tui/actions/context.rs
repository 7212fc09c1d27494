//! Where actions apply.

use super::Tab;

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

impl Context {
    /// The screen it belongs to, or the first of several; none if it belongs to all.
    pub fn tab(self) -> Option<Tab> {
        match self {
            Self::Scene | Self::Playback | Self::Move | Self::Hand => Some(Tab::Scene),
            Self::Edit => Some(Tab::Edit),
            Self::Schedule => Some(Tab::Schedule),
            Self::Curves => Some(Tab::Training),
            Self::Runs | Self::List => Some(Tab::Runs),
            Self::Models => Some(Tab::Models),
            Self::Figures => Some(Tab::Figures),
            Self::Log => Some(Tab::Log),
            Self::Everywhere | Self::Typed => None,
        }
    }

    /// Heading in the help and in the manual.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}
