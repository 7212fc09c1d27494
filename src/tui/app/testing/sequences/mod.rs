//! Key sequences: from a state, after these keys, what was asked for and what is shown.

mod curves;
mod editing;
mod layers;
mod leaving;
mod lists;
mod run_list;
mod run_preview;
mod runs;
mod scene_keys;
mod schedule;
mod tools;
mod training;
mod walk;

use std::sync::Arc;

use crossterm::event::{Event, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::layout::Rect;

use super::{app, bring, change_run, empty, failed, grouped, press, shot, text, typical, watch};
use crate::tui::actions::Tab;
use crate::tui::app::{App, QuitState, TerminalRequest};
use crate::tui::chart::Range;
use crate::tui::scene::View;
use crate::tui::screens::HitRegion;
use crate::tui::view::{Level, ViewModel};
use crate::tui::widgets::theme::{ASCII, Depth, Palette, Theme};
use mge_run::RunState;
use mge_task as task;
use mge_task::Object;

/// Checks that after `keys` from a state the workspace was `asked` this and the screen contains `shown`.
fn check(view: ViewModel, keys: &str, asked: &[&str], shown: &str) {
    let (mut app, log) = app(view);
    shot(&mut app, 120, 40);
    press(&mut app, keys);
    assert_eq!(*log.borrow(), asked, "after {keys}");
    // Some content needs the regions of a first drawing.
    shot(&mut app, 120, 40);
    app.tick(std::time::Duration::ZERO);
    while app.screens.preview.is_drawing() {
        app.tick(std::time::Duration::ZERO);
    }
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains(shown), "after {keys}, `{shown}` is not on\n{screen}");
}

pub(super) fn mouse(app: &mut App, kind: MouseEventKind, (column, row): (u16, u16)) {
    app.event(Event::Mouse(MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE }));
}

/// The first result of `find` on the regions.
pub(super) fn region<T>(app: &App, find: impl Fn(Rect, HitRegion) -> Option<T>) -> T {
    app.regions.iter().find_map(|(area, region)| find(*area, *region)).unwrap()
}

pub(super) fn scene(app: &App) -> View {
    region(app, |_, region| if let HitRegion::Scene(view) = region { Some(view) } else { None })
}

fn tab(app: &App, wanted: Tab) -> Rect {
    region(app, |area, region| matches!(region, HitRegion::Tab(tab) if tab == wanted).then_some(area))
}

fn cell(app: &mut App, position: [f32; 2]) -> (u16, u16) {
    shot(app, 120, 40);
    scene(app).cell(position).unwrap()
}
