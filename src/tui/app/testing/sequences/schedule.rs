//! The schedule, by keys and mouse.

use super::*;
use mge_run::RunState;

#[test]
fn the_schedule_is_drawn_and_applied() {
    check(empty(), "3", &[], "This schedule is in use");
    check(empty(), "3 up", &[], "points:0=0.81,1500=0.05");
    check(empty(), "3 up backspace", &[], "This schedule is in use");
    check(empty(), "3 tab K enter", &["epsilon points:0=0.8,1500=0.15"], "");
    check(empty(), "3 enter", &["epsilon linear:0.8:0.05:1500"], "");
    check(empty(), "3 a enter", &["epsilon points:0=0.8,750=0.425,1500=0.05"], "");
}

#[test]
fn what_is_said_of_epsilon_depends_on_its_kind_and_on_the_method() {
    let mut view = empty();
    view.settings.epsilon = "need:0.5:0.25:20".parse().unwrap();
    check(view.clone(), "3", &[], "clusters with this probability times");
    check(view.clone(), "3 up", &[], "Not in use: the next run explores by need, unless");
    view.settings.method = mge_trainer::Method::Planning;
    check(view.clone(), "3", &[], "Not used by the method of the next run: planning.");
    let (mut app, _) = app(view);
    let screen = text(&shot(&mut app, 120, 40));
    assert!(!screen.contains("by need"), "{screen}");
}

#[test]
fn a_schedule_is_drawn_with_the_mouse() {
    let mut view = empty();
    view.settings.epsilon = "points:0=0.8,1500=0.1".parse().unwrap();
    let (mut app, asked) = app(view);
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let HitRegion::Schedule(axes) = region { Some(axes) } else { None });
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
fn points_of_the_schedule_are_selected_in_both_directions() {
    check(empty(), "3 backtab K enter", &["epsilon points:0=0.8,1500=0.15"], "");
    check(empty(), "3 tab backtab J enter", &["epsilon points:0=0.7,1500=0.05"], "");
    check(empty(), "3 tab tab J enter", &["epsilon points:0=0.7,1500=0.05"], "");
    check(empty(), "3 tab a enter", &["epsilon points:0=0.8,1500=0.05,1750=0.05"], "");
    check(empty(), "3 tab a L L L L enter", &["epsilon points:0=0.8,1500=0.05,2000=0.05"], "");
    check(empty(), "3 tab a L L L L a", &[], "no episode of the run is left after this point");
    let mut three = empty();
    three.settings.epsilon = "points:0=0.8,1000=0.4,1500=0".parse().unwrap();
    check(three, "3 tab backtab J enter", &["epsilon points:0=0.7,1000=0.4,1500=0"], "");
    check(empty(), "3 delete enter", &["epsilon points:1500=0.05"], "");
    check(empty(), "3 delete delete enter", &["epsilon points:1500=0.05"], "");
    check(empty(), "3 delete delete", &[], "the only point is not deleted");
}

#[test]
fn an_applied_schedule_is_no_draft() {
    let (mut app, asked) = app(empty());
    press(&mut app, "3 up enter");
    assert_eq!(*asked.borrow(), ["epsilon points:0=0.81,1500=0.05"]);
    assert!(!app.screens.schedule.is_edited());
    press(&mut app, "q");
    assert!(app.is_leaving(), "nothing is lost");
}

#[test]
fn a_typed_schedule_replaces_the_drawn_one() {
    let typed = "3 up e 0 . 2 enter";
    check(empty(), typed, &["epsilon 0.2"], "This schedule is in use.");
    check(empty(), "3 up t", &[], "the drawn schedule is not in use");
    let mut elsewhere = typical();
    change_run(&mut elsewhere, 0, |run| (run.active, run.state) = (false, RunState::Running));
    check(elsewhere, "3 up", &[], "enter uses it in task1-ddpg-mge-seed0");
}

#[test]
fn undo_reverts_edits_of_the_schedule_and_not_of_the_task() {
    check(empty(), "3 up up u", &[], "points:0=0.81,1500=0.05");
    check(empty(), "3 up u", &[], "This schedule is in use.");
    check(empty(), "3 up u u", &[], "there is no schedule edit to undo");
    check(empty(), "3 up backspace u", &[], "there is no schedule edit to undo");
    check(empty(), "3 tab up tab u", &[], "This schedule is in use.");
    check(empty(), "2 u", &["undo"], "");
}

/// The Schedule screen with these points, the commands it gives, and its axes.
fn drawn(points: &str) -> (App, std::rc::Rc<std::cell::RefCell<Vec<String>>>, crate::tui::chart::Axes) {
    let mut view = empty();
    view.settings.epsilon = points.parse().unwrap();
    let (mut app, asked) = app(view);
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let HitRegion::Schedule(axes) = region { Some(axes) } else { None });
    (app, asked, axes)
}

#[test]
fn a_press_selects_a_near_point_and_adds_one_elsewhere() {
    let points = "points:0=0.8,1000=0.4,3000=0.1";
    let pressed = |episode: f32, above: u16, keys: &str| {
        let (mut app, asked, axes) = drawn(points);
        assert!(axes.x.to > 3000.0, "every point is visible");
        let at = (axes.column(episode).unwrap(), axes.row(0.4).unwrap() - above);
        mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
        mouse(&mut app, MouseEventKind::Up(MouseButton::Left), at);
        press(&mut app, keys);
        asked.borrow().concat()
    };
    assert_eq!(pressed(1000.0, 0, "K enter"), "epsilon points:0=0.8,1000=0.5,3000=0.1");
    assert_eq!(pressed(2000.0, 5, "enter").matches(',').count(), 3, "a fourth point");
    assert_eq!(pressed(1020.0, 9, "enter").matches(',').count(), 3, "a point far above another");
    let deleted = pressed(2000.0, 5, "delete enter");
    assert_eq!(deleted, format!("epsilon {points}"), "the added point is selected");
    assert_eq!(pressed(2000.0, 5, "u enter"), format!("epsilon {points}"), "it is undone");
    let (mut app, asked, axes) = drawn(points);
    let beside = (axes.column(1000.0).unwrap() + 2, axes.row(0.4).unwrap());
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), beside);
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), beside);
    press(&mut app, "K enter");
    assert_eq!(asked.borrow().concat(), "epsilon points:0=0.8,1000=0.5,3000=0.1", "two columns beside it");
}

#[test]
fn an_unchanged_schedule_is_no_draft_and_values_stay_in_range() {
    check(empty(), "3 up down", &[], "This schedule is in use.");
    check(empty(), "3 a K enter", &["epsilon points:0=0.8,750=0.525,1500=0.05"], "");
    let mut view = empty();
    view.settings.epsilon = "need:0.5:0.25:20".parse().unwrap();
    check(view, "3 K K K K K K enter", &["epsilon points:0=1,2000=0.5"], "");
}

#[test]
fn a_point_is_moved_by_a_hundredth_or_a_tenth_of_the_episodes() {
    check(empty(), "3 tab right enter", &["epsilon points:0=0.8,1520=0.05"], "");
    check(empty(), "3 tab H enter", &["epsilon points:0=0.8,1300=0.05"], "");
}

#[test]
fn a_point_is_selected_after_points_were_removed() {
    let mut three = empty();
    three.settings.epsilon = "points:0=0.8,1000=0.4,1500=0".parse().unwrap();
    check(three, "3 backtab delete", &[], " 1000: 0.4 ");
    check(empty(), "3 tab a backspace K enter", &["epsilon points:0=0.8,1500=0.15"], "");
}

#[test]
fn the_label_of_a_point_at_the_right_edge_is_inside_the_plot() {
    let mut view = empty();
    view.settings.epsilon = "linear:0.8:0.05:2000".parse().unwrap();
    check(view, "3 tab", &[], " 2000: 0.05 ");
}

#[test]
fn a_step_is_drawn_as_a_vertical_line_and_the_plot_starts_at_its_left_edge() {
    let (mut app, _, axes) = drawn("step:0.9:0.1:1000");
    let screen = shot(&mut app, 120, 40);
    let column = axes.column(1000.0).unwrap();
    for row in axes.row(0.8).unwrap()..axes.row(0.2).unwrap() {
        let is_drawn = |column: u16| screen[(column, row)].symbol() != " ";
        assert!((column - 1..=column + 1).any(is_drawn), "{}", text(&screen));
    }
    let (mut app, _, axes) = drawn("points:500=0.8,1000=0.4");
    app.theme = Theme::new(Palette::Dark, Depth::True, ASCII);
    let screen = shot(&mut app, 120, 40);
    assert_ne!(screen[(axes.plot.x, axes.row(0.8).unwrap())].symbol(), " ", "{}", text(&screen));
}

#[test]
fn the_help_leaves_two_thirds_of_a_small_screen_to_the_plot() {
    let (mut app, _) = app(empty());
    press(&mut app, "3 up");
    shot(&mut app, 60, 21);
    let height = region(&app, |area, region| matches!(region, HitRegion::Schedule(_)).then_some(area.height));
    assert!(height >= 8, "{height}");
}
