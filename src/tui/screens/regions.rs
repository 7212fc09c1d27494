//! Where things were drawn, for the mouse.

use ratatui::layout::Rect;

use crate::tui::actions::{Entry, Tab};
use crate::tui::chart::Axes;
use crate::tui::scene::View;
use mge_run::Metric;

/// The regions of a drawing.
pub type HitRegions = Vec<(Rect, HitRegion)>;

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

/// The rows of a list.
pub(super) fn row_regions(drawn: Vec<(Rect, usize)>) -> impl Iterator<Item = (Rect, HitRegion)> {
    drawn.into_iter().map(|(area, index)| (area, HitRegion::Row(index)))
}
