//! The scene and the editor of the task, by keys and mouse.

use super::*;
use mge_workbench::Command;

#[test]
fn what_was_selected_is_not_selected_in_another_task() {
    let (mut app, _) = app(empty());
    press(&mut app, "2 tab");
    assert!(app.screens.scene.selected().is_some());
    press(&mut app, ": t a s k space t a s k 2 enter");
    assert_eq!(app.screens.scene.selected(), None);
}

#[test]
fn a_subgoal_is_moved_with_keys() {
    check(empty(), "tab right", &["subgoal move 1 0.01 0.2"], "subgoal 1");
    check(empty(), "tab K", &["subgoal move 1 0 0.3"], "subgoal 1");
    check(empty(), "tab H", &["subgoal move 1 -0.1 0.2"], "subgoal 1");
    check(empty(), "tab tab L", &["goal move -0.5 -0.2"], "goal");
    check(empty(), "tab enter ctrl-w ctrl-w 0 . 1 space 0 . 2 enter", &["subgoal move 1 0.1 0.2"], "");
    check(empty(), "tab enter ctrl-w x enter", &[], "is not a coordinate");
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
    check(empty(), "2 S", &["propose"], "");
    check(empty(), "2 Y", &[], "nothing is proposed: S lets");
    check(typical(), "2", &[], "proposed: 1; Y accepts all");
    check(typical(), "2 tab tab right", &["proposal move 1 -0.19 0.5"], "proposal 1");
    check(typical(), "2 tab tab )", &["proposal size 1 4.5"], "");
    check(typical(), "2 tab tab A", &["proposal accept 1"], "");
    check(typical(), "2 tab tab Y", &["proposal accept"], "");
    check(typical(), "2", &[], "Y accept all  D reject all  A subgoal");
    check(empty(), "2", &[], "\nA subgoal");
    check(typical(), "2 tab tab delete", &["proposal delete 1"], "");
    check(typical(), "2 Y", &["proposal accept"], "");
    check(typical(), "2 D", &["proposal delete"], "");
    let mut view = typical();
    view.proposing = Some((1, 3));
    check(view, "2", &[], "looking for subgoals, proposal 2 of 3");
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
    assert_eq!(app.screens.scene.selected(), Some(Object::Part(task::Part::Subgoal(0))));
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
fn only_a_grabbed_object_is_dragged() {
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
    let rows = region(&app, |area, region| matches!(region, HitRegion::Row(0)).then_some(area));
    jitter(&mut app, (rows.x, rows.y));
    assert_eq!(app.screens.scene.selected(), Some(Object::Part(task::Part::Subgoal(0))));
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    let tab = tab(&app, Tab::Schedule);
    jitter(&mut app, (tab.x, tab.y));
    assert!(!app.screens.schedule.is_edited());
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
}

#[test]
fn tools_are_placed_by_hand() {
    check(empty(), "P", &[], "free");
    check(empty(), "P right enter", &["place 0.27 0.4"], "");
    check(empty(), "P space r", &["place 0.25 0.4", "reset"], "");
    check(empty(), "P esc space", &[], "no tool placed");
    check(empty(), "P", &[], "hand play: move the tool, enter or a click places it");
    check(empty(), ": p l a c e space 0 space 0 enter", &["place 0 0"], "task1 · played by hand");
    check(empty(), "P P", &[], "no tool placed");
    let (mut app, asked) = app(empty());
    press(&mut app, "P");
    let at = cell(&mut app, [0.5, 0.5]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert!(asked.borrow()[0].starts_with("place 0.5"), "{:?}", asked.borrow());
}

#[test]
fn saving_asks_before_another_file_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("there.json");
    std::fs::write(&path, "precious").unwrap();
    let (mut app, asked) = app(typical());
    press(&mut app, "w ctrl-u");
    app.event(Event::Paste(format!("save {}", path.display())));
    press(&mut app, "enter");
    assert!(asked.borrow().is_empty());
    assert!(text(&shot(&mut app, 120, 40)).contains("overwrite 1 file?"));
    press(&mut app, "esc");
    assert!(asked.borrow().is_empty() && app.layers.is_empty());
    press(&mut app, "w ctrl-u");
    app.event(Event::Paste(format!("save {}", path.display())));
    press(&mut app, "enter y");
    assert_eq!(asked.borrow().len(), 1);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious", "the session writes, not the screen");
    press(&mut app, ":");
    app.event(Event::Paste(format!("record {}", path.display())));
    press(&mut app, "enter");
    assert!(text(&shot(&mut app, 120, 40)).contains("overwrite 1 file?"), "typed commands ask, too");
}

#[test]
fn an_export_asks_before_it_overwrites_a_figure_or_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.png", "a.csv"].map(|name| folder.path().join(name));
    files.iter().for_each(|file| std::fs::write(file, "").unwrap());
    let line = format!("figure learning {}", files[0].display());
    let (mut app, asked) = app(typical());
    app.apply(Command::parse(&line).unwrap().unwrap());
    let screen = text(&shot(&mut app, 200, 40));
    assert!(screen.contains("overwrite 2 files?") && screen.contains("a.csv"), "{screen}");
    assert!(asked.borrow().is_empty() && app.layers.len() == 1);
    press(&mut app, "y");
    assert_eq!(*asked.borrow(), [format!("{line} force")]);
}

#[test]
fn another_task_is_not_opened_over_unsaved_edits_without_a_question() {
    check(typical(), "o enter", &[], "The task task1 is edited and not saved");
    check(ViewModel { dirty: false, ..typical() }, "o enter", &[], "1 proposal for task1, not accepted yet");
    check(typical(), "o enter y", &["task task1"], "");
    check(typical(), "o right enter y", &["task task2"], "");
    check(typical(), ": t a s k space t a s k 2 enter esc", &[], "(edited)");
}

#[test]
fn the_selection_moves_to_the_neighbour_and_wraps() {
    check(empty(), "tab tab tab backtab right", &["goal move -0.59 -0.2"], "");
    check(empty(), "tab backtab backtab tab tab right", &["subgoal move 1 0.01 0.2"], "");
    let last = empty().task.tools.len();
    check(empty(), "backtab delete", &[&format!("tool delete {last}")], "");
    let mut models = empty();
    models.models.push(crate::tui::view::ModelSummary {
        name: "box".into(),
        about: "another".into(),
        fits: true,
        ..Default::default()
    });
    check(models.clone(), "6 down enter", &["model true"], "");
    check(models.clone(), "6 down down up enter", &["model true"], "");
    check(models, "6 end enter", &["model box"], "");
    let mut runs = typical();
    runs.runs.insert(0, Arc::new(crate::tui::testing::run_summary("oldest")));
    check(runs.clone(), "5 down enter", &["open runs/old"], "");
    check(runs.clone(), "5 end up enter", &["open runs/old"], "");
    check(runs, "5 end enter", &["open runs/oldest"], "");
}

#[test]
fn a_reordered_subgoal_stays_selected() {
    let mut view = empty();
    Arc::make_mut(&mut view.task).subgoals.push(task::Region { position: [0.4, 0.4], radius: 4.0 });
    check(view.clone(), "tab } right", &["subgoal swap 1 2", "subgoal move 2 0.41 0.4"], "");
    check(view, "tab tab { right", &["subgoal swap 2 1", "subgoal move 1 0.01 0.2"], "");
    check(empty(), "tab {", &[], "it is the first one");
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
    assert!(app.screens.scene.player.step() > 0, "until playback is resumed");
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
    view.task = view.hand.env.task().clone();
    check(view, "P J J J J J J J J J J J J", &[], "box would touch an object");
}

#[test]
fn a_drag_ends_when_the_button_is_released() {
    let (mut app, asked) = app(empty());
    let (at, to) = (cell(&mut app, [0.0, 0.2]), cell(&mut app, [0.5, -0.5]));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), to);
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    press(&mut app, "esc");
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), to);
    assert!(asked.borrow().is_empty() && app.screens.scene.selected().is_some(), "escape cancels the drag");
}

#[test]
fn a_click_cancels_a_drag_whose_release_was_lost() {
    let (mut app, asked) = app(empty());
    let (at, to) = (cell(&mut app, [0.0, 0.2]), cell(&mut app, [0.5, -0.5]));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    press(&mut app, ":");
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), to);
    press(&mut app, "esc");
    let tab = tab(&app, Tab::Training);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (tab.x, tab.y));
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (tab.x, tab.y));
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
}

#[test]
fn the_wheel_moves_no_object() {
    let (mut app, asked) = app(empty());
    press(&mut app, "2 tab");
    shot(&mut app, 120, 40);
    let row = region(&app, |area, region| matches!(region, HitRegion::Row(0)).then_some((area.x, area.y)));
    mouse(&mut app, MouseEventKind::ScrollDown, row);
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
}

#[test]
fn saving_as_overwrites_the_own_file_and_suggests_one_for_a_shipped_task() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.json");
    std::fs::write(&file, "").unwrap();
    let view = ViewModel { file: Some(file.clone()), ..typical() };
    let line = format!("save {}", file.display());
    check(view, "W enter", &[&line], "");
    check(typical(), "W", &[], ": save my-task1.json");
}

/// The first start, with subgoals at these places.
fn with_subgoals(places: &[[f32; 2]], radius: f32) -> ViewModel {
    let mut view = empty();
    Arc::make_mut(&mut view.task).subgoals =
        places.iter().map(|place| task::Region { position: *place, radius }).collect();
    view
}

#[test]
fn edits_stay_within_the_limits_of_a_task() {
    check(with_subgoals(&[[0.95, 0.2]], 4.0), "tab L", &["subgoal move 1 1 0.2"], "");
    check(with_subgoals(&[[0.0, 0.2]], 0.6), "tab (", &["subgoal size 1 0.5"], "");
    check(with_subgoals(&[[0.0, 0.2], [0.4, 0.4]], 4.0), "A", &["subgoal add -0.1 0.1 4"], "");
    check(with_subgoals(&[], 4.0), "2 S", &["propose"], "");
}

#[test]
fn added_and_accepted_objects_are_selected() {
    let selected = |keys: &str| {
        let (mut app, _) = app(typical());
        shot(&mut app, 120, 40);
        press(&mut app, keys);
        app.screens.scene.selected()
    };
    assert_eq!(selected("A"), Some(Object::Part(task::Part::Subgoal(1))));
    assert_eq!(selected("2 tab tab A"), Some(Object::Part(task::Part::Subgoal(1))));
    assert_eq!(selected("2 Y"), None, "all were accepted");
    assert_eq!(selected("2 T b o x enter enter"), Some(Object::Part(task::Part::Tool(typical().task.tools.len()))));
    assert_eq!(selected("2 tab P"), None, "the tool is in hand");
    assert_eq!(selected("tab home"), None, "a past episode is not edited");
}

#[test]
fn escape_deselects_and_stays_on_the_screen() {
    let (mut app, _) = app(empty());
    press(&mut app, "2 tab esc");
    assert!(app.tab == Tab::Edit && app.screens.scene.selected().is_none());
    press(&mut app, "esc");
    assert_eq!(app.tab, Tab::Edit);
    assert!(app.message().starts_with("nothing is open: 1 shows the scene"), "{}", app.message());
}

#[test]
fn a_ball_is_shown_where_it_is_dragged() {
    let (mut app, _) = app(empty());
    let [x, y] = empty().task.ball.position;
    let (from, to) = (cell(&mut app, [x, y]), cell(&mut app, [-0.5, 0.6]));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), from);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    assert_eq!(shot(&mut app, 120, 40)[to].fg, app.theme.ball);
}

#[test]
fn hand_play_begins_within_the_scene_and_resumes_playback_at_its_end() {
    let mut view = empty();
    Arc::make_mut(&mut view.task).ball.position = [0.25, -0.8];
    check(view, "P enter", &["place 0.25 -0.9"], "");
    check(empty(), "P esc enter", &[], "nothing is selected");
    let (mut app, _) = app(empty());
    press(&mut app, "P . esc");
    assert!(app.screens.scene.player.playing);
    press(&mut app, "P");
    app.tick(std::time::Duration::from_secs(60));
    assert!(!app.screens.scene.player.playing, "it waits for the next tool");
    press(&mut app, "g");
    assert!(!text(&shot(&mut app, 120, 40)).contains("no agent acts here"));
}

#[test]
fn the_held_tool_is_drawn_with_the_predicted_path() {
    let (mut app, _) = app(empty());
    press(&mut app, "P");
    let drawn = shot(&mut app, 120, 40);
    let area = scene(&app).area;
    assert!(area.positions().any(|at| drawn[at].fg == app.theme.accent), "the predicted path of the ball");
}

#[test]
fn hand_play_shows_its_latest_action_and_reports_its_end() {
    let mut view = empty();
    let mut play = mge_workbench::HandPlay::new(view.task.clone(), 0);
    let mut played = |places: usize| {
        (0..places).for_each(|_| _ = play.place([-0.9, 0.9]));
        view.hand = play.clone();
        view.clone()
    };
    let (mut app, _) = app(played(2));
    press(&mut app, "P");
    assert_eq!(app.screens.scene.player.step(), 40);
    bring(&mut app, played(100));
    assert!(text(&shot(&mut app, 120, 40)).contains("the episode is over"));
}
