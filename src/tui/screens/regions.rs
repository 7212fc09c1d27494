//! Where things were drawn, for the mouse.

use ratatui::layout::Rect;

use crate::tui::actions::{Entry, Tab};
use crate::tui::chart::Axes;
use crate::tui::scene::View;
use mge_run::Metric;

/// The regions of the latest drawing.
#[derive(Debug, Default)]
pub struct HitRegions(Vec<(Rect, HitRegion)>);

/// Something that reacts to the mouse.
#[derive(Debug, Clone, Copy)]
pub enum HitRegion {
    /// A tab.
    Tab(Tab),
    /// A hint in the last line.
    Hint(&'static Entry),
    /// The scene.
    Scene(View),
    /// The schedule's plot.
    Schedule(Axes),
    /// A row of a list.
    Row(usize),
    /// A curve.
    Chart(Axes, Metric),
    /// The picture of a figure.
    Preview,
}

impl HitRegions {
    pub(super) fn add(&mut self, area: Rect, region: HitRegion) {
        self.0.push((area, region));
    }

    /// The rows of a list.
    pub(super) fn add_rows(&mut self, rows: Vec<(Rect, usize)>) {
        self.0.extend(rows.into_iter().map(|(area, index)| (area, HitRegion::Row(index))));
    }

    /// All regions, with their areas.
    pub fn all(&self) -> &[(Rect, HitRegion)] {
        &self.0
    }

    /// The region that contains a cell.
    pub fn at(&self, cell: (u16, u16)) -> Option<HitRegion> {
        self.0.iter().find(|(area, _)| area.contains(cell.into())).map(|(_, region)| *region)
    }
}
