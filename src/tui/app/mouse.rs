//! Mouse handling: an event goes to the region drawn under it.

use crossterm::event::{MouseButton, MouseEvent, MouseEventKind};

use super::{App, Drag};
use crate::tui::actions::Tab;
use crate::tui::chart::Axes;
use crate::tui::effect::Effect;
use crate::tui::screens::{HitRegion, edit, scene, schedule, training};
use crate::tui::widgets::list;
use mge_task::Property;

impl App {
    /// Applies a mouse event; true if anything changed.
    pub(super) fn mouse(&mut self, mouse: MouseEvent) -> bool {
        let at = (mouse.column, mouse.row);
        match mouse.kind {
            MouseEventKind::Down(MouseButton::Left) => self.press(at),
            MouseEventKind::Drag(MouseButton::Left) => self.drag_to(at),
            MouseEventKind::Up(MouseButton::Left) => {
                self.drag = None;
                let dropped = self.screens.scene.drop_dragged();
                self.carry_out(dropped.map(Effect::apply).into_iter().collect());
                true
            }
            MouseEventKind::Moved => self.hover(at),
            MouseEventKind::ScrollUp => self.scroll(at, true),
            MouseEventKind::ScrollDown => self.scroll(at, false),
            _ => false,
        }
    }

    fn press(&mut self, at: (u16, u16)) -> bool {
        self.message = None;
        self.drag = None;
        // The release that ends a drag is lost outside the terminal and under a layer.
        self.screens.scene.drop_dragged();
        match list::hit(&self.regions, at.into()) {
            Some(HitRegion::Tab(tab)) => self.show(tab),
            Some(HitRegion::Hint(entry)) => self.perform(entry),
            Some(HitRegion::Scene(view)) => {
                let position = view.nearest(at.0, at.1);
                // Cells are coarse: an object within half a cell is hit.
                let reach = scene::REACH.max(42.0 / f32::from(view.area.height.max(1)));
                self.act(|screens, ui| scene::press(&mut screens.scene, ui, position, reach));
                self.drag = self.screens.scene.selected().map(|_| Drag::Object);
            }
            Some(HitRegion::Schedule(axes)) => {
                let view = self.workspace.view();
                schedule::pick(&mut self.screens.schedule, view, &axes, at.0, at.1);
                self.drag = Some(Drag::SchedulePoint);
            }
            Some(HitRegion::Row(row)) => self.select_row(row),
            Some(HitRegion::Chart(axes, metric)) => {
                self.screens.curves_on(self.tab).0.selected = metric;
                self.drag = Some(Drag::Crosshair);
                self.move_crosshair(&axes, at.0);
            }
            Some(HitRegion::Preview) | None => {}
        }
        true
    }

    /// The episode in a column of a chart.
    fn episode_at(&mut self, axes: &Axes, column: u16) -> f32 {
        let tab = self.tab;
        let (screens, ui) = self.screens_and_ui();
        let (curves, runs) = screens.curves_on(tab);
        training::episode_at(curves, runs, &ui, axes.x_at(column))
    }

    fn move_crosshair(&mut self, axes: &Axes, column: u16) {
        let (to, tab) = (self.episode_at(axes, column), self.tab);
        self.act(|screens, ui| training::move_crosshair(screens.curves_on(tab), ui, to));
    }

    fn drag_to(&mut self, (column, row): (u16, u16)) -> bool {
        if self.drag == Some(Drag::Crosshair) {
            if let Some(HitRegion::Chart(axes, _)) = list::hit(&self.regions, (column, row).into()) {
                self.move_crosshair(&axes, column);
            }
            return true;
        }
        for (_, region) in &self.regions {
            match (self.drag, region) {
                (Some(Drag::SchedulePoint), HitRegion::Schedule(axes)) => {
                    let view = self.workspace.view();
                    schedule::drag(&mut self.screens.schedule, view, axes.x_at(column), axes.y_at(row));
                }
                (Some(Drag::Object), HitRegion::Scene(view)) => {
                    self.screens.scene.drag_selected(view.nearest(column, row));
                }
                _ => {}
            }
        }
        self.drag.is_some()
    }

    fn hover(&mut self, at: (u16, u16)) -> bool {
        let region = list::hit(&self.regions, at.into());
        if let (Some(HitRegion::Scene(view)), Some(hand)) = (region, &mut self.screens.scene.hand) {
            hand.hold(view.nearest(at.0, at.1));
            return true;
        }
        let crosshair = match region {
            Some(HitRegion::Chart(axes, _)) => Some(self.episode_at(&axes, at.0).round()),
            _ => None,
        };
        std::mem::replace(&mut self.screens.curves_on(self.tab).0.hovered, crosshair) != crosshair
    }

    fn scroll(&mut self, at: (u16, u16), up: bool) -> bool {
        let region = list::hit(&self.regions, at.into());
        // The wheel turns the selected tool over the scene.
        if matches!(region, Some(HitRegion::Scene(..))) && self.screens.scene.hand.is_none() {
            let steps = if up { 1.0 } else { -1.0 };
            let angle = Some(Property::Angle);
            if let Some(effects) = edit::step_property(&self.screens.scene, &self.ui(), angle, steps) {
                self.carry_out(effects);
                return true;
            }
        }
        match region {
            Some(HitRegion::Chart(axes, _)) => {
                let (centre, tab) = (self.episode_at(&axes, at.0), self.tab);
                let (screens, ui) = self.screens_and_ui();
                training::zoom(screens.curves_on(tab), &ui, if up { 0.5 } else { 2.0 }, Some(centre));
            }
            Some(HitRegion::Scene(..)) => self.screens.scene.player.change_speed(up),
            _ if self.tab == Tab::Training => self.screens.curves.select_neighbour(if up { -1 } else { 1 }),
            _ if up => self.select_line(|now, _| now.saturating_sub(1)),
            _ => self.select_line(|now, _| now + 1),
        }
        true
    }
}
