//! Everything a person can ask for: one table of actions, from which the key map, the hints of
//! the footer, the help, the palette, the verbs of scripts and the manual page come.

mod table;

pub use table::ENTRIES;

/// Something a key, the palette or the mouse can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Action {
    // Everywhere.
    Train,
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
    Screen(u8),
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
    StepOn,
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
    HandPlay,
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
    // Schedule.
    NextPoint,
    PreviousPoint,
    AddPoint,
    DeletePoint,
    Kind,
    Discard,
    // Runs.
    Mark,
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
    /// Begins a command in the palette, to be gone on with by typing.
    Type(&'static str),
}

/// Where an action applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Context {
    /// On every screen.
    Everywhere,
    /// Where a scene is shown: the Scene and the Edit screen.
    Scene,
    /// While a person places tools by hand.
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
    /// The Models, Figures and Log screens.
    List,
    /// Typed into the palette or a script; has no key of its own.
    Typed,
}

impl Context {
    /// All of them, in the order of the help.
    pub const ALL: [Self; 10] = [
        Self::Everywhere,
        Self::Scene,
        Self::Hand,
        Self::Schedule,
        Self::Curves,
        Self::Runs,
        Self::Models,
        Self::Figures,
        Self::List,
        Self::Typed,
    ];

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
            Self::List => "list",
            Self::Typed => "typed",
        }
    }
}

/// A verb of the command language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verb {
    /// The words it begins with.
    pub name: &'static str,
    /// What follows them.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
}

/// How a script does what an action does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Script {
    /// With this verb.
    Verb(Verb),
    /// With the verb of another entry that has this name. Moving and resizing name the verb
    /// for a subgoal: the other objects have verbs of the same form.
    Like(&'static str),
    /// Not at all: it is about the screen.
    Nothing,
}

/// An action in a context, with its name, its keys and what it does.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// What is asked for.
    pub action: Action,
    /// Where.
    pub context: Context,
    /// Name in key files and in the palette.
    pub name: &'static str,
    /// Default keys, separated by spaces.
    pub keys: &'static str,
    /// Word in the footer; empty if it is not shown there.
    pub hint: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// The same in a script.
    pub script: Script,
}

impl Entry {
    /// Name of the verb of the command language that does the same, if there is one.
    pub fn verb(&self) -> Option<&'static str> {
        match self.script {
            Script::Verb(verb) => Some(verb.name),
            Script::Like(name) => Some(name),
            Script::Nothing => None,
        }
    }
}

/// The entry with a name.
pub fn named(name: &str) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.name == name)
}

/// Every verb of the command language.
pub fn verbs() -> impl Iterator<Item = &'static Verb> {
    ENTRIES.iter().filter_map(|entry| match &entry.script {
        Script::Verb(verb) => Some(verb),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_verbs_are_unique_and_every_entry_is_explained() {
        for (index, entry) in ENTRIES.iter().enumerate() {
            let others = &ENTRIES[index + 1..];
            assert!(others.iter().all(|other| other.name != entry.name), "{}", entry.name);
            if let Script::Verb(verb) = entry.script {
                let same = |other: &Entry| matches!(other.script, Script::Verb(other) if other.name == verb.name);
                assert!(!others.iter().any(same), "{}", verb.name);
            }
            assert!(!entry.about.is_empty() && entry.about.len() <= 80, "{}", entry.name);
            assert_eq!(entry.keys.is_empty(), entry.context == Context::Typed, "{}", entry.name);
        }
    }

    #[test]
    fn what_another_entry_scripts_is_a_verb() {
        for entry in ENTRIES {
            if let Script::Like(name) = entry.script {
                assert!(verbs().any(|verb| verb.name == name), "{}: {name}", entry.name);
            }
        }
    }
}
