//! Everything a key can do: one table, from which keymap, footer, help and palette come.

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
}

impl Context {
    /// All of them, in the order of the help.
    pub const ALL: [Self; 9] = [
        Self::Everywhere,
        Self::Scene,
        Self::Hand,
        Self::Schedule,
        Self::Curves,
        Self::Runs,
        Self::Models,
        Self::Figures,
        Self::List,
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
        }
    }
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
    /// What it does, in one line.
    pub about: &'static str,
    /// Word in the footer; empty if it is not shown there.
    pub hint: &'static str,
}

const fn entry(
    action: Action,
    context: Context,
    name: &'static str,
    keys: &'static str,
    hint: &'static str,
    about: &'static str,
) -> Entry {
    Entry { action, context, name, keys, about, hint }
}

use Action as A;
use Context::{Curves, Everywhere, Figures, Hand, List, Models, Runs, Scene, Schedule};

/// Every action there is.
#[rustfmt::skip]
pub const ACTIONS: &[Entry] = &[
    entry(A::Train, Everywhere, "train", "t", "train", "start a training with the settings shown"),
    entry(A::Pause, Everywhere, "pause", "p", "pause", "pause the training, or go on with it"),
    entry(A::Stop, Everywhere, "stop", "x", "stop", "end the training; a checkpoint is kept"),
    entry(A::Epsilon, Everywhere, "epsilon", "e", "epsilon", "type an epsilon schedule; a running training takes it at its next episode"),
    entry(A::EpsilonUp, Everywhere, "epsilon-up", "+ =", "", "a constant epsilon, 0.05 higher"),
    entry(A::EpsilonDown, Everywhere, "epsilon-down", "-", "", "a constant epsilon, 0.05 lower"),
    entry(A::Clusters, Everywhere, "clusters", "c", "clusters", "compute the action clusters of the task anew"),
    entry(A::Guide, Everywhere, "guide", "G", "", "give the action clusters to the running training"),
    entry(A::Export, Everywhere, "export", "f", "export", "export the figures of the session as PNG"),
    entry(A::Method, Everywhere, "method", "m", "", "choose the method of the next run"),
    entry(A::Task, Everywhere, "task", "o", "open", "open a shipped task or a task file"),
    entry(A::Model, Everywhere, "model", "d", "", "choose what predicts the rollouts behind the clusters"),
    entry(A::Seed, Everywhere, "seed", "n", "", "type the master seed of the next run"),
    entry(A::Episodes, Everywhere, "episodes", "N", "", "type the number of episodes of the next run"),
    entry(A::Undo, Everywhere, "undo", "u", "", "take the latest edit back"),
    entry(A::Redo, Everywhere, "redo", "U ctrl-r", "", "make the undone edit again"),
    entry(A::Save, Everywhere, "save", "w ctrl-s", "", "save the edited task"),
    entry(A::SaveAs, Everywhere, "save-as", "W", "", "save the edited task as another file"),
    entry(A::Copy, Everywhere, "copy", "y", "", "copy the command line of the next run to the clipboard"),
    entry(A::Palette, Everywhere, "palette", ":", "commands", "find an action by name, or type a command"),
    entry(A::Help, Everywhere, "help", "? f1", "help", "show all keys"),
    entry(A::Screen(0), Everywhere, "screen-scene", "1", "", "show the workbench: scene, curves and status"),
    entry(A::Screen(1), Everywhere, "screen-edit", "2", "", "show the editor of the task"),
    entry(A::Screen(2), Everywhere, "screen-schedule", "3", "", "show the epsilon schedule"),
    entry(A::Screen(3), Everywhere, "screen-training", "4", "", "show the curves of the training"),
    entry(A::Screen(4), Everywhere, "screen-runs", "5", "", "show past and running runs"),
    entry(A::Screen(5), Everywhere, "screen-models", "6", "", "show the dynamics models"),
    entry(A::Screen(6), Everywhere, "screen-figures", "7", "", "show the figures"),
    entry(A::Screen(7), Everywhere, "screen-log", "8", "", "show what happened"),
    entry(A::NextScreen, Everywhere, "next-screen", "]", "", "show the next screen"),
    entry(A::PreviousScreen, Everywhere, "previous-screen", "[", "", "show the screen before"),
    entry(A::Colours, Everywhere, "colours", "f2", "", "next colours: dark, light, colour-blind"),
    entry(A::Markers, Everywhere, "markers", "f3", "", "next markers: braille, half blocks, plain text"),
    entry(A::Mouse, Everywhere, "mouse", "f4", "", "switch mouse capture, to select text with the mouse"),
    entry(A::Tour, Everywhere, "tour", "f5", "", "show the short tour again"),
    entry(A::Suspend, Everywhere, "suspend", "ctrl-z", "", "go back to the shell; `fg` returns"),
    entry(A::Back, Everywhere, "back", "esc", "", "leave one layer, or let go of what is selected"),
    entry(A::Quit, Everywhere, "quit", "q ctrl-c", "quit", "leave the workbench"),

    entry(A::NextObject, Scene, "next-object", "tab", "select", "select the next object: ball, subgoals, goal, tools"),
    entry(A::PreviousObject, Scene, "previous-object", "backtab", "", "select the object before"),
    entry(A::Left, Scene, "move-left", "left h", "", "move the selected object left by 0.01"),
    entry(A::Right, Scene, "move-right", "right l", "move", "move the selected object right by 0.01"),
    entry(A::Up, Scene, "move-up", "up k", "", "move the selected object up by 0.01"),
    entry(A::Down, Scene, "move-down", "down j", "", "move the selected object down by 0.01"),
    entry(A::FarLeft, Scene, "move-far-left", "shift-left H", "", "move the selected object left by 0.1"),
    entry(A::FarRight, Scene, "move-far-right", "shift-right L", "", "move the selected object right by 0.1"),
    entry(A::FarUp, Scene, "move-far-up", "shift-up K", "", "move the selected object up by 0.1"),
    entry(A::FarDown, Scene, "move-far-down", "shift-down J", "", "move the selected object down by 0.1"),
    entry(A::Coordinates, Scene, "coordinates", "enter", "", "type the coordinates of the selected object"),
    entry(A::AddSubgoal, Scene, "add-subgoal", "A", "", "add a subgoal after the others"),
    entry(A::AddTool, Scene, "add-tool", "T", "", "add a static tool to the scene"),
    entry(A::DeleteObject, Scene, "delete", "delete X", "", "delete the selected subgoal or tool"),
    entry(A::Grow, Scene, "grow", ")", "", "make the selected object larger"),
    entry(A::Shrink, Scene, "shrink", "(", "", "make the selected object smaller"),
    entry(A::Earlier, Scene, "earlier", "{", "", "the selected subgoal comes one earlier"),
    entry(A::Later, Scene, "later", "}", "", "the selected subgoal comes one later"),
    entry(A::Propose, Scene, "propose-subgoals", "S", "", "let the model propose subgoals, in the background"),
    entry(A::AcceptProposals, Scene, "accept-proposals", "Y", "", "accept the selected proposal, or all in place of the task's subgoals"),
    entry(A::RejectProposals, Scene, "reject-proposals", "D", "", "reject the selected proposal, or all of them"),
    entry(A::PlayPause, Scene, "play", "space", "play", "stop or continue the ball"),
    entry(A::StepOn, Scene, "step-on", ".", "", "one physics step on"),
    entry(A::StepBack, Scene, "step-back", ",", "", "one physics step back"),
    entry(A::Faster, Scene, "faster", ">", "", "play faster"),
    entry(A::Slower, Scene, "slower", "<", "", "play slower"),
    entry(A::Restart, Scene, "restart", "r", "", "play the episode from its start"),
    entry(A::Source, Scene, "source", "s", "", "show the latest training episode, or the scene untouched; leaves the past"),
    entry(A::PreviousEpisode, Scene, "previous-episode", "pageup", "", "play the episode before again, from the past of the watched run"),
    entry(A::NextEpisode, Scene, "next-episode", "pagedown", "", "play the next episode of the watched run's past"),
    entry(A::First, Scene, "first-episode", "home", "", "play the first episode of the watched run again"),
    entry(A::Last, Scene, "last-episode", "end", "", "play the last episode of the watched run again"),
    entry(A::ShowClusters, Scene, "show-clusters", "a", "", "show or hide the action clusters"),
    entry(A::ShowSamples, Scene, "show-samples", "z", "", "show or hide the rewarding actions behind the clusters"),
    entry(A::ShowStage, Scene, "show-stage", "v", "", "show the clusters of all stages, or of one after the other"),
    entry(A::ShowCritic, Scene, "show-critic", "b", "", "show or hide what the critic thinks of every action now"),
    entry(A::ShowActor, Scene, "show-actor", "i", "", "show or hide where the actor would place the tool now"),
    entry(A::ShowModel, Scene, "show-model", "g", "", "show or hide what the model predicts for the next actions, and what happened"),
    entry(A::HandPlay, Scene, "hand-play", "P", "hand play", "place tools yourself, or stop doing so"),

    entry(A::Left, Hand, "hand-left", "left h", "", "move the tool left by 0.02"),
    entry(A::Right, Hand, "hand-right", "right l", "move", "move the tool right by 0.02"),
    entry(A::Up, Hand, "hand-up", "up k", "", "move the tool up by 0.02"),
    entry(A::Down, Hand, "hand-down", "down j", "", "move the tool down by 0.02"),
    entry(A::FarLeft, Hand, "hand-far-left", "shift-left H", "", "move the tool left by 0.1"),
    entry(A::FarRight, Hand, "hand-far-right", "shift-right L", "", "move the tool right by 0.1"),
    entry(A::FarUp, Hand, "hand-far-up", "shift-up K", "", "move the tool up by 0.1"),
    entry(A::FarDown, Hand, "hand-far-down", "shift-down J", "", "move the tool down by 0.1"),
    entry(A::Confirm, Hand, "hand-place", "enter space", "place", "place the tool and let the world run for one action"),
    entry(A::Restart, Hand, "hand-restart", "r", "again", "start the episode again"),

    entry(A::NextPoint, Schedule, "next-point", "tab", "select", "select the next point"),
    entry(A::PreviousPoint, Schedule, "previous-point", "backtab", "", "select the point before"),
    entry(A::Left, Schedule, "point-left", "left h", "", "move the point to an earlier episode"),
    entry(A::Right, Schedule, "point-right", "right l", "move", "move the point to a later episode"),
    entry(A::Up, Schedule, "point-up", "up k", "", "a higher threshold by 0.01"),
    entry(A::Down, Schedule, "point-down", "down j", "", "a lower threshold by 0.01"),
    entry(A::FarLeft, Schedule, "point-far-left", "shift-left H", "", "move the point to a much earlier episode"),
    entry(A::FarRight, Schedule, "point-far-right", "shift-right L", "", "move the point to a much later episode"),
    entry(A::FarUp, Schedule, "point-far-up", "shift-up K", "", "a higher threshold by 0.1"),
    entry(A::FarDown, Schedule, "point-far-down", "shift-down J", "", "a lower threshold by 0.1"),
    entry(A::AddPoint, Schedule, "add-point", "a", "add", "add a point; the schedule becomes hand-drawn"),
    entry(A::DeletePoint, Schedule, "delete-point", "delete X", "", "delete the point"),
    entry(A::Kind, Schedule, "kind", "v", "kind", "next kind: constant, linear, exponential, step, hand-drawn"),
    entry(A::Confirm, Schedule, "apply", "enter", "apply", "use the schedule, at once or at the training's next episode"),
    entry(A::Discard, Schedule, "discard", "backspace", "", "go back to the schedule in use"),

    entry(A::Up, Curves, "curve-above", "up k", "", "select the curve above"),
    entry(A::Down, Curves, "curve-below", "down j", "curve", "select the curve below"),
    entry(A::Confirm, Curves, "large", "enter", "large", "show the selected curve alone, or all of them"),
    entry(A::Left, Curves, "crosshair-left", "left h", "", "move the crosshair to earlier episodes"),
    entry(A::Right, Curves, "crosshair-right", "right l", "crosshair", "move the crosshair to later episodes"),
    entry(A::FarLeft, Curves, "pan-left", "shift-left H", "", "show earlier episodes"),
    entry(A::FarRight, Curves, "pan-right", "shift-right L", "", "show later episodes"),
    entry(A::ZoomIn, Curves, "zoom-in", "z", "zoom", "show fewer episodes, larger"),
    entry(A::ZoomOut, Curves, "zoom-out", "Z", "", "show more episodes"),
    entry(A::WholeRange, Curves, "whole-range", "0", "", "show all episodes"),
    entry(A::RecentRange, Curves, "recent-range", "9", "", "show the latest episodes"),
    entry(A::Smoothing, Curves, "smoothing", "s", "smooth", "average over 1, 10, 50 or 200 episodes"),
    entry(A::LogAxis, Curves, "log-axis", "g", "", "a logarithmic axis for the selected curve, or a linear one"),
    entry(A::Compare, Curves, "compare", "v", "compare", "show the marked runs over one another"),

    entry(A::Up, Runs, "run-above", "up k", "", "select the run above"),
    entry(A::Down, Runs, "run-below", "down j", "", "select the run below"),
    entry(A::First, Runs, "first-run", "home", "", "select the first run"),
    entry(A::Last, Runs, "last-run", "end", "", "select the last run"),
    entry(A::Confirm, Runs, "watch-run", "enter", "watch", "watch the selected run"),
    entry(A::Mark, Runs, "mark-run", "space", "mark", "mark the run for comparing"),
    entry(A::Filter, Runs, "filter-runs", "/", "filter", "show only runs with a text in their line"),
    entry(A::Evaluate, Runs, "evaluate-run", "v", "evaluate", "play the greedy policy of the watched run"),
    entry(A::Continue, Runs, "continue-run", "C", "continue", "go on with the selected run from its checkpoint"),
    entry(A::OpenRun, Runs, "open-run", "O", "", "open a run that is on disk"),
    entry(A::DeleteRun, Runs, "delete-run", "delete X", "", "delete the selected run from the disk, after a question"),

    entry(A::Confirm, Models, "choose-model", "enter", "choose", "let the selected model predict the rollouts behind the next clusters"),
    entry(A::TrainModel, Models, "train-model", "T", "train a model", "train another dynamics model, in the background"),
    entry(A::EvaluateModel, Models, "evaluate-model", "v", "evaluate", "measure the selected model on fresh launches and unseen scenes"),
    entry(A::StopModel, Models, "stop-model", "X", "", "end the training or evaluation of a model"),
    entry(A::Confirm, Figures, "export-figure", "enter", "as PNG", "export the selected figure as PNG, the episode as GIF"),
    entry(A::Vector, Figures, "export-svg", "s", "as SVG", "export the selected figure as SVG"),

    entry(A::Up, List, "above", "up k", "", "select the line above"),
    entry(A::Down, List, "below", "down j", "", "select the line below"),
    entry(A::FarUp, List, "page-up", "pageup", "", "one page up"),
    entry(A::FarDown, List, "page-down", "pagedown", "", "one page down"),
    entry(A::First, List, "first", "home", "", "select the first line"),
    entry(A::Last, List, "last", "end", "", "select the last line"),
];

impl Entry {
    /// The verb of the command language that does the same in a script; None for what only
    /// a screen can do. Moving and resizing name the verb for a subgoal: the other objects
    /// have verbs of the same form.
    pub fn verb(&self) -> Option<&'static str> {
        Some(match (self.action, self.context) {
            (A::Train, _) => "train",
            (A::Pause, _) => "pause",
            (A::Stop, _) => "stop",
            (A::Epsilon | A::EpsilonUp | A::EpsilonDown, _) | (A::Confirm, Schedule) => "epsilon",
            (A::Clusters, _) => "clusters",
            (A::Guide, _) => "guide",
            (A::Export, _) | (A::Confirm | A::Vector, Figures) => "figure",
            (A::Method, _) => "method",
            (A::Task, _) => "task",
            (A::Model, _) | (A::Confirm, Models) => "model",
            (A::Seed, _) => "seed",
            (A::Episodes, _) => "episodes",
            (A::Undo, _) => "undo",
            (A::Redo, _) => "redo",
            (A::Save | A::SaveAs, _) => "save",
            (A::Quit, _) => "quit",
            (A::Left | A::Right | A::Up | A::Down | A::Coordinates, Scene)
            | (A::FarLeft | A::FarRight | A::FarUp | A::FarDown, Scene) => "subgoal move",
            (A::Grow | A::Shrink, _) => "subgoal size",
            (A::Earlier | A::Later, _) => "subgoal swap",
            (A::AddSubgoal, _) => "subgoal add",
            (A::AddTool, _) => "tool add",
            (A::DeleteObject, _) => "subgoal delete",
            (A::Propose, _) => "propose",
            (A::AcceptProposals, _) => "proposal accept",
            (A::RejectProposals, _) => "proposal delete",
            (A::Confirm, Hand) => "place",
            (A::Restart, Hand) => "reset",
            (A::Confirm | A::OpenRun, Runs) => "open",
            (A::Evaluate, _) => "evaluate",
            (A::Continue, _) => "continue",
            (A::DeleteRun, _) => "delete",
            (A::TrainModel, _) => "model train",
            (A::EvaluateModel, _) => "model evaluate",
            (A::StopModel, _) => "model stop",
            _ => return None,
        })
    }
}

/// The entry with a name.
pub fn named(name: &str) -> Option<&'static Entry> {
    ACTIONS.iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::VERBS;

    /// Verbs that an action gives for another object, or for a run in another state.
    const SAME_KEYS: [&str; 9] = [
        "goal move",
        "goal size",
        "ball move",
        "tool move",
        "tool size",
        "tool delete",
        "proposal move",
        "proposal size",
        "resume",
    ];
    /// Verbs that the palette takes typed, and that no key has.
    const TYPED: [&str; 6] = ["set", "out", "watch", "wait", "expect", "record"];

    #[test]
    fn every_verb_of_scripts_has_its_action_and_every_action_a_verb_that_exists() {
        let of_actions: Vec<&str> = ACTIONS.iter().filter_map(Entry::verb).collect();
        for verb in VERBS {
            let ways = [of_actions.contains(&verb.name), SAME_KEYS.contains(&verb.name), TYPED.contains(&verb.name)];
            assert_eq!(ways.iter().filter(|way| **way).count(), 1, "{}", verb.name);
        }
        for verb in of_actions {
            assert!(VERBS.iter().any(|known| known.name == verb), "{verb}");
        }
    }
}
