//! Actions: everything that can be bound to a key. One table of actions and the verbs of the command
//! language are the source of the key map, the hints of the footer, the help, the palette and the
//! manual page.

mod help;
mod tab;
mod table;

pub use help::{KeyHelp, keys};
pub use tab::Tab;

use std::sync::LazyLock;

use crate::workbench::{Verb, verbs};

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
    /// Opens the palette with this verb typed in.
    Type(&'static str),
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

/// An action in a context, with its name, keys and description.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The action.
    pub action: UiAction,
    /// Where it applies.
    pub context: Context,
    /// Name in key files and in the palette.
    pub name: &'static str,
    /// Default keys, separated by spaces.
    pub keys: &'static str,
    /// Word in the footer; empty if it is not shown there.
    pub hint: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// How a script does the same.
    pub script: Script,
}

impl Entry {
    /// The verb that is equivalent to the action, if there is one.
    pub fn verb(&self) -> Option<&'static Verb> {
        match self.script {
            Script::Verb(name) => verbs().find(|verb| verb.name == name),
            Script::Like(_) | Script::Nothing => None,
        }
    }
}

/// All entries, grouped by context; those that can only be typed come last.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let mut entries: Vec<Entry> = Vec::new();
        for &(action, context, name, keys, hint, about, script) in table::ROWS {
            let mut entry = Entry { action, context, name, keys, hint, about, script };
            // A test checks that every verb named in the table exists.
            entry.about = entry.verb().filter(|_| about.is_empty()).map_or(about, |verb| verb.help);
            entries.push(entry);
        }
        for verb in verbs() {
            let script = Script::Verb(verb.name);
            if entries.iter().all(|entry| entry.script != script) {
                // Leaked once, for the lifetime of the program.
                let (action, name) = (UiAction::Type(verb.name), verb.name.replace(' ', "-").leak());
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
    fn every_named_verb_exists_and_every_verb_has_exactly_one_entry() {
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
