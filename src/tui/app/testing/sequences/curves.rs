//! The curves, the crosshair and the past, by keys and mouse.

use super::*;

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
