//! The schedule, by keys and mouse.

use super::*;

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
fn an_applied_schedule_is_no_draft() {
    let (mut app, asked) = app(empty());
    press(&mut app, "3 up enter");
    assert_eq!(*asked.borrow(), ["epsilon linear:0.81:0.05:1500"]);
    assert!(!app.screens.schedule.is_edited());
    press(&mut app, "q");
    assert!(app.is_leaving(), "nothing is lost");
}

#[test]
fn undo_reverts_edits_of_the_schedule_and_not_of_the_task() {
    check(empty(), "3 up up u", &[], "linear:0.81:0.05:1500");
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
}

#[test]
fn an_unchanged_schedule_is_no_draft_and_values_stay_in_range() {
    check(empty(), "3 up down", &[], "This schedule is in use.");
    check(empty(), "3 a K enter", &["epsilon points:0=0.8,750=0.525,1500=0.05"], "");
    let mut view = empty();
    view.settings.epsilon = "need:0.5:0.25:20".parse().unwrap();
    check(view, "3 K K K K enter", &["epsilon need:0.75:0.25:20"], "");
}
