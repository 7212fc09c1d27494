//! An action, where it applies, and the verb that does the same.

use super::tab::Tab;

/// An action that a key, the palette or the mouse can trigger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UiAction {
    // Everywhere.
    Train,
    Fork,
    Pause,
    Stop,
    Epsilon,
    EpsilonUp,
    EpsilonDown,
    Clusters,
    Guide,
    Export,
    Method,
    Task,
    Puzzle,
    Model,
    Seed,
    Episodes,
    Undo,
    Redo,
    Save,
    SaveAs,
    Copy,
    Palette,
    Help,
    Screen(Tab),
    NextScreen,
    PreviousScreen,
    Colours,
    Markers,
    Mouse,
    Tour,
    Suspend,
    Back,
    Quit,
    // Scene and Edit.
    PlayPause,
    StepForward,
    StepBack,
    Faster,
    Slower,
    Restart,
    Source,
    PreviousEpisode,
    NextEpisode,
    NextObject,
    PreviousObject,
    Coordinates,
    AddSubgoal,
    AddTool,
    Placeable,
    Properties,
    DeleteObject,
    Grow,
    Shrink,
    Earlier,
    Later,
    Propose,
    AcceptProposals,
    RejectProposals,
    ShowClusters,
    ShowSamples,
    ShowStage,
    ShowCritic,
    ShowActor,
    ShowModel,
    ShowLegend,
    HandPlay,
    HandTool,
    // Moving things: objects, the hand, schedule points, crosshair, rows.
    Left,
    Right,
    Up,
    Down,
    FarLeft,
    FarRight,
    FarUp,
    FarDown,
    First,
    Last,
    Confirm,
    // Curves.
    ZoomIn,
    ZoomOut,
    WholeRange,
    RecentRange,
    Smoothing,
    LogAxis,
    Compare,
    Fold,
    // Schedule.
    NextPoint,
    PreviousPoint,
    AddPoint,
    DeletePoint,
    Kind,
    Discard,
    // Runs.
    Mark,
    Sort,
    Reverse,
    Columns,
    PinBaseline,
    EditNote,
    EditTags,
    Filter,
    Evaluate,
    Continue,
    OpenRun,
    DeleteRun,
    // Models and figures.
    TrainModel,
    EvaluateModel,
    StopModel,
    Vector,
    Pdf,
    Compose,
    Rename,
    /// Opens the palette with this verb typed in.
    Type(&'static str),
}

/// Lines per page of a list.
const PAGE: usize = 10;

impl UiAction {
    /// The line of a list that it selects from the present one; None if it selects none.
    pub fn line(self, now: usize, last: usize) -> Option<usize> {
        let now = now.min(last);
        Some(match self {
            Self::Up => now.saturating_sub(1),
            Self::Down => (now + 1).min(last),
            Self::FarUp => now.saturating_sub(PAGE),
            Self::FarDown => (now + PAGE).min(last),
            Self::First => 0,
            Self::Last => last,
            _ => return None,
        })
    }

    /// The step of a moving action, in two sizes; None for any other action.
    pub fn direction(self, near: f32, far: f32) -> Option<[f32; 2]> {
        Some(match self {
            Self::Left => [-near, 0.0],
            Self::Right => [near, 0.0],
            Self::Up => [0.0, near],
            Self::Down => [0.0, -near],
            Self::FarLeft => [-far, 0.0],
            Self::FarRight => [far, 0.0],
            Self::FarUp => [0.0, far],
            Self::FarDown => [0.0, -far],
            _ => return None,
        })
    }
}

/// Where an action applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Context {
    /// On every screen.
    Everywhere,
    /// Where a scene is shown: the Scene and the Edit screen.
    Scene,
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
    /// The composer of the learning figure, on the Figures screen.
    Compose,
    /// The Models, Figures and Log screens.
    List,
    /// Typed into the palette or a script; no default key.
    Typed,
}

impl Context {
    /// All of them, in the order of the help.
    pub const ALL: [Self; 11] = [
        Self::Everywhere,
        Self::Scene,
        Self::Hand,
        Self::Schedule,
        Self::Curves,
        Self::Runs,
        Self::Models,
        Self::Figures,
        Self::Compose,
        Self::List,
        Self::Typed,
    ];

    /// The screen it belongs to, if it belongs to a single one.
    pub fn tab(self) -> Option<Tab> {
        match self {
            Self::Scene => Some(Tab::Scene),
            Self::Schedule => Some(Tab::Schedule),
            Self::Curves => Some(Tab::Training),
            Self::Runs => Some(Tab::Runs),
            Self::Models => Some(Tab::Models),
            Self::Figures | Self::Compose => Some(Tab::Figures),
            Self::Everywhere | Self::Hand | Self::List | Self::Typed => None,
        }
    }

    /// Heading in the help, and the section's name in a key file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Everywhere => "everywhere",
            Self::Scene => "scene",
            Self::Hand => "hand",
            Self::Schedule => "schedule",
            Self::Curves => "curves",
            Self::Runs => "runs",
            Self::Models => "models",
            Self::Figures => "figures",
            Self::Compose => "compose",
            Self::List => "list",
            Self::Typed => "typed",
        }
    }
}

/// The verb with which a script does the same as an action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Script {
    /// This verb; its help text describes the action unless the table has a description.
    Verb(&'static str),
    /// This verb with suitable arguments. For moving and resizing it is the verb for a subgoal;
    /// the verbs for other objects have the same form.
    Like(&'static str),
    /// None: the action concerns only the screen.
    Nothing,
}
