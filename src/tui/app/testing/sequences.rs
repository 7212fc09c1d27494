//! This state, these keys, that state.

use crossterm::event::{Event, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::layout::Rect;

use super::{RecordingWorkspace, app, change_run, empty, failed, grouped, press, shot, text, typical, watch};
use crate::run::RunState;
use crate::task;
use crate::tui::actions::Tab;
use crate::tui::app::{App, Leaving, TerminalRequest};
use crate::tui::chart::Range;
use crate::tui::scene::{Object, View};
use crate::tui::screens::Region;
use crate::tui::view::{Level, ViewModel};
use crate::tui::widgets::theme::{Depth, Marker, Palette, Theme};

/// From a state, after these keys, the workspace was asked this and the screen shows that.
fn check(view: ViewModel, keys: &str, asked: &[&str], shown: &str) {
    let (mut app, log) = app(view);
    shot(&mut app, 120, 40);
    press(&mut app, keys);
    assert_eq!(*log.borrow(), asked, "after {keys}");
    // What depends on where things are drawn is known after the first picture.
    shot(&mut app, 120, 40);
    app.tick(std::time::Duration::ZERO);
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains(shown), "after {keys}, `{shown}` is not on\n{screen}");
}

pub(super) fn mouse(app: &mut App, kind: MouseEventKind, (column, row): (u16, u16)) {
    app.event(Event::Mouse(MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE }));
}

/// The first region for which there is something.
pub(super) fn region<T>(app: &App, find: impl Fn(Rect, Region) -> Option<T>) -> T {
    app.regions.all().iter().find_map(|(area, region)| find(*area, *region)).unwrap()
}

pub(super) fn scene(app: &App) -> View {
    region(app, |_, region| if let Region::Scene(view) = region { Some(view) } else { None })
}

fn tab(app: &App, wanted: Tab) -> Rect {
    region(app, |area, region| matches!(region, Region::Tab(tab) if tab == wanted).then_some(area))
}

fn cell(app: &mut App, position: [f32; 2]) -> (u16, u16) {
    shot(app, 120, 40);
    scene(app).cell(position).unwrap()
}

#[test]
fn training_is_started_paused_resumed_and_stopped() {
    check(empty(), "t", &["train"], "");
    check(typical(), "p", &["pause"], "");
    let paused = || {
        let mut view = typical();
        change_run(&mut view, 1, |run| run.state = RunState::Paused);
        view
    };
    check(paused(), "p", &["resume"], "paused");
    check(paused(), "t", &["train"], "paused");
    check(typical(), "x", &[], "stop the training?");
    check(typical(), "x y", &["stop"], "running");
    check(typical(), "x esc", &[], "running");
}

#[test]
fn epsilon_is_changed_by_key_prompt_and_palette() {
    check(empty(), "+", &["epsilon 0.85"], "");
    check(empty(), "e ctrl-u 0 . 3 enter", &["epsilon 0.3"], "");
    check(empty(), "e ctrl-u 7 enter", &[], "7 is not within 0 and 1");
    check(empty(), "e ctrl-u 7 enter esc", &[], "status");
    check(empty(), ": e p s i l o n space 0 . 5 enter", &["epsilon 0.5"], "");
}

#[test]
fn the_schedule_is_drawn_and_applied() {
    check(empty(), "3", &[], "This schedule is in use");
    check(empty(), "3 up", &[], "linear:0.81:0.05:1500");
    check(empty(), "3 up backspace", &[], "This schedule is in use");
    check(empty(), "3 tab K enter", &["epsilon linear:0.8:0.15:1500"], "");
    check(empty(), "3 a enter", &["epsilon points:0=0.8,750=0.425,1500=0.05"], "");
    check(empty(), "3 v v v v enter", &["epsilon need:0.8:0.2:20"], "");
    check(empty(), "3 v v v v v enter", &["epsilon 0.8"], "");
}

#[test]
fn a_subgoal_is_moved_with_keys() {
    check(empty(), "tab right", &["subgoal move 1 0.01 0.2"], "subgoal 1");
    check(empty(), "tab K", &["subgoal move 1 0 0.3"], "subgoal 1");
    check(empty(), "tab tab L", &["goal move -0.5 -0.2"], "goal");
    check(empty(), "tab enter ctrl-u 0 . 1 space 0 . 2 enter", &["subgoal move 1 0.1 0.2"], "");
    check(empty(), "tab enter ctrl-u x enter", &[], "not a coordinate");
    check(empty(), "right", &[], "nothing is selected");
    check(empty(), "A", &["subgoal add -0.3 0 4"], "");
    check(empty(), "tab )", &["subgoal size 1 4.5"], "");
    check(empty(), "tab delete", &["subgoal delete 1"], "");
    check(empty(), "tab tab delete", &[], "needs its ball and its goal");
    check(empty(), "tab }", &[], "it is the last one");
    check(typical(), "u U", &["undo", "redo"], "");
}

#[test]
fn subgoals_are_proposed_moved_accepted_and_rejected() {
    check(empty(), "2 S enter", &["propose 1"], "");
    check(empty(), "2 S ctrl-u 3 enter", &["propose 3"], "");
    check(empty(), "2 S ctrl-u x enter", &[], "is not a number of subgoals");
    check(empty(), "2 Y", &[], "nothing is proposed: S lets");
    check(typical(), "2", &[], "proposed: 1; Y accepts, D rejects");
    check(typical(), "2 tab tab right", &["proposal move 1 -0.19 0.5"], "proposal 1");
    check(typical(), "2 tab tab )", &["proposal size 1 4.5"], "");
    check(typical(), "2 tab tab Y", &["proposal accept 1"], "");
    check(typical(), "2 tab tab delete", &["proposal delete 1"], "");
    check(typical(), "2 Y", &["proposal accept"], "");
    check(typical(), "2 D", &["proposal delete"], "");
    let mut view = typical();
    view.proposing = Some((1, 3));
    check(view, "2", &[], "looking for subgoal 2 of 3");
    let (mut app, _) = app(typical());
    let at = cell(&mut app, [-0.2, 0.5]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert_eq!(app.screens.scene.selected(), Some(Object::Proposal(0)));
}

#[test]
fn a_subgoal_is_dragged_with_the_mouse() {
    let (mut app, asked) = app(empty());
    let from = cell(&mut app, [0.0, 0.2]);
    let to = cell(&mut app, [0.5, -0.5]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), from);
    assert_eq!(app.screens.scene.selected(), Some(Object::Subgoal(0)));
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    let screen = shot(&mut app, 120, 40);
    assert_eq!(screen[to].symbol(), "1", "the subgoal is shown where the mouse is");
    assert!(asked.borrow().is_empty());
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), to);
    let [x, y] = scene(&app).nearest(to.0, to.1);
    let line = asked.borrow()[0].clone();
    let numbers: Vec<f32> = line.trim_start_matches("subgoal move 1 ").split(' ').map(|n| n.parse().unwrap()).collect();
    assert!((numbers[0] - x).abs() < 0.001 && (numbers[1] - y).abs() < 0.001, "{line}");
}

#[test]
fn only_what_was_taken_hold_of_is_dragged() {
    let (down, drag, up) = (
        MouseEventKind::Down(MouseButton::Left),
        MouseEventKind::Drag(MouseButton::Left),
        MouseEventKind::Up(MouseButton::Left),
    );
    let jitter = |app: &mut App, at: (u16, u16)| {
        for (kind, at) in [(down, at), (drag, (at.0 + 1, at.1)), (up, (at.0 + 1, at.1))] {
            mouse(app, kind, at);
        }
    };
    let (mut app, asked) = app(empty());
    press(&mut app, "2 tab");
    shot(&mut app, 120, 40);
    let rows = region(&app, |area, region| matches!(region, Region::Row(0)).then_some(area));
    jitter(&mut app, (rows.x, rows.y));
    assert_eq!(app.screens.scene.selected(), Some(Object::Subgoal(0)));
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    let tab = tab(&app, Tab::Schedule);
    jitter(&mut app, (tab.x, tab.y));
    assert!(!app.screens.schedule.is_edited());
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
}

#[test]
fn the_selected_run_stays_selected_when_others_come() {
    let (mut app, _) = app(typical());
    press(&mut app, "5 down");
    let (mut other, asked) = super::app({
        let mut view = typical();
        view.runs.push(std::sync::Arc::new(super::run_summary("new")));
        view
    });
    other.screens.runs = std::mem::take(&mut app.screens.runs);
    other.tab = Tab::Runs;
    press(&mut other, "C");
    assert_eq!(*asked.borrow(), ["continue runs/old"]);
}

#[test]
fn tools_are_placed_by_hand() {
    check(empty(), "P", &[], "free");
    check(empty(), "P right enter", &["place 0.27 0.4"], "");
    check(empty(), "P space r", &["place 0.25 0.4", "reset"], "");
    check(empty(), "P esc space", &[], "no tool placed");
    check(empty(), "P", &[], "hand play: move the tool, enter or a click places it");
    check(empty(), "P P", &[], "no tool placed");
    let (mut app, asked) = app(empty());
    press(&mut app, "P");
    let at = cell(&mut app, [0.5, 0.5]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert!(asked.borrow()[0].starts_with("place 0.5"), "{:?}", asked.borrow());
}

#[test]
fn clusters_are_computed_shown_and_given_to_the_training() {
    check(empty(), "c", &["clusters"], "");
    check(typical(), "G", &["guide"], "");
    check(typical(), "v", &[], "clusters of subgoal 1");
    check(typical(), "v v", &[], "clusters of the goal");
    check(empty(), "a", &[], "c computes them");
    check(empty(), "b", &[], "t trains one");
}

#[test]
fn stale_clusters_are_grey_and_say_so() {
    let mut view = typical();
    view.prior_state = crate::workbench::PriorState::Stale;
    let (mut app, _) = app(view);
    let at = cell(&mut app, [0.4, 0.5]);
    let screen = shot(&mut app, 120, 40);
    assert_eq!(screen[at].fg, app.theme.dim);
    assert!(text(&screen).contains("out of date; c computes them"));
}

#[test]
fn screens_are_changed_by_number_bracket_and_mouse() {
    let (mut app, _) = app(typical());
    for (keys, tab) in [
        ("4", Tab::Training),
        ("]", Tab::Runs),
        ("[ [", Tab::Schedule),
        ("1", Tab::Scene),
        ("[", Tab::Log),
        ("esc", Tab::Scene),
    ] {
        press(&mut app, keys);
        assert_eq!(app.tab, tab, "after {keys}");
    }
    shot(&mut app, 120, 40);
    let area = tab(&app, Tab::Figures);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (area.x + 1, area.y));
    assert_eq!(app.tab, Tab::Figures);
}

#[test]
fn curves_are_read_zoomed_and_compared() {
    check(typical(), "4", &[], "critic loss, mean of 10, log");
    check(typical(), "4 left left", &[], "episode 693");
    check(typical(), "4 j j j g", &[], "critic loss, mean of 10  ");
    check(typical(), "4 s", &[], "mean of 50");
    check(typical(), "4 enter", &[], "success rate");
    check(typical(), "4 v", &[], "training · 2 runs");
    check(empty(), "4 v", &[], "There is nothing to compare.");
    check(typical(), "5 space 4 v", &[], "training · task1-ddpg-mge-seed0");
    let (mut app, _) = app(typical());
    press(&mut app, "4 z z");
    let window = app.screens.curves.range.window(700);
    assert!(window.to - window.from < 200.0, "{window:?}");
    press(&mut app, "0");
    assert_eq!(app.screens.curves.range.window(700).from, 1.0);
}

#[test]
fn the_crosshair_follows_the_mouse_and_the_wheel_zooms() {
    let (mut app, _) = app(typical());
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let Region::Chart(axes, _) = region { Some(axes) } else { None });
    let at = (axes.plot.x + axes.plot.width / 2, axes.plot.y + 1);
    mouse(&mut app, MouseEventKind::Moved, at);
    assert!((app.screens.curves.hovered.unwrap() - 350.0).abs() < 20.0);
    assert_eq!(app.subject.past_episode(), None, "the mouse only reads values off");
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    let pressed = app.subject.past_episode().unwrap();
    assert!(pressed.abs_diff(350) < 20, "{pressed}");
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), (at.0 + 4, at.1));
    let dragged = app.subject.past_episode().unwrap();
    assert!(dragged > pressed && app.screens.curves.crosshair == Some(dragged as f32));
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (at.0 + 4, at.1));
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    let window = app.screens.curves.range.window(700);
    assert!(window.from > 100.0 && window.to < 600.0, "{window:?}");
}

#[test]
fn the_crosshair_moves_the_scene_and_the_scene_the_crosshair() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 left left");
    assert_eq!((app.subject.past_episode(), app.screens.curves.crosshair), (Some(693), Some(693.0)));
    let screen = text(&shot(&mut app, 120, 40));
    assert!(
        screen.contains("task1 · episode 693 of task1-ddpg-mge-seed0") && screen.contains("epsilon 0.54"),
        "{screen}"
    );
    app.screens.scene.player.seek(50);
    press(&mut app, "left");
    assert_eq!((app.subject.past_episode(), app.screens.scene.player.step()), (Some(686), 50), "the time stays");
    press(&mut app, "pageup");
    assert_eq!(app.screens.curves.crosshair, Some(685.0));
    press(&mut app, "1 pagedown");
    assert_eq!(app.screens.curves.crosshair, Some(686.0));
    press(&mut app, "4 esc");
    assert_eq!((app.subject.past_episode(), app.screens.curves.crosshair), (Some(686), None), "the curves first");
    press(&mut app, "esc");
    assert_eq!(app.subject.past_episode(), None);
}

#[test]
fn runs_are_watched_filtered_continued_and_evaluated() {
    check(typical(), "5 down enter", &["open runs/old"], "");
    check(typical(), "5 down C", &["continue runs/old"], "");
    check(typical(), "5 v", &["open runs/task1-ddpg-mge-seed0", "evaluate"], "");
    check(typical(), "5 / o l d enter", &[], "with `old`");
    check(typical(), "5 / n o p e enter", &[], "No run has this text");
    check(typical(), "5 / n o p e enter esc", &[], "running");
    check(empty(), "5", &[], "There are no runs in this folder yet");
}

#[test]
fn settings_are_chosen_and_typed() {
    check(empty(), "m up enter", &["method ddpg"], "");
    check(empty(), "m", &[], "DDPG, uniform exploration");
    check(empty(), "n ctrl-u 7 enter", &["seed 7"], "");
    check(empty(), "N ctrl-u 5 0 enter", &["episodes 50"], "");
    check(empty(), "o down enter", &["task task2"], "");
    check(empty(), "d down enter", &["model true"], "");
    check(empty(), "6 down enter", &["model true"], "");
    check(empty(), "n ctrl-u x enter", &[], "usage: seed N");
}

#[test]
fn the_palette_finds_actions_and_layers_are_left_one_by_one() {
    check(empty(), ": c l u s t e r s enter", &["clusters"], "");
    check(empty(), ": ? esc", &[], "status");
    check(empty(), "?", &[], "SCENE");
    check(empty(), "? esc", &[], "status");
    check(empty(), "f5", &[], "welcome, 1/4");
    check(empty(), "f5 enter enter enter enter", &[], "status");
    check(empty(), ": q u a r r e l space 7 enter", &[], "unknown command `quarrel 7`");
}

#[test]
fn leaving_asks_only_if_something_would_be_lost() {
    let leaving = |view: ViewModel, keys: &str| {
        let (mut app, _) = app(view);
        press(&mut app, keys);
        app.is_leaving()
    };
    assert!(leaving(empty(), "q"));
    assert!(leaving(failed(), "q"));
    assert!(!leaving(typical(), "q"));
    assert!(!leaving(typical(), "q esc"));
    assert!(leaving(typical(), "q y"));
    assert!(leaving(empty(), "e ctrl-c"), "from within a layer, too");
    check(typical(), "q", &[], "y   keep a checkpoint, stop and leave");
    check(empty(), "3 up q", &[], "The schedule you have drawn is not in use");
}

#[test]
fn leaving_can_wait_until_all_runs_are_done() {
    let mut view = typical();
    view.dirty = false;
    check(view.clone(), "q w", &[], "leaving when all runs are done");
    let (mut busy, _) = app(view.clone());
    press(&mut busy, "q w");
    assert_eq!(busy.leaving, Leaving::WhenIdle);
    press(&mut busy, "q esc");
    assert_eq!(busy.leaving, Leaving::No, "the latest answer counts");
    change_run(&mut view, 1, |run| (run.active, run.state) = (false, RunState::Finished));
    let (mut idle, _) = app(view);
    idle.leaving = Leaving::WhenIdle;
    idle.tick(std::time::Duration::ZERO);
    assert!(idle.is_leaving());
    let (mut edited, _) = app(failed());
    press(&mut edited, "3 up");
    edited.leaving = Leaving::WhenIdle;
    edited.tick(std::time::Duration::ZERO);
    assert!(!edited.is_leaving() && !edited.layers.is_empty(), "what is not saved is asked about");
}

#[test]
fn saving_asks_before_another_file_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("there.json");
    std::fs::write(&path, "precious").unwrap();
    let (mut app, asked) = app(typical());
    press(&mut app, "w ctrl-u");
    app.event(Event::Paste(path.display().to_string()));
    press(&mut app, "enter");
    assert!(asked.borrow().is_empty());
    assert!(text(&shot(&mut app, 120, 40)).contains("overwrite the file?"));
    press(&mut app, "esc");
    assert!(asked.borrow().is_empty() && app.layers.is_empty());
    press(&mut app, "w ctrl-u");
    app.event(Event::Paste(path.display().to_string()));
    press(&mut app, "enter y");
    assert_eq!(asked.borrow().len(), 1);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious", "the session writes, not the screen");
    press(&mut app, ":");
    app.event(Event::Paste(format!("record {}", path.display())));
    press(&mut app, "enter");
    assert!(text(&shot(&mut app, 120, 40)).contains("overwrite the file?"), "typed commands ask, too");
}

#[test]
fn the_terminal_is_asked_for_what_only_it_can_do() {
    let (mut app, _) = app(empty());
    press(&mut app, "y");
    let Some(TerminalRequest::Copy(text)) = app.take_request() else { panic!("nothing is asked for") };
    assert_eq!(text, "mge train task1 --out runs/copy --epsilon linear:0.8:0.05:1500 --set 'ddpg.gamma=0.9'");
    press(&mut app, "f4");
    assert_eq!(app.take_request(), Some(TerminalRequest::Mouse(false)));
    press(&mut app, "ctrl-z");
    assert_eq!(app.take_request(), Some(TerminalRequest::Suspend));
}

#[test]
fn without_colour_and_braille_everything_is_still_there() {
    let (mut app, _) = app(typical());
    app.theme = Theme::new(Palette::Dark, Depth::None, Marker::Ascii);
    for tab in Tab::ALL {
        app.tab = tab;
        let screen = shot(&mut app, 120, 40);
        let odd: String = screen.content.iter().map(|cell| cell.symbol()).filter(|s| !s.is_ascii()).collect();
        assert_eq!(odd, "", "{tab:?}");
        let colours = screen.content.iter().any(|cell| cell.fg != ratatui::style::Color::Reset);
        assert!(!colours, "{tab:?} has colours");
    }
}

#[test]
fn a_run_is_deleted_after_a_question() {
    check(typical(), "5 down X", &[], "runs/old and everything in it is deleted");
    check(typical(), "5 down X esc", &[], "running");
    check(typical(), "5 down delete y", &["delete runs/old"], "");
}

#[test]
fn the_past_of_a_run_is_played_episode_by_episode() {
    check(typical(), "pageup", &[], "episode 700 of 700");
    check(typical(), "pageup pageup", &[], "episode 699 of 700");
    check(typical(), "home", &[], "episode 1 of 700");
    check(typical(), "home pagedown", &[], "episode 2 of 700");
    check(typical(), "home s", &[], "no tool placed");
    check(typical(), "home esc", &[], "no tool placed");
    check(empty(), "pageup", &[], "no run with episodes is being watched");
}

#[test]
fn models_are_chosen_measured_and_trained() {
    check(empty(), "6 v", &[], "select the shipped model itself");
    check(empty(), "6 end enter", &["model true"], "");
    check(empty(), "6 T enter", &["model train box,bucket models/box-bucket.safetensors"], "");
    check(empty(), "6 T ctrl-u x space y enter", &[], "usage: model train");
    check(empty(), "6 X", &["model stop"], "");
    let mut view = empty();
    view.model_work = Some(("training models/mine.safetensors".into(), Some(0.5)));
    check(view.clone(), "6", &[], "training models/mine.safetensors 50 %");
    check(view, "q", &[], "training models/mine.safetensors ends");
}

#[test]
fn figures_are_looked_at_and_exported() {
    check(empty(), "7 down", &[], "there is nothing for the clusters figure in tests");
    check(empty(), "7 enter", &["figure scene figures/task1-scene.png"], "");
    check(empty(), "7 s", &["figure scene figures/task1-scene.svg"], "");
    check(empty(), "7 D", &["figure scene figures/task1-scene.pdf"], "");
    check(empty(), "7 end enter", &["figure episode figures/task1-episode.gif"], "");
    let name = "figures/task1-ddpg-mge-seed0-dashboard.png";
    check(typical(), "7 end up enter", &[&format!("figure dashboard {name}")], "");
}

#[test]
fn a_queued_run_says_so_and_leaving_tells_of_all_runs() {
    let mut view = typical();
    change_run(&mut view, 0, |run| run.queued = true);
    check(view.clone(), "5", &[], "queued");
    check(view.clone(), "q", &[], "old waits for a core");
    check(view, "q", &[], "task1-ddpg-mge-seed0 is being trained, 700 of 2000");
}

#[test]
fn another_task_is_not_opened_over_unsaved_edits_without_a_question() {
    check(typical(), "o down enter", &[], "lose the edits?");
    check(typical(), "o down enter y", &["task task2"], "");
    check(typical(), ": t a s k space t a s k 2 enter esc", &[], "(edited)");
}

#[test]
fn a_schedule_is_drawn_with_the_mouse() {
    let mut view = empty();
    view.settings.epsilon = "points:0=0.8,1500=0.1".parse().unwrap();
    let (mut app, asked) = app(view);
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let Region::Schedule(axes) = region { Some(axes) } else { None });
    let at = (axes.plot.x + axes.plot.width / 2, axes.plot.y + 2);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), (at.0, at.1 + 3));
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (at.0, at.1 + 3));
    press(&mut app, "enter");
    let line = asked.borrow()[0].clone();
    let drawn = line.strip_prefix("epsilon points:0=0.8,").unwrap().strip_suffix(",1500=0.1").unwrap();
    let (episode, value) = drawn.split_once('=').unwrap();
    assert!((episode.parse::<f32>().unwrap() - 1000.0).abs() < 30.0, "{line}");
    assert!((value.parse::<f32>().unwrap() - axes.y_at(at.1 + 3)).abs() < 0.01, "{line}");
}

#[test]
fn layers_and_hints_take_the_mouse() {
    let click = MouseEventKind::Down(MouseButton::Left);
    let (mut app, asked) = app(empty());
    press(&mut app, "o");
    let find = |app: &mut App, what: &str| {
        let screen = text(&shot(app, 120, 40));
        let row = screen.lines().count() - 1 - screen.lines().rev().position(|line| line.contains(what)).unwrap();
        let line = screen.lines().nth(row).unwrap();
        (line[..line.find(what).unwrap()].chars().count() as u16, row as u16)
    };
    let at = find(&mut app, "task3");
    mouse(&mut app, click, at);
    assert_eq!(*asked.borrow(), ["task task3"]);
    let at = find(&mut app, "t train");
    mouse(&mut app, click, at);
    assert_eq!(asked.borrow().last().unwrap(), "train");
    press(&mut app, ":");
    mouse(&mut app, MouseEventKind::ScrollDown, (60, 20));
    let at = find(&mut app, "epsilon-up");
    mouse(&mut app, click, at);
    assert!(app.layers.is_empty());
    assert_eq!(asked.borrow().last().unwrap(), "epsilon 0.85");
}

#[test]
fn a_question_is_answered_with_the_mouse() {
    let click = MouseEventKind::Down(MouseButton::Left);
    let (mut app, asked) = app(typical());
    press(&mut app, "x");
    let screen = text(&shot(&mut app, 120, 40));
    let row = screen.lines().position(|line| line.contains("stop it")).unwrap() as u16;
    mouse(&mut app, click, (60, row + 1));
    assert!(asked.borrow().is_empty() && app.layers.is_empty(), "the way back");
    press(&mut app, "x");
    shot(&mut app, 120, 40);
    mouse(&mut app, click, (60, row));
    assert_eq!(*asked.borrow(), ["stop"]);
}

#[test]
fn the_selection_goes_to_the_neighbour_and_round() {
    check(empty(), "tab tab tab backtab right", &["goal move -0.59 -0.2"], "");
    check(empty(), "tab backtab backtab tab tab right", &["subgoal move 1 0.01 0.2"], "");
    let last = empty().task.tools.len();
    check(empty(), "backtab delete", &[&format!("tool delete {last}")], "");
    let mut models = empty();
    models.models.push(crate::tui::view::ModelSummary { name: "box".into(), about: "another".into() });
    check(models.clone(), "6 down enter", &["model true"], "");
    check(models.clone(), "6 down down up enter", &["model true"], "");
    check(models, "6 end enter", &["model box"], "");
    let mut runs = typical();
    runs.runs.insert(0, std::sync::Arc::new(super::run_summary("oldest")));
    check(runs.clone(), "5 down enter", &["open runs/old"], "");
    check(runs.clone(), "5 end up enter", &["open runs/old"], "");
    check(runs, "5 end enter", &["open runs/oldest"], "");
    check(empty(), "o down enter", &["task task2"], "");
    check(empty(), "d down up enter", &["model learned"], "");
}

#[test]
fn a_subgoal_that_changes_places_stays_selected() {
    let mut view = empty();
    let mut task = crate::task::Task::clone(&view.task);
    task.subgoals.push(task::Region { position: [0.4, 0.4], radius: 4.0 });
    view.task = std::sync::Arc::new(task);
    check(view.clone(), "tab } right", &["subgoal swap 1 2", "subgoal move 2 0.41 0.4"], "");
    check(view, "tab tab { right", &["subgoal swap 2 1", "subgoal move 1 0.01 0.2"], "");
    check(empty(), "tab {", &[], "it is the first one");
}

#[test]
fn what_is_done_is_done_with_all_that_are_marked_after_one_question() {
    check(typical(), "5 down space", &[], "1 marked");
    check(typical(), "5 down space up space", &[], "2 marked");
    check(typical(), "5 down space space", &[], "runs in runs");
    check(typical(), "5 down space space 4 v", &[], "training · 2 runs");
    check(typical(), "5 down space up space 4 v", &[], "training · 2 runs");
    let both = ["task1-ddpg-mge-seed0", "old"];
    check(typical(), "5 space down space X", &[], "2 runs and everything in it is deleted");
    let delete = ["delete runs/old", "delete runs/task1-ddpg-mge-seed0"];
    check(typical(), "5 space down space X y", &delete, "");
    let go_on = ["continue runs/old", "continue runs/task1-ddpg-mge-seed0"];
    check(typical(), "5 space down space C", &go_on, "");
    check(typical(), "5 space down space p", &["pause"], "");
    check(typical(), "5 space down space x", &[], "stop the training?");
    check(typical(), "5 space down space x y", &["stop"], "");
    let mut view = typical();
    change_run(&mut view, 0, |run| run.state = RunState::Paused);
    let stop = ["open runs/old", "stop", "open runs/task1-ddpg-mge-seed0", "stop"];
    check(view.clone(), "5 space down space x y", &stop, "");
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    let resume = ["open runs/old", "resume", "open runs/task1-ddpg-mge-seed0", "resume"];
    check(view, "5 space down space p", &resume, "");
    let drawn = both.map(|run| [format!("open runs/{run}"), format!("figure dashboard figures/{run}-dashboard.png")]);
    let mut asked: Vec<&str> = drawn.iter().rev().flatten().map(String::as_str).collect();
    asked.push("open runs/task1-ddpg-mge-seed0");
    check(typical(), "5 space down space f", &asked, "drawing the dashboards of 2 runs");
    check(typical(), "5 space V", &[], "training · task1-ddpg-mge-seed0");
}

#[test]
fn runs_that_differ_in_the_seed_only_are_one_line_that_unfolds() {
    check(grouped(), "5", &[], "DDPG-MGE, eps.. (3 seeds)");
    check(grouped(), "5 down", &[], " DDPG-MGE, epsilon 0.8 to 0.05 (3 seeds) ");
    check(grouped(), "5", &[], "3 finished");
    check(grouped(), "5 down tab", &[], "guided-1");
    check(grouped(), "5 tab tab / n o p e enter", &[], "No run has this text");
    check(grouped(), "5 enter", &["open runs/plain-0"], "");
    check(grouped(), "5 down enter", &["open runs/guided-0"], "");
    check(grouped(), "5 down B", &["pin DDPG-MGE, epsilon 0.8 to 0.05"], "");
    let delete = ["delete runs/guided-0", "delete runs/guided-1", "delete runs/guided-2"];
    check(grouped(), "5 down X y", &delete, "");
    check(grouped(), "5 / s e e d = 1 enter enter", &["open runs/plain-1"], "with `seed=1`");
    check(grouped(), "5 / m e t h o d : d d p g - m g e enter enter", &["open runs/guided-0"], "");
    check(grouped(), "5 / e p s i l o < 1 enter", &[], "did you mean `epsilon`?");
    check(grouped(), "5 s s s s enter", &["open runs/guided-0"], "by success");
    check(grouped(), "5 s s s s S enter", &["open runs/plain-0"], "by success, reversed");
    check(grouped(), "4", &[], "3 seeds");
    check(grouped(), "4 tab", &[], "training · 3 runs");
    check(grouped(), "4 v", &[], "training · 2 groups");
    check(grouped(), "5 down V", &[], "training · DDPG-MGE, epsilon 0.8 to 0.05 (3 seeds)");
}

#[test]
fn several_seeds_are_trained_with_one_key() {
    check(empty(), "4 t enter", &["train seeds 1"], "");
    check(empty(), "4 t 0 enter", &["train seeds 10"], "");
    check(empty(), "4 t backspace 0 enter", &[], "`0` is not a number of seeds from 1 to 1000");
}

#[test]
fn notes_and_tags_are_written_where_the_run_is() {
    check(grouped(), "5 tab down i f i n e enter", &["note runs/plain-0 fine"], "");
    let tag = ["tag runs/plain-0 a,b", "tag runs/plain-1 a,b", "tag runs/plain-2 a,b"];
    check(grouped(), "5 I a , b enter", &tag, "");
    let mut view = grouped();
    change_run(&mut view, 0, |run| (run.tags, run.note) = (vec!["paper".into()], "holds".into()));
    check(view, "5 / t a g : p a p e r enter enter", &["open runs/guided-0"], "");
}

#[test]
fn points_of_the_schedule_are_gone_through_in_both_directions() {
    check(empty(), "3 backtab K enter", &["epsilon linear:0.8:0.15:1500"], "");
    check(empty(), "3 tab backtab J enter", &["epsilon linear:0.7:0.05:1500"], "");
    check(empty(), "3 tab tab J enter", &["epsilon linear:0.7:0.05:1500"], "");
    check(empty(), "3 tab a enter", &["epsilon points:0=0.8,1500=0.05,2000=0.05"], "");
    let mut three = empty();
    three.settings.epsilon = "points:0=0.8,1000=0.4,1500=0".parse().unwrap();
    check(three, "3 tab backtab J enter", &["epsilon points:0=0.7,1000=0.4,1500=0"], "");
    check(empty(), "3 delete", &[], "only a hand-drawn schedule has points to delete");
}

#[test]
fn a_schedule_that_is_in_use_is_no_draft() {
    let (mut app, asked) = app(empty());
    press(&mut app, "3 up enter");
    assert_eq!(*asked.borrow(), ["epsilon linear:0.81:0.05:1500"]);
    assert!(!app.screens.schedule.is_edited());
    press(&mut app, "q");
    assert!(app.is_leaving(), "nothing is lost");
}

#[test]
fn a_list_of_ten_thousand_runs_is_drawn_where_it_is_looked_at() {
    let mut view = empty();
    let names = (0..10_000).map(|number| format!("run-{number:05}"));
    view.runs = names.map(|name| std::sync::Arc::new(super::run_summary(&name))).collect();
    view.runs_unread = 12;
    check(view.clone(), "5", &[], "12 more are being read");
    check(view.clone(), "5 down down enter", &["open runs/run-09997"], "run-09997");
    check(view.clone(), "5 end enter", &["open runs/run-00000"], "run-00000");
    check(view, "5 / 0 4 2 1 1 enter enter", &["open runs/run-04211"], "with `04211`");
}

#[test]
fn a_part_that_is_missing_says_why() {
    check(typical(), "g", &[], "there is no training episode yet: t trains one");
    check(typical(), "pageup b", &[], "no critic or actor: the checkpoint is being read");
    let mut view = typical();
    view.watched = None;
    check(view, "pageup", &[], "no run with episodes is being watched");
}

#[test]
fn while_an_episode_is_played_only_the_scene_is_drawn_anew() {
    let (mut app, _) = app(typical());
    app.screens.scene.player.playing = true;
    let first = shot(&mut app, 120, 40);
    assert!(!app.is_changed(), "nothing has moved");
    app.tick(std::time::Duration::from_millis(40));
    assert!(app.is_changed() && !app.changed);
    let moved = shot(&mut app, 120, 40);
    app.changed = true;
    assert_eq!(moved, shot(&mut app, 120, 40), "the whole picture is the same");
    assert_ne!(first, moved);
    // Another size needs a whole picture.
    app.tick(std::time::Duration::from_millis(40));
    assert!(text(&shot(&mut app, 80, 24)).contains("? help"));
}

#[test]
fn on_the_runs_screen_the_selected_run_is_paused_and_stopped() {
    check(typical(), "5 down p", &["open runs/old", "pause"], "");
    check(typical(), "5 down x", &["open runs/old", "stop"], "");
    check(typical(), "5 x", &[], "stop the training?");
    check(typical(), "5 p", &["pause"], "");
}

#[test]
fn undo_takes_back_what_was_drawn_of_a_schedule_and_no_edit_of_the_task() {
    check(empty(), "3 up up u", &[], "linear:0.81:0.05:1500");
    check(empty(), "3 up u", &[], "This schedule is in use.");
    check(empty(), "3 up u u", &[], "nothing is drawn that could be undone");
    check(empty(), "3 up backspace u", &[], "nothing is drawn that could be undone");
    check(empty(), "3 tab up tab u", &[], "This schedule is in use.");
    check(empty(), "2 u", &["undo"], "");
}

#[test]
fn a_window_of_one_run_is_not_that_of_another() {
    let (mut app, asked) = app(typical());
    press(&mut app, "4 z left");
    assert!(matches!(app.screens.curves.range, Range::Part(_)));
    let mut view = typical();
    watch(&mut view, 0);
    app.workspace = Box::new(RecordingWorkspace { view, asked });
    app.choose_subject(None, false);
    assert_eq!((app.screens.curves.range, app.screens.curves.crosshair), (Range::Whole, None));
}

#[test]
fn a_run_without_episodes_says_what_it_waits_for() {
    let without = |queued: bool, active: bool| {
        let mut view = typical();
        change_run(&mut view, 1, |run| {
            (run.queued, run.active, run.done, run.curves) = (queued, active, 0, std::sync::Arc::default());
        });
        view
    };
    check(without(true, false), "4", &[], "waiting for a free core");
    check(without(false, true), "4", &[], "the first episode is going on");
    check(without(false, false), "4", &[], "it ended before its first episode");
}

#[test]
fn a_long_message_is_whole_and_leaves_the_keys_in_sight() {
    let (mut app, _) = app(typical());
    app.say(Level::Error, format!("{}conclusion", "a long reason ".repeat(10)));
    let screen = text(&shot(&mut app, 80, 24));
    assert!(screen.contains("conclusion") && screen.contains("? help"), "{screen}");
    app.screens.scene.player.playing = true;
    app.tick(std::time::Duration::from_millis(40));
    assert!(text(&shot(&mut app, 80, 24)).contains("conclusion"), "also while an episode is played");
}

#[test]
fn names_of_screens_are_whole_from_eighty_columns_on_and_stay_where_they_are() {
    let (mut app, _) = app(typical());
    let first = text(&shot(&mut app, 80, 24));
    press(&mut app, "7");
    let other = text(&shot(&mut app, 80, 24));
    let tabs = |screen: &str| screen.lines().next().unwrap().to_owned();
    assert!(tabs(&first).contains("3 Schedule  4 Training") && tabs(&first).ends_with('*'), "{first}");
    assert_eq!(tabs(&first), tabs(&other));
}

#[test]
fn the_scene_is_held_at_its_start_while_it_is_edited() {
    let (mut app, _) = app(typical());
    app.screens.scene.player.playing = true;
    app.tick(std::time::Duration::from_millis(400));
    assert!(app.screens.scene.player.step() > 0);
    press(&mut app, "2");
    app.tick(std::time::Duration::from_millis(400));
    assert_eq!(app.screens.scene.player.step(), 0);
    press(&mut app, "space");
    app.tick(std::time::Duration::from_millis(400));
    assert!(app.screens.scene.player.step() > 0, "unless one lets it go");
}

#[test]
fn the_legend_is_switched() {
    check(typical(), "I", &[], "proposed subgoals");
    let (mut app, _) = app(typical());
    press(&mut app, "I I");
    assert!(!text(&shot(&mut app, 120, 40)).contains("proposed subgoals"));
}

#[test]
fn a_tool_in_hand_says_why_it_cannot_be_placed() {
    let mut view = empty();
    view.task = view.hand.task.clone();
    check(view, "P J J J J J J J J J J J J", &[], "it would touch something");
}

#[test]
fn the_help_finds_what_one_types() {
    check(empty(), "? z o o m", &[], "show fewer episodes, larger");
    let (mut app, _) = app(empty());
    press(&mut app, "? z o o m");
    assert!(!text(&shot(&mut app, 120, 40)).contains("SCENE"));
    press(&mut app, "backspace backspace backspace backspace");
    assert!(text(&shot(&mut app, 120, 40)).contains("SCENE"));
    press(&mut app, "?");
    assert!(app.layers.is_empty());
}

#[test]
fn what_is_trained_can_go_on_in_the_background() {
    let (mut app, _) = app(typical());
    press(&mut app, "q");
    assert!(text(&shot(&mut app, 120, 40)).contains("leave it training in the background"));
    press(&mut app, "b");
    assert!(app.is_leaving());
    assert_eq!(app.left_in_background(), [std::path::PathBuf::from("runs/task1-ddpg-mge-seed0")]);
    let (mut app, _) = super::app(typical());
    press(&mut app, "q y");
    assert!(app.is_leaving() && app.left_in_background().is_empty());
}

#[test]
fn the_end_of_the_last_training_is_announced() {
    let (mut app, asked) = app(typical());
    let mut view = typical();
    change_run(&mut view, 1, |run| (run.state, run.active) = (RunState::Finished, false));
    app.tick(std::time::Duration::ZERO);
    assert_eq!(app.take_request(), None);
    app.workspace = Box::new(RecordingWorkspace { view, asked });
    app.was_busy = true;
    app.tick(std::time::Duration::ZERO);
    assert!(matches!(app.take_request(), Some(TerminalRequest::Notify(_))));
    app.tick(std::time::Duration::ZERO);
    assert_eq!(app.take_request(), None, "once");
}

/// Keys that move between screens, episodes, curves, runs, and what is laid over them.
const WALK: &str = "1 2 3 4 5 6 7 8 left right up down pageup pagedown home end space enter esc tab s v b i g a P r u \
                    z Z 0 9 p x y n V B C X f / o : ? . , I";

#[test]
fn what_is_shown_belongs_together_on_any_walk_through_the_screens() {
    use rand::seq::SliceRandom;
    use rand::{Rng, SeedableRng};

    let keys: Vec<&str> = WALK.split_whitespace().collect();
    for seed in 0..6 {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let view = [typical, grouped, failed, empty][seed as usize % 4]();
        let (mut app, _) = app(view);
        let mut walked = Vec::new();
        for step in 0..300 {
            let key = *keys.choose(&mut rng).unwrap();
            walked.push(key);
            press(&mut app, key);
            if step % 10 == 0 {
                shot(&mut app, 120, 40);
                mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (rng.gen_range(0..120), rng.gen_range(0..40)));
                mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (0, 0));
            }
            if app.is_leaving() {
                break;
            }
            let subject = &app.subject;
            let context = || format!("seed {seed}, after {}", walked.join(" "));
            assert!(subject.episode().task == *subject.task(), "{}", context());
            let clusters = subject.clusters().map(|clusters| clusters.prior.stages.len());
            assert!(clusters.is_none_or(|stages| stages == subject.task().stage_count()), "{}", context());
            if let Some(episode) = subject.past_episode() {
                let is_of_watched = subject.run().is_some_and(|run| subject.episode().is_of(&run.path));
                assert!(is_of_watched, "{}", context());
                let crosshair = app.screens.curves.crosshair;
                assert!(crosshair.is_none_or(|at| at == episode as f32), "{crosshair:?} {episode}: {}", context());
            }
        }
    }
}
