//! Where things were drawn, so that the mouse finds them.

use ratatui::layout::Rect;

use crate::run::Metric;
use crate::tui::actions::{Action, Tab};
use crate::tui::chart::Axes;
use crate::tui::scene::View;

/// Where things were drawn. Only what is on the screen now has a place.
#[derive(Debug, Default)]
pub struct HitRegions {
    drawn: bool,
    tabs: Vec<(Rect, Tab)>,
    hints: Vec<(Rect, Action)>,
    scene: Option<View>,
    charts: Vec<(Axes, Metric)>,
    schedule: Option<Axes>,
    preview: Option<Rect>,
    /// Rows of a list and the index of the first.
    rows: Option<(Rect, usize)>,
}

/// Something under the mouse.
#[derive(Debug, Clone, Copy)]
pub enum Region {
    /// A tab.
    Tab(Tab),
    /// A hint in the last line.
    Hint(Action),
    /// The scene, at a normalised position.
    Scene(View, [f32; 2]),
    /// The schedule's plot.
    Schedule(Axes),
    /// A row of a list.
    Row(usize),
    /// A curve.
    Chart(Axes, Metric),
}

impl HitRegions {
    /// Regions of a screen that is drawn.
    pub(super) fn of_screen() -> Self {
        Self { drawn: true, ..Self::default() }
    }

    /// Whether there was room to draw the workbench.
    pub fn is_drawn(&self) -> bool {
        self.drawn
    }

    pub(super) fn add_tab(&mut self, area: Rect, tab: Tab) {
        self.tabs.push((area, tab));
    }

    pub(super) fn add_hint(&mut self, area: Rect, action: Action) {
        self.hints.push((area, action));
    }

    pub(super) fn add_chart(&mut self, axes: Axes, metric: Metric) {
        self.charts.push((axes, metric));
    }

    pub(super) fn set_scene(&mut self, view: View) {
        self.scene = Some(view);
    }

    pub(super) fn set_schedule(&mut self, axes: Axes) {
        self.schedule = Some(axes);
    }

    pub(super) fn set_preview(&mut self, area: Rect) {
        self.preview = Some(area);
    }

    pub(super) fn set_rows(&mut self, area: Rect, first: usize) {
        self.rows = Some((area, first));
    }

    /// The scene.
    pub fn scene(&self) -> Option<View> {
        self.scene
    }

    /// The schedule's plot.
    pub fn schedule(&self) -> Option<Axes> {
        self.schedule
    }

    /// Where the figure is shown.
    pub fn preview(&self) -> Option<Rect> {
        self.preview.filter(|area| area.width > 0 && area.height > 0)
    }

    /// What is in a cell.
    pub fn at(&self, (column, row): (u16, u16)) -> Option<Region> {
        let cell = (column, row).into();
        let tab = self.tabs.iter().find(|(area, _)| area.contains(cell)).map(|(_, tab)| Region::Tab(*tab));
        let hint = || self.hints.iter().find(|(area, _)| area.contains(cell)).map(|(_, action)| Region::Hint(*action));
        let scene = || self.scene.and_then(|view| Some(Region::Scene(view, view.position(column, row)?)));
        let schedule = || self.schedule.filter(|axes| axes.plot.contains(cell)).map(Region::Schedule);
        let list = || {
            let (rows, first) = self.rows.filter(|(rows, _)| rows.contains(cell))?;
            Some(Region::Row(first + usize::from(row - rows.y)))
        };
        let chart = || {
            let (axes, metric) = self.charts.iter().find(|(axes, _)| axes.plot.contains(cell))?;
            Some(Region::Chart(*axes, *metric))
        };
        tab.or_else(hint).or_else(scene).or_else(schedule).or_else(list).or_else(chart)
    }

    #[cfg(test)]
    pub(in crate::tui) fn tab(&self, index: usize) -> (Rect, Tab) {
        self.tabs[index]
    }

    #[cfg(test)]
    pub(in crate::tui) fn chart(&self, index: usize) -> Axes {
        self.charts[index].0
    }

    #[cfg(test)]
    pub(in crate::tui) fn rows(&self) -> Rect {
        self.rows.unwrap().0
    }
}
