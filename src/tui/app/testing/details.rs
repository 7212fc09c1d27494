//! What the key sequences do not cover: time, messages, the mouse wheel, list rows, other terminal events.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEventKind};
use ratatui::layout::Rect;

use super::sequences::{mouse, region, scene};
use super::{app, empty, press, run_summary, shot, text, typical};
use crate::tui::actions::Tab;
use crate::tui::app::App;
use crate::tui::chart::Axes;
use crate::tui::effect::Effect;
use crate::tui::screens::HitRegion;
use crate::tui::view::{Curves, Level, RunSummary, ViewModel};
use mge_run::{Metric, RunState};
use mge_task::Object;
use mge_task::Part;
use mge_workbench::Command;

/// A cell of a row of the list, if the row is shown.
fn row(app: &App, wanted: usize) -> Option<(u16, u16)> {
    let place = |(area, region): &(Rect, HitRegion)| match region {
        HitRegion::Row(row) if *row == wanted => Some((area.x, area.y)),
        _ => None,
    };
    app.regions.iter().find_map(place)
}

fn chart(app: &App) -> Axes {
    region(app, |_, region| if let HitRegion::Chart(axes, _) = region { Some(axes) } else { None })
}

fn screen(app: &mut App) -> String {
    text(&shot(app, 120, 40))
}

/// Whether there was something to draw; marks it as drawn.
fn take_changed(app: &mut App) -> bool {
    std::mem::take(&mut app.changed)
}

#[test]
fn a_message_expires_and_an_error_stays() {
    let message = |app: &App| app.message.as_ref().map(|(_, text, _)| text.clone());
    let (mut app, _) = app(empty());
    press(&mut app, "right");
    assert!(message(&app).unwrap().contains("nothing is selected"));
    // One long tick does not use up the time to read it.
    app.tick(Duration::from_secs(60));
    assert!(message(&app).is_some());
    for _ in 0..59 {
        app.tick(Duration::from_millis(100));
    }
    assert!(message(&app).is_some());
    take_changed(&mut app);
    app.tick(Duration::from_millis(100));
    assert!(message(&app).is_none() && take_changed(&mut app));
    app.warn(crate::tui::view::Level::Error, "it burns");
    for _ in 0..200 {
        app.tick(Duration::from_millis(100));
    }
    assert_eq!(message(&app).as_deref(), Some("it burns"));
}

#[test]
fn changes_of_the_session_are_drawn_soon_but_not_every_time() {
    let (mut app, _) = app(empty());
    let mut frames = |times: usize, is_new: bool| {
        let mut frame = |_: &usize| {
            app.show_news(is_new, Duration::from_millis(40));
            take_changed(&mut app)
        };
        (0..times).filter(|time| frame(time)).count()
    };
    assert_eq!(frames(100, false), 1, "the first picture");
    assert_eq!(frames(1, true), 1, "at once after a pause");
    assert_eq!(frames(75, true), 12, "then four a second");
    assert_eq!((frames(1, true), frames(5, false)), (0, 1), "the last change is drawn, too");
}

#[test]
fn only_visible_changes_request_a_redraw() {
    let (mut app, asked) = app(empty());
    assert!(take_changed(&mut app) && !app.is_changed() && !take_changed(&mut app));
    app.event(Event::FocusGained);
    let release = KeyEvent::new_with_kind(KeyCode::Char('t'), KeyModifiers::NONE, KeyEventKind::Release);
    app.event(Event::Key(release));
    assert!(!app.is_changed() && asked.borrow().is_empty());
    app.event(Event::Resize(80, 24));
    assert!(app.is_changed() && take_changed(&mut app));
    app.redraw();
    assert!(take_changed(&mut app));
    shot(&mut app, 120, 40);
    // Moving the mouse over an empty place changes nothing.
    mouse(&mut app, MouseEventKind::Moved, (0, 39));
    assert!(!take_changed(&mut app));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (0, 39));
    assert!(take_changed(&mut app));
}

#[test]
fn background_work_is_reported() {
    let (app, _) = app(empty());
    assert!(!app.is_reading_runs() && !app.screens.preview.is_drawing());
    let mut view = empty();
    view.runs_unread = 3;
    assert!(super::app(view).0.is_reading_runs());
}

#[test]
fn a_picture_is_drawn_once_it_is_finished_unless_it_would_show_through_a_layer() {
    let (mut app, _) = app(empty());
    let mut picker = ratatui_image::picker::Picker::halfblocks();
    picker.set_protocol_type(ratatui_image::picker::ProtocolType::Sixel);
    app.screens.preview.graphics = Some(picker);
    press(&mut app, "7");
    // The picture needs the regions of a first drawing.
    screen(&mut app);
    app.tick(Duration::ZERO);
    assert!(app.screens.preview.is_drawing());
    while app.screens.preview.is_drawing() {
        take_changed(&mut app);
        std::thread::yield_now();
        app.tick(Duration::ZERO);
    }
    assert!(take_changed(&mut app));
    let has_picture = |app: &mut App| shot(app, 120, 40).content.iter().any(|cell| cell.symbol().contains("\x1bP"));
    assert!(has_picture(&mut app));
    press(&mut app, "?");
    assert!(!has_picture(&mut app));
}

#[test]
fn a_tool_that_could_be_placed_is_no_error() {
    let (mut app, asked) = app(empty());
    app.carry_out(vec![Effect::apply(Command::parse("place 0 0.9").unwrap().unwrap())]);
    assert_eq!(*asked.borrow(), ["place 0 0.9"]);
    assert_eq!(app.message.as_ref().map(|(level, ..)| *level), Some(Level::Good));
}

#[test]
fn the_wheel_changes_speed_on_the_scene_and_the_selection_on_lists() {
    let (mut app, _) = app(typical());
    shot(&mut app, 120, 40);
    let at = scene(&app).cell([0.0, 0.0]).unwrap();
    let speed = |app: &App| app.screens.scene.player.speed;
    let before = speed(&app);
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    assert!(speed(&app) > before);
    mouse(&mut app, MouseEventKind::ScrollDown, at);
    assert!(speed(&app) == before);
    press(&mut app, "6");
    shot(&mut app, 120, 40);
    let at = row(&app, 0).unwrap();
    mouse(&mut app, MouseEventKind::ScrollDown, at);
    assert_eq!(app.screens.model, 1);
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    assert_eq!(app.screens.model, 0);
    press(&mut app, "3");
    shot(&mut app, 120, 40);
    mouse(&mut app, MouseEventKind::ScrollDown, (60, 20));
    assert!(!app.screens.schedule.is_edited(), "the wheel moves no point");
}

#[test]
fn a_click_selects_a_row_and_a_second_one_opens_it() {
    let click = |app: &mut App, row: usize| {
        shot(app, 120, 40);
        let at = self::row(app, row).unwrap_or((60, 38));
        mouse(app, MouseEventKind::Down(MouseButton::Left), at);
        app.tick(Duration::ZERO);
    };
    let (mut app, asked) = app(typical());
    press(&mut app, "2");
    click(&mut app, 2);
    assert_eq!(app.screens.scene.selected(), Some(app.workspace.view().objects().all()[2]));
    press(&mut app, "esc 6");
    click(&mut app, 1);
    assert_eq!(app.screens.model, 1);
    click(&mut app, 30);
    assert_eq!(app.screens.model, 1, "there is no such row");
    press(&mut app, "7");
    click(&mut app, 2);
    assert_eq!(app.screens.figure, 2);
    press(&mut app, "5 home");
    assert!(asked.borrow().is_empty());
    click(&mut app, 1);
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
    click(&mut app, 1);
    assert_eq!(asked.borrow().len(), 1);
    assert!(asked.borrow()[0].starts_with("open runs/"), "{:?}", asked.borrow());
}

#[test]
fn escape_leaves_the_large_curve_and_the_filter_and_never_the_screen() {
    let (mut app, _) = app(typical());
    press(&mut app, "4 enter esc");
    assert_eq!(app.tab, Tab::Training);
    press(&mut app, "esc");
    assert_eq!(app.tab, Tab::Training);
    press(&mut app, "5 / o l d enter");
    assert!(screen(&mut app).contains("with `old`"));
    press(&mut app, "esc");
    assert!(app.tab == Tab::Runs && !screen(&mut app).contains("with `old`"));
    press(&mut app, "esc");
    assert_eq!(app.tab, Tab::Runs);
}

#[test]
fn the_tool_in_hand_follows_the_mouse_and_the_crosshair_leaves_the_chart_with_it() {
    let (mut app, asked) = app(typical());
    shot(&mut app, 120, 40);
    let axes = chart(&app);
    let inside = (axes.plot.x + 10, axes.plot.y + 1);
    mouse(&mut app, MouseEventKind::Moved, inside);
    assert!(app.screens.beside.hovered.is_some() && take_changed(&mut app));
    mouse(&mut app, MouseEventKind::Moved, inside);
    assert!(!take_changed(&mut app), "the mouse has not moved");
    mouse(&mut app, MouseEventKind::Moved, (0, 39));
    assert!(app.screens.beside.hovered.is_none() && take_changed(&mut app));
    // On the Training screen, the crosshair placed with keys stays.
    press(&mut app, "4 left");
    shot(&mut app, 120, 40);
    let axes = chart(&app);
    mouse(&mut app, MouseEventKind::Moved, (axes.plot.x + 2, axes.plot.y + 1));
    assert!(app.screens.curves.hovered.is_some());
    mouse(&mut app, MouseEventKind::Moved, (0, 39));
    assert!(app.screens.curves.hovered.is_none() && app.screens.curves.crosshair.is_some());
    press(&mut app, "1 P");
    shot(&mut app, 120, 40);
    let at = scene(&app).cell([0.5, 0.5]).unwrap();
    mouse(&mut app, MouseEventKind::Moved, at);
    press(&mut app, "enter");
    let line = asked.borrow()[0].clone();
    let numbers = line.strip_prefix("place ").unwrap().split(' ').map(|number| number.parse::<f32>().unwrap());
    assert!(numbers.into_iter().all(|value| (value - 0.5).abs() < 0.1), "{line}");
}

#[test]
fn a_click_selects_an_object_within_reach() {
    let (mut app, _) = app(empty());
    shot(&mut app, 60, 20);
    let at = scene(&app).cell([0.0, 0.2]).unwrap();
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert_eq!(app.screens.scene.selected(), Some(Object::Part(Part::Subgoal(0))));
    let (mut app, _) = super::app(empty());
    shot(&mut app, 200, 60);
    let far = scene(&app).cell([0.0, 0.6]).unwrap();
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), far);
    assert_eq!(app.screens.scene.selected(), None);
}

#[test]
fn a_run_knows_its_time_left() {
    let mut run = RunSummary { state: RunState::Running, done: 400, ..run_summary("a") };
    Arc::make_mut(&mut run.config).episodes = 1000;
    // The first episodes take a second each, the later ones a tenth.
    let curves = |episodes: u32| {
        let mut curves = Curves::default();
        let seconds = |episode: u32| episode.min(100) as f32 + 0.1 * episode.saturating_sub(100) as f32;
        (1..=episodes).for_each(|episode| curves.push(episode.into(), seconds(episode), [0.0; Metric::KEPT.len()]));
        Arc::new(curves)
    };
    run.curves = curves(400);
    assert_eq!(run.seconds_left().map(f64::round), Some(60.0));
    // While it is young, the other runs tell more than its own rate.
    (run.done, run.expected) = (300, Some(0.05));
    assert_eq!(run.seconds_left().map(f64::round), Some(43.0));
    run.expected = None;
    assert_eq!(run.seconds_left(), None, "rather no time than a wrong one");
    run.done = 1200;
    assert_eq!(run.seconds_left(), Some(0.0));
    (run.done, run.curves, run.state) = (400, curves(400), RunState::Paused);
    assert_eq!(run.seconds_left(), None);
}

#[test]
fn idle_curves_are_requested_every_two_seconds() {
    let (mut app, _) = app(empty());
    screen(&mut app);
    app.since_request = Duration::ZERO;
    let ticks = |app: &mut App| (0..300).filter(|_| app.are_curves_due(Duration::from_millis(20))).count();
    assert_eq!(ticks(&mut app), 3);
    press(&mut app, "5");
    assert!(app.are_curves_due(Duration::ZERO));
}

#[test]
fn a_click_or_a_key_clears_the_message() {
    let (mut app, _) = app(empty());
    press(&mut app, "right");
    assert!(app.message().contains("nothing is selected"));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (0, 39));
    assert_eq!(app.message(), "");
    press(&mut app, "right 2");
    assert_eq!(app.message(), "");
}

#[test]
fn a_click_reaches_at_least_half_a_cell() {
    let (mut app, _) = app(empty());
    shot(&mut app, 60, 20);
    let view = scene(&app);
    let nearest = |reach: f32| {
        let objects = app.workspace.view().objects();
        let cells = view.area.positions().map(|at| (at.x, at.y));
        cells.filter(|(x, y)| objects.at(view.nearest(*x, *y), reach).is_some()).collect::<Vec<_>>()
    };
    let (exact, coarse) = (nearest(crate::tui::screens::scene::REACH), nearest(42.0 / 17.0));
    let at = coarse.into_iter().find(|cell| !exact.contains(cell)).unwrap();
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    assert!(app.screens.scene.selected().is_some());
}

#[test]
fn a_command_typed_again_is_kept_once_as_the_latest() {
    let (mut app, asked) = app(empty());
    press(&mut app, ": s e e d space 7 enter : s e e d space 8 enter : s e e d space 7 enter : up up up enter");
    assert_eq!(asked.borrow().last().unwrap(), "seed 8");
}

#[test]
fn saving_uses_the_file_of_the_task() {
    let (mut app, asked) = app(ViewModel { file: Some(PathBuf::from("mine.json")), ..empty() });
    press(&mut app, "w");
    assert_eq!(*asked.borrow(), ["save"]);
}
