//! The table of actions with keys.

use super::Context::{
    self, Curves, Edit, Everywhere, Figures, Hand, List, Log, Models, Move, Playback, Runs, Scene, Schedule,
};
use super::Run::{self, Change, Do, Effects, Verb};
use super::Tab;
use crate::tui::app::{App, TerminalRequest};
use crate::tui::chart::Range;
use crate::tui::screens::{edit, figures, models, runs, scene, schedule, training};
use crate::tui::view::XAxis;
use mge_task::Edit::{AcceptProposal, DeleteProposal};

/// An action: its name, default keys, word in the footer, verb in a script, description (empty if it is the help text
/// of the verb), and what it does.
pub(super) type Row = (&'static str, &'static str, &'static str, &'static str, &'static str, Run);

/// Lines per page of a list.
const PAGE: usize = 10;

/// Every action with keys, grouped by context in the order of the help.
#[rustfmt::skip]
pub(super) const ROWS: &[(Context, &[Row])] = &[
    (Everywhere, &[
        ("train", "t", "train", "train", "", Do(App::ask_to_train)),
        ("pause", "p", "pause", "pause", "", Do(|app| app.on_chosen(runs::pause))),
        ("stop", "x", "stop", "stop", "", Do(App::stop)),
        ("quit", "q ctrl-c", "quit", "quit", "", Do(App::quit)),
        ("fork", "F", "", "fork", "", Do(|app| app.on_chosen(runs::fork))),
        ("epsilon", "e", "epsilon", "epsilon", "", Verb),
        ("clusters", "c", "clusters", "clusters", "", Verb),
        ("task", "o", "open task", "task", "", Effects(|_, ui| edit::choose_task(ui))),
        ("undo", "u", "", "undo", "", Do(App::undo)),
        ("redo", "U ctrl-r", "", "redo", "", Verb),
        ("save", "w ctrl-s", "", "save", "", Do(App::save)),
        ("save-as", "W", "", "save", "save the edited task as another file", Do(App::save_as)),
        ("palette", ":", "commands", "", "find an action or type a command; on Runs it acts on the selected run", Do(|app| app.open_palette(""))),
        ("help", "? f1", "help", "", "show all keys", Do(App::show_help)),
        ("screen-scene", "1", "", "", "show the workbench: scene, curves and status", Do(|app| app.show(Tab::Scene))),
        ("screen-edit", "2", "", "", "show the editor of the task", Do(|app| app.show(Tab::Edit))),
        ("screen-schedule", "3", "", "", "show the epsilon schedule", Do(|app| app.show(Tab::Schedule))),
        ("screen-training", "4", "", "", "show the curves of the training", Do(|app| app.show(Tab::Training))),
        ("screen-runs", "5", "", "", "show past and running runs", Do(|app| app.show(Tab::Runs))),
        ("screen-models", "6", "", "", "show the dynamics models", Do(|app| app.show(Tab::Models))),
        ("screen-figures", "7", "", "", "show the figures", Do(|app| app.show(Tab::Figures))),
        ("screen-log", "8", "", "", "show what happened", Do(|app| app.show(Tab::Log))),
        ("theme", "", "", "", "use other colours: for dark and light backgrounds, and for every colour vision", Do(App::change_theme)),
        ("suspend", "ctrl-z", "", "", "go back to the shell; `fg` returns", Do(|app| app.request = Some(TerminalRequest::Suspend))),
        ("back", "esc", "", "", "close the top layer, or leave what is open or selected on the screen", Do(App::back)),
    ]),
    (Scene, &[
        ("next-object", "tab", "select", "", "select the next object: subgoals, goal, balls, boxes, tools", Effects(|s, ui| scene::select_neighbour(&mut s.scene, ui, 1))),
        ("previous-object", "backtab", "", "", "select the previous object", Effects(|s, ui| scene::select_neighbour(&mut s.scene, ui, -1))),
        ("coordinates", "enter", "", "subgoal move", "type the coordinates of the selected object", Effects(edit::type_coordinates)),
        ("restart", "r", "", "", "play the episode from its start", Change(|s, _| s.scene.player.restart())),
        ("show-clusters", "a", "", "", "show or hide the action clusters", Effects(|s, ui| scene::show_clusters(ui, &mut s.scene.chosen.clusters))),
        ("show-samples", "z", "", "", "show or hide the rewarding actions behind the clusters", Effects(|s, ui| scene::show_clusters(ui, &mut s.scene.chosen.samples))),
        ("show-critic", "b", "", "", "show or hide the critic's value of every action in the current state", Change(|s, _| s.scene.chosen.critic ^= true)),
        ("show-actor", "i", "", "", "show or hide where the actor would place the tool now", Change(|s, _| s.scene.chosen.actor ^= true)),
        ("show-model", "g", "", "", "show or hide what the model predicts for the next actions, and what happened", Change(|s, _| s.scene.chosen.model ^= true)),
        ("show-legend", "I", "legend", "", "show or hide the legend of the scene", Change(|s, _| s.scene.chosen.legend ^= true)),
        ("hand-play", "P", "hand play", "", "place tools yourself, or stop doing so", Effects(|s, ui| scene::play_by_hand(&mut s.scene, ui))),
    ]),
    (Edit, &[
        ("accept-proposals", "Y", "accept all", "proposal accept", "accept all proposed subgoals in place of the task's own", Effects(|_, ui| edit::answer_proposals(ui, AcceptProposal { index: None }))),
        ("reject-proposals", "D", "reject all", "proposal delete", "reject all proposed subgoals", Effects(|_, ui| edit::answer_proposals(ui, DeleteProposal { index: None }))),
        ("add-subgoal", "A", "subgoal", "subgoal add", "add a subgoal after the others: the selected proposal, or a new one", Effects(|s, ui| edit::add_subgoal(&s.scene, ui))),
        ("add-tool", "T", "tool", "tool add", "", Effects(|_, ui| edit::choose_tool(ui))),
        ("agent-tool", "B", "", "placeable", "", Effects(|_, _| edit::choose_placeable())),
        ("properties", "E", "properties", "tool set", "", Effects(|s, ui| edit::type_properties(&s.scene, ui))),
        ("delete", "delete X", "", "subgoal delete", "delete the selected subgoal or tool", Effects(edit::delete)),
        ("grow", ")", "", "subgoal size", "make the selected object larger; of a tool, its first property", Effects(|s, ui| edit::resize(s, ui, 1.0))),
        ("shrink", "(", "", "subgoal size", "make the selected object smaller; of a tool, its first property", Effects(|s, ui| edit::resize(s, ui, -1.0))),
        ("earlier", "{", "", "subgoal swap", "the subgoal comes one earlier", Effects(|s, ui| edit::reorder(&s.scene, ui, false))),
        ("later", "}", "", "subgoal swap", "the subgoal comes one later", Effects(|s, ui| edit::reorder(&s.scene, ui, true))),
        ("propose-subgoals", "S", "propose", "propose", "", Verb),
    ]),
    (Playback, &[
        ("play", "space", "play", "", "pause or resume playback", Do(|app| app.play(|player, _| player.toggle()))),
        ("step-on", ".", "", "", "one physics step forward", Do(|app| app.play(|player, steps| player.nudge(1, steps)))),
        ("step-back", ",", "", "", "one physics step back", Do(|app| app.play(|player, steps| player.nudge(-1, steps)))),
        ("faster", ">", "", "", "play faster", Change(|s, _| s.scene.player.change_speed(true))),
        ("slower", "<", "", "", "play slower", Change(|s, _| s.scene.player.change_speed(false))),
        ("previous-episode", "pageup", "", "", "replay the previous episode of the watched run", Effects(|s, ui| scene::replay(&mut s.scene, ui, |now, last| now.map_or(last, |now| now.saturating_sub(1))))),
        ("next-episode", "pagedown", "", "", "replay the next episode of the watched run", Effects(|s, ui| scene::replay(&mut s.scene, ui, |now, _| now.map_or(1, |now| now + 1)))),
        ("first-episode", "home", "", "", "play the first episode of the watched run again", Effects(|s, ui| scene::replay(&mut s.scene, ui, |_, _| 1))),
        ("last-episode", "end", "", "", "play the last episode of the watched run again", Effects(|s, ui| scene::replay(&mut s.scene, ui, |_, last| last))),
    ]),
    (Move, &[
        ("left", "left h", "", "subgoal move", "move the object, tool or point left, or the crosshair to earlier episodes", Do(|app| app.move_by([-1.0, 0.0], false))),
        ("right", "right l", "move", "subgoal move", "move the object, tool or point right, or the crosshair to later episodes", Do(|app| app.move_by([1.0, 0.0], false))),
        ("up", "up k", "", "subgoal move", "move the object, tool or point up, or select the curve above", Do(|app| app.move_by([0.0, 1.0], false))),
        ("down", "down j", "", "subgoal move", "move the object, tool or point down, or select the curve below", Do(|app| app.move_by([0.0, -1.0], false))),
        ("far-left", "shift-left H", "", "subgoal move", "move it far to the left, or show curves of earlier episodes", Do(|app| app.move_by([-1.0, 0.0], true))),
        ("far-right", "shift-right L", "", "subgoal move", "move it far to the right, or show curves of later episodes", Do(|app| app.move_by([1.0, 0.0], true))),
        ("far-up", "shift-up K", "", "subgoal move", "move it far up", Do(|app| app.move_by([0.0, 1.0], true))),
        ("far-down", "shift-down J", "", "subgoal move", "move it far down", Do(|app| app.move_by([0.0, -1.0], true))),
    ]),
    (Hand, &[
        ("hand-place", "enter space", "place", "place", "", Effects(|s, _| scene::place(&s.scene))),
        ("hand-restart", "r", "reset", "reset", "", Verb),
    ]),
    (Schedule, &[
        ("next-point", "tab", "select", "", "select the next point", Change(|s, ui| schedule::select_neighbour(&mut s.schedule, ui, 1))),
        ("previous-point", "backtab", "", "", "select the previous point", Change(|s, ui| schedule::select_neighbour(&mut s.schedule, ui, -1))),
        ("add-point", "a", "add", "", "add a point", Effects(|s, ui| schedule::add_point(&mut s.schedule, ui))),
        ("delete-point", "delete X", "", "", "delete the point", Effects(|s, ui| schedule::delete_point(&mut s.schedule, ui))),
        ("apply", "enter", "apply", "epsilon", "use the schedule, at once or at the training's next episode", Effects(|s, ui| schedule::apply(&s.schedule, ui))),
        ("discard", "backspace", "", "", "go back to the schedule in use", Change(|s, _| s.schedule.discard())),
    ]),
    (Curves, &[
        ("large", "enter", "large", "", "show the selected curve alone, or all of them", Change(|s, _| s.curves.alone ^= true)),
        ("zoom-in", "z", "zoom", "", "show fewer episodes, larger", Change(|s, ui| training::zoom(s.curves_on(Tab::Training), ui, 0.5, None))),
        ("zoom-out", "Z", "", "", "show more episodes", Change(|s, ui| training::zoom(s.curves_on(Tab::Training), ui, 2.0, None))),
        ("whole-range", "0", "", "", "show all episodes", Change(|s, _| s.curves.range = Range::Whole)),
        ("next-axis", "X", "", "", "draw against episodes, actions, charged actions, or the time of training", Change(|s, _| s.curves.axis = XAxis::ALL[(s.curves.axis as usize + 1) % XAxis::ALL.len()])),
        ("more-differences", "+", "", "", "show further settings in which two compared runs differ", Change(|s, _| s.runs.page += 1)),
        ("fold-curves", "tab", "fold", "", "show runs that differ in the seed as one curve with its quartiles, or each", Change(|s, _| s.curves.folded ^= true)),
    ]),
    (Runs, &[
        ("watch-run", "enter", "watch", "open", "watch the selected run", Effects(|s, ui| runs::on_line(&mut s.runs, ui, runs::watch))),
        ("mark-run", "space", "mark", "", "mark the run or group; the next action applies to all marked ones", Effects(|s, ui| runs::on_line(&mut s.runs, ui, runs::mark))),
        ("fold-group", "tab", "fold", "", "show the seeds of the group, or hide them", Effects(|s, ui| runs::on_line(&mut s.runs, ui, runs::fold))),
        ("filter-runs", "/", "filter", "", "show only runs with words or regexes, or like task:4 epsilon<0.2", Effects(|s, ui| runs::ask_for_filter(&s.runs, ui))),
        ("sort-runs", "s", "sort", "", "the run of highest success first, or the latest one", Change(|s, _| s.runs.by_success ^= true)),
        ("choose-columns", "|", "", "", "choose the columns of the list, by the names of columns and settings", Effects(|s, _| runs::ask_for_columns(&s.runs))),
        ("whole-preview", "+", "", "", "show more of the selected run's settings and note, without its curves, or less", Change(|s, _| s.runs.whole ^= true)),
        ("compare-runs", "V", "compare", "", "show the curves of the marked runs, or of the selected group, together", Effects(|s, ui| runs::on_line(&mut s.runs, ui, runs::compare))),
        ("rename-run", "n", "", "rename", "", Do(|app| app.on_chosen(runs::rename))),
        ("edit-note", "i", "", "note", "", Do(|app| app.on_chosen(runs::edit_note))),
        ("evaluate-run", "v", "evaluate", "evaluate", "", Do(|app| app.on_chosen(runs::evaluate))),
        ("continue-run", "C", "continue", "continue", "", Do(|app| app.on_chosen(runs::go_on))),
        ("open-run", "O", "", "open", "", Verb),
        ("delete-run", "delete X", "", "delete", "", Do(|app| app.on_chosen(runs::delete))),
    ]),
    (Models, &[
        ("choose-model", "enter", "choose", "model", "let the selected model predict the rollouts behind the next clusters", Effects(|s, ui| models::choose(s.model, ui))),
        ("train-model", "T", "train a model", "model train", "", Effects(|_, ui| models::train(ui))),
    ]),
    (Figures, &[
        ("export-figure", "enter", "as PNG", "figure", "export the selected figure as PNG", Do(|app| app.export_selected("png"))),
        ("export-svg", "s", "as SVG", "figure", "export the selected figure as SVG", Do(|app| app.export_selected("svg"))),
        ("view-figure", "v", "view", "", "open the exported PNG in the system's viewer", Do(App::view_figure)),
        ("compose", "tab", "compose", "figure", "compose the learning figure of the marked runs", Effects(figures::compose)),
    ]),
    (Log, &[
        ("log-level", "v", "level", "", "show all lines, only what matters, or only warnings and errors", Change(|s, _| s.log.next_level())),
        ("filter-log", "/", "filter", "", "show only lines with words, such as the name of a run", Effects(|s, ui| s.log.ask_for_words(ui))),
    ]),
    (List, &[
        ("above", "up k", "", "", "select the line above", Do(|app| app.select_line(|now, _| now.saturating_sub(1)))),
        ("below", "down j", "", "", "select the line below", Do(|app| app.select_line(|now, _| now + 1))),
        ("page-up", "pageup", "", "", "one page up", Do(|app| app.select_line(|now, _| now.saturating_sub(PAGE)))),
        ("page-down", "pagedown", "", "", "one page down", Do(|app| app.select_line(|now, _| now + PAGE))),
        ("first", "home", "", "", "select the first line", Do(|app| app.select_line(|_, _| 0))),
        ("last", "end", "", "", "select the last line", Do(|app| app.select_line(|_, last| last))),
    ]),
];
