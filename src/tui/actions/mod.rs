//! Everything a person can ask for with a key: one table of actions, from which, with the verbs
//! of the command language, the key map, the hints of the footer, the help, the palette and the
//! manual page come.

mod help;
mod tab;
mod table;

pub use help::{KeyHelp, keys};
pub use tab::Tab;

use std::sync::LazyLock;

use crate::workbench::{Verb, verbs};

/// Something a key, the palette or the mouse can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Action {
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
    /// The Figures screen while the figure of learning curves is composed.
    Compose,
    /// The Models, Figures and Log screens.
    List,
    /// Typed into the palette or a script; has no key of its own.
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

    /// The screen it belongs to, if it is that of one screen.
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

/// How a script does what an action does, with the name of a verb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Script {
    /// With this verb, which says what the action does.
    Verb(&'static str),
    /// With this verb and the right arguments. Moving and resizing name the verb for a subgoal:
    /// the other objects have verbs of the same form.
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
    /// The verb that it is, if it is one.
    pub fn verb(&self) -> Option<&'static Verb> {
        match self.script {
            Script::Verb(name) => verbs().find(|verb| verb.name == name),
            Script::Like(_) | Script::Nothing => None,
        }
    }
}

/// Every entry, by where it applies; those that are only typed come last.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let mut entries: Vec<Entry> = Vec::new();
        for &(action, context, name, keys, hint, about, script) in table::ROWS {
            let mut entry = Entry { action, context, name, keys, hint, about, script };
            // A test looks for every verb that is named.
            entry.about = entry.verb().map_or(about, |verb| verb.help);
            entries.push(entry);
        }
        for verb in verbs() {
            let script = Script::Verb(verb.name);
            if entries.iter().all(|entry| entry.script != script) {
                // Made once, and kept as long as the program runs.
                let (action, name) = (Action::Type(verb.name), verb.name.replace(' ', "-").leak());
                let context = Context::Typed;
                entries.push(Entry { action, context, name, keys: "", hint: "", about: verb.help, script });
            }
        }
        entries
    });
    &ENTRIES
}

/// The entry with a name.
pub fn named(name: &str) -> Option<&'static Entry> {
    entries().iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_every_entry_is_explained() {
        for (index, entry) in entries().iter().enumerate() {
            let others = &entries()[index + 1..];
            assert!(others.iter().all(|other| other.name != entry.name), "{}", entry.name);
            assert!(!entry.about.is_empty() && entry.about.len() <= 80, "{}", entry.name);
            assert_eq!(entry.keys.is_empty(), entry.context == Context::Typed, "{}", entry.name);
        }
    }

    #[test]
    fn every_verb_that_is_named_exists_and_stands_in_one_entry() {
        for entry in entries() {
            if let Script::Verb(name) | Script::Like(name) = entry.script {
                assert!(verbs().any(|verb| verb.name == name), "{}: {name}", entry.name);
            }
        }
        for verb in verbs() {
            let same = |entry: &&Entry| entry.script == Script::Verb(verb.name);
            assert_eq!(entries().iter().filter(same).count(), 1, "{}", verb.name);
        }
    }
}
