//! The curves, the crosshair and past episodes, by keys and mouse.

use super::super::forked;
use super::*;
use crate::tui::view::RunSummary;
use mge_run::Metric;

#[test]
fn a_run_has_the_name_that_it_was_given_in_legends() {
    let mut view = grouped();
    change_run(&mut view, 0, |run| run.name = "baseline".to_owned());
    let (mut app, _) = app(view);
    press(&mut app, "5 tab end space up space V tab");
    let screen = text(&shot(&mut app, 160, 50));
    assert!(screen.contains("baseline: "), "{screen}");
}

#[test]
fn curves_are_read_zoomed_and_compared() {
    check(typical(), "4", &[], "critic loss, mean of 10, log");
    check(typical(), "4 left left", &[], "episode 693");
    check(typical(), "4 enter", &[], "success rate");
    let (mut app, _) = app(typical());
    press(&mut app, "4 z z");
    let window = app.screens.curves.range.window(700);
    assert!(window.to - window.from < 200.0, "{window:?}");
    press(&mut app, "0");
    assert_eq!(app.screens.curves.range.window(700).from, 1.0);
}

#[test]
fn a_run_without_curves_says_why() {
    let shown = |change: fn(&mut RunSummary), why: &str| {
        let mut view = typical();
        change_run(&mut view, 1, |run| {
            (run.done, run.curves, run.evaluations) = (0, Arc::default(), Vec::new());
            change(run);
        });
        check(view, "4 enter", &[], why);
    };
    shown(|run| run.queued = true, "no episodes yet: queued");
    shown(|run| run.done = 700, "its log is being read");
    shown(|run| run.preparing = Some("practice".into()), "before the first episode: practice");
    shown(|run| run.state = RunState::Paused, "no episodes yet: paused");
}

#[test]
fn the_crosshair_follows_the_mouse_and_the_wheel_zooms() {
    let (mut app, _) = app(typical());
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let HitRegion::Chart(axes, _) = region { Some(axes) } else { None });
    let at = (axes.plot.x + axes.plot.width / 2, axes.plot.y + 1);
    mouse(&mut app, MouseEventKind::Moved, at);
    assert!((app.screens.beside.hovered.unwrap() - 350.0).abs() < 20.0);
    assert_eq!(app.subject.past_episode(), None, "the mouse only reads values off");
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    let pressed = app.subject.past_episode().unwrap();
    assert!(pressed.abs_diff(350) < 20, "{pressed}");
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), (at.0 + 4, at.1));
    let dragged = app.subject.past_episode().unwrap();
    assert!(dragged > pressed && app.screens.beside.crosshair == Some(dragged as f32));
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (at.0 + 4, at.1));
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    let window = app.screens.beside.range.window(700);
    assert!(window.from > 100.0 && window.to < 600.0, "{window:?}");
}

#[test]
fn the_crosshair_and_the_scene_follow_each_other() {
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
    assert_eq!((app.subject.past_episode(), app.screens.scene.player.step()), (Some(686), 50), "the step is kept");
    press(&mut app, "pageup");
    assert_eq!(app.screens.curves.crosshair, Some(685.0));
    press(&mut app, "1 pagedown");
    assert_eq!(app.screens.curves.crosshair, Some(686.0));
    press(&mut app, "4 esc");
    assert_eq!((app.subject.past_episode(), app.screens.curves.crosshair), (Some(686), None), "the crosshair first");
    press(&mut app, "esc");
    assert_eq!(app.subject.past_episode(), None);
}

#[test]
fn zoom_and_crosshair_belong_to_a_screen() {
    let (mut app, _) = app(typical());
    let mut seen = |keys: &str| {
        press(&mut app, keys);
        let screen = text(&shot(&mut app, 120, 40));
        let axes = region(&app, |_, region| if let HitRegion::Chart(axes, _) = region { Some(axes) } else { None });
        (axes.x.from > 1.0, screen.contains('┊'))
    };
    assert_eq!(seen("4 z left left"), (true, true));
    assert_eq!(seen("1"), (false, false), "the Scene screen has its own");
    assert_eq!(seen("pagedown"), (false, true));
    assert_eq!(seen("esc 4"), (true, false));
    assert_eq!(seen("1 pageup 4"), (true, false), "the episode is beside the curves");
    assert_eq!(seen("left"), (true, true));
    press(&mut app, "1");
    shot(&mut app, 120, 40);
    let axes = region(&app, |_, region| if let HitRegion::Chart(axes, _) = region { Some(axes) } else { None });
    mouse(&mut app, MouseEventKind::ScrollUp, (axes.plot.x + 9, axes.plot.y + 1));
    assert!(app.screens.beside.range != Range::Whole && app.screens.beside.range != app.screens.curves.range);
}

#[test]
fn the_past_of_a_run_is_played_episode_by_episode() {
    check(typical(), "pageup", &[], "episode 700 of 700");
    check(typical(), "pageup pageup", &[], "episode 699 of 700");
    check(typical(), "home", &[], "episode 1 of 700");
    check(typical(), "home pagedown", &[], "episode 2 of 700");
    check(typical(), "home esc", &[], "no tool placed");
    check(empty(), "pageup", &[], "no run with episodes is being watched");
}

#[test]
fn watching_another_run_resets_the_window() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 z left");
    assert!(matches!(app.screens.curves.range, Range::Part(_)));
    let mut view = typical();
    watch(&mut view, 0);
    bring(&mut app, view);
    assert_eq!((app.screens.curves.range, app.screens.curves.crosshair), (Range::Whole, None));
}

#[test]
fn a_click_selects_the_curve() {
    let (mut app, _) = app(typical());
    press(&mut app, "4");
    shot(&mut app, 120, 40);
    let at =
        region(&app, |area, region| matches!(region, HitRegion::Chart(_, Metric::Epsilon)).then_some((area.x, area.y)));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    press(&mut app, "enter");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains(Metric::Epsilon.title()) && !screen.contains(Metric::Success.title()), "{screen}");
}

#[test]
fn the_window_of_episodes_is_moved_and_kept_around_the_crosshair() {
    let window = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, "4");
        app.screens.curves.crosshair = Some(100.0);
        press(&mut app, keys);
        let window = app.screens.curves.range.window(700);
        (window.from, window.to)
    };
    let (from, to) = window("z");
    assert!(from > 1.0 && from < 100.0 && to > 100.0 && to <= 400.0, "{from} to {to}");
    assert!(window("z L").0 > from && window("z L H").0 == from);
    assert_eq!(window("z z Z"), window("z"));
}

#[test]
fn the_selection_of_curves_wraps_and_pages() {
    let [first, .., last] = Metric::CURVES.map(Metric::title);
    check(typical(), "4 up enter", &[], last);
    check(typical(), "4 up down enter", &[], first);
    let (mut app, _) = app(typical());
    press(&mut app, "4 up");
    assert!(text(&shot(&mut app, 80, 24)).contains(last));
}

#[test]
fn the_mouse_takes_precedence_until_a_key_moves_the_crosshair() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 left");
    app.screens.curves.hovered = Some(300.0);
    app.changed = true;
    assert!(text(&shot(&mut app, 120, 40)).contains("episode 300"));
    press(&mut app, "left");
    assert!(app.screens.curves.hovered.is_none());
    press(&mut app, "enter esc");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(
        app.screens.curves.crosshair.is_none() && !screen.contains(Metric::Return.title()),
        "the curve is still alone\n{screen}"
    );
}

#[test]
fn the_episode_beside_the_curves_can_be_stepped_and_a_click_leaves_it() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 left . . ,");
    assert_eq!(app.screens.scene.player.step(), 1);
    press(&mut app, "1");
    let at = cell(&mut app, [0.9, 0.9]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert_eq!(app.subject.past_episode(), None, "the edited task is shown");
    check(typical(), "pagedown", &[], "episode 1 of 700");
    check(typical(), "end pagedown", &[], "episode 700 of 700");
    check(typical(), "home pageup", &[], "episode 1 of 700");
}

#[test]
fn without_a_watched_run_the_crosshair_moves_over_the_compared_ones() {
    let unwatched = || ViewModel { watched: None, ..grouped() };
    let (mut app, _) = app(unwatched());
    press(&mut app, "5 space V left");
    let crosshair = app.screens.curves.crosshair;
    bring(&mut app, unwatched());
    assert!(crosshair.is_some() && app.screens.curves.crosshair == crosshair);
    super::super::wanted();
    press(&mut app, "5 tab 4");
    let curves = super::super::wanted().pop().unwrap();
    assert_eq!(curves, "curves of plain-0 plain-1 plain-2 guided-2 guided-1 guided-0", "each once");
}

#[test]
fn the_crosshair_moves_by_a_hundredth_of_the_window() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 z z left left");
    assert_eq!(app.screens.curves.crosshair, Some(698.0), "the window has 175 episodes");
}

#[test]
fn curves_are_drawn_against_actions_and_the_time_of_training() {
    check(typical(), "4", &[], "│ episodes ");
    check(typical(), "4 X", &[], "│ actions ");
    check(typical(), "4 X X X", &[], "│ seconds ");
}

#[test]
fn the_crosshair_and_the_window_are_kept_on_every_axis() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 z left left");
    let episode = app.subject.past_episode().unwrap();
    press(&mut app, "X X X");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("│ seconds ") && screen.contains('┊'), "{screen}");
    assert!(screen.contains(&format!("episode {episode}")), "{screen}");
    let axes = region(&app, |_, region| if let HitRegion::Chart(axes, _) = region { Some(axes) } else { None });
    assert!(axes.x.from > 20_000.0, "the last 350 of 700 episodes: {axes:?}");
    let at = (axes.plot.x + axes.plot.width / 2, axes.plot.y + 1);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    let middle = axes.x_at(at.0) / 1000.0 * 12.5;
    assert!((app.subject.past_episode().unwrap() as f32 - middle).abs() < 3.0, "12.5 episodes a second");
}

#[test]
fn a_group_against_time_says_that_it_is_a_mean() {
    check(grouped(), "4 X X X", &[], "│ mean seconds ");
}

#[test]
fn compared_groups_are_unfolded_into_single_runs() {
    check(grouped(), "5 space down space V tab", &[], "training · 6 curves");
}

#[test]
fn all_curves_have_their_values_at_the_crosshair() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 left");
    let screen = text(&shot(&mut app, 80, 24));
    let success = format!("{} 0.3", Metric::Success.title());
    assert!(screen.contains(&success) && screen.contains("hits by subgoal 0.05"), "{screen}");
    assert!(screen.contains("actor loss 0.05"), "{screen}");
    let (mut app, _) = super::app(grouped());
    press(&mut app, "5 space down space V left");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("DDPG-MGE, epsilon 0.8 to 0.05 / DDPG: success rate"), "{screen}");
}

#[test]
fn runs_of_one_name_and_groups_of_one_label_are_told_apart() {
    let mut view = forked();
    change_run(&mut view, 1, |run| run.name = "same".to_owned());
    change_run(&mut view, 3, |run| run.name = "same".to_owned());
    let (mut app, _) = app(view);
    press(&mut app, "5 space down down space V");
    let screen = text(&shot(&mut app, 160, 50));
    assert!(screen.contains("runs/first: ") && screen.contains("runs/first-at500: "), "{screen}");
}
