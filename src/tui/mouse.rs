//! What the mouse does, by where things were drawn.

use crossterm::event::{MouseButton, MouseEvent, MouseEventKind};

use super::app::App;
use super::facts::Level;
use super::scene::{Object, View};
use super::screens::{Tab, edit, runs, scene, schedule, training};
use crate::tui::actions::Action;

/// Distance in units at which an object is still hit.
const REACH: f32 = 2.0;

/// What a press took hold of, and a drag moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grip {
    /// An object of the scene.
    Object(Object),
    /// The selected point of the schedule.
    SchedulePoint,
}

/// Applies a mouse event; true if anything changed.
pub fn handle(app: &mut App, mouse: MouseEvent) -> bool {
    let at = (mouse.column, mouse.row);
    match mouse.kind {
        MouseEventKind::Down(MouseButton::Left) => press(app, at),
        MouseEventKind::Drag(MouseButton::Left) => drag(app, at),
        MouseEventKind::Up(MouseButton::Left) => {
            app.grip = None;
            edit::drop_object(app);
            true
        }
        MouseEventKind::Moved => hover(app, at),
        MouseEventKind::ScrollUp => scroll(app, at, true),
        MouseEventKind::ScrollDown => scroll(app, at, false),
        _ => false,
    }
}

fn press(app: &mut App, at: (u16, u16)) -> bool {
    app.notice = None;
    app.grip = None;
    if let Some((_, tab)) = app.hits.tabs.iter().find(|(area, _)| area.contains(at.into())) {
        let tab = *tab;
        app.show(tab);
    } else if let Some((_, action)) = app.hits.hints.iter().find(|(area, _)| area.contains(at.into())) {
        app.perform(*action);
    } else if let Some((view, position)) = scene_at(app, at) {
        press_scene(app, view, position);
    } else if let Some(axes) = app.hits.schedule.filter(|axes| axes.plot.contains(at.into())) {
        schedule::pick(app, &axes, at.0, at.1);
        app.grip = Some(Grip::SchedulePoint);
    } else if let Some((rows, first)) = app.hits.rows.filter(|(rows, _)| rows.contains(at.into())) {
        press_row(app, first + usize::from(at.1 - rows.y));
    } else if let Some((_, metric)) = chart_at(app, at) {
        app.curves.selected = metric as usize;
    }
    true
}

fn scene_at(app: &App, (column, row): (u16, u16)) -> Option<(View, [f32; 2])> {
    let view = app.hits.scene.filter(|_| app.tab.has_scene())?;
    Some((view, view.position(column, row)?))
}

fn chart_at(app: &App, at: (u16, u16)) -> Option<(super::chart::Axes, super::metric::Metric)> {
    app.hits.charts.iter().find(|(axes, _)| axes.plot.contains(at.into())).copied()
}

fn press_scene(app: &mut App, view: View, position: [f32; 2]) {
    if let Some(hand) = &mut app.scene.hand {
        hand.cursor = position.map(|value| (value * 1000.0).round() / 1000.0);
        return scene::place(app);
    }
    app.scene.leave_past();
    // A cell is coarse: what is less than half a cell away counts as hit.
    let reach = REACH.max(42.0 / f32::from(view.area.height.max(1)));
    let object = app.desk.facts().objects().at(position, reach);
    app.scene.selected = object;
    app.grip = object.map(Grip::Object);
    match object {
        Some(object) => {
            let name = app.desk.facts().objects().name(object);
            app.say(Level::Info, format!("{name}: drag it, or move it with the arrow keys"));
        }
        None => app.say(Level::Info, format!("{:.2} {:.2}", position[0], position[1])),
    }
}

fn press_row(app: &mut App, row: usize) {
    match app.tab {
        Tab::Edit => app.scene.selected = app.desk.facts().objects().all().get(row).copied(),
        Tab::Runs if runs::is_selected(app, row) => app.perform(Action::Confirm),
        Tab::Runs => runs::select(app, row),
        Tab::Models if row < app.desk.facts().models.len() => app.lists.model = row,
        Tab::Figures if row < crate::workbench::FigureKind::ALL.len() => app.lists.figure = row,
        _ => {}
    }
}

fn drag(app: &mut App, (column, row): (u16, u16)) -> bool {
    match (app.grip, app.hits.schedule, app.hits.scene) {
        (Some(Grip::SchedulePoint), Some(axes), _) => schedule::drag(app, axes.x_at(column), axes.y_at(row)),
        (Some(Grip::Object(object)), _, Some(view)) if app.tab.has_scene() => {
            app.scene.drag = Some((object, view.nearest(column, row)));
        }
        _ => return false,
    }
    true
}

fn hover(app: &mut App, at: (u16, u16)) -> bool {
    if let Some((_, position)) = scene_at(app, at)
        && let Some(hand) = &mut app.scene.hand
    {
        hand.cursor = position.map(|value| (value * 1000.0).round() / 1000.0);
        return true;
    }
    let crosshair = chart_at(app, at).map(|(axes, _)| axes.x_at(at.0).round());
    let before = app.curves.crosshair;
    if crosshair.is_some() || app.tab == Tab::Scene {
        app.curves.crosshair = crosshair;
    }
    before != app.curves.crosshair
}

fn scroll(app: &mut App, at: (u16, u16), up: bool) -> bool {
    if let Some((axes, _)) = chart_at(app, at) {
        let factor = if up { 0.5 } else { 2.0 };
        app.curves.range = app.curves.range.zoom(factor, Some(axes.x_at(at.0)), training::episodes(app));
    } else if app.tab.has_scene() && app.hits.scene.is_some_and(|view| view.area.contains(at.into())) {
        app.scene.player.change_speed(up);
    } else if !app.tab.has_scene() && app.tab != Tab::Schedule {
        app.perform(if up { Action::Up } else { Action::Down });
    }
    true
}
