//! State of the curves on the Scene or the Training screen.

use educe::Educe;

use crate::tui::chart::Range;
use crate::tui::view::XAxis;
use mge_run::Metric;
use mge_stats::rolling::WINDOW;

/// State of the curves.
#[derive(Debug, Educe)]
#[educe(Default)]
pub struct CurvesState {
    /// The episodes shown.
    pub range: Range,
    /// The episode whose values are shown, and which the scene shows.
    pub crosshair: Option<f32>,
    /// The episode under the mouse; its values are shown instead of those at the crosshair.
    pub hovered: Option<f32>,
    /// The selected curve.
    #[educe(Default = Metric::CURVES[0])]
    pub selected: Metric,
    /// What the curves are drawn against. Windows and the crosshair are of episodes.
    pub axis: XAxis,
    /// Whether only the selected curve is shown.
    pub alone: bool,
    /// Whether several runs are shown, not only the watched one.
    pub comparing: bool,
    /// Whether runs that differ in the seed only are one curve.
    #[educe(Default = true)]
    pub folded: bool,
}

/// Number of episodes over which values are averaged.
const SMOOTHING: usize = 10;

impl CurvesState {
    /// Removes the crosshair, or else shows all curves again, or ends a comparison; false if there is nothing to leave.
    pub fn leave(&mut self) -> bool {
        self.crosshair.take().is_some() || std::mem::take(&mut self.alone) || std::mem::take(&mut self.comparing)
    }

    /// Moves the crosshair to the past episode that is shown, or removes it when the past is left. On a screen that is
    /// not the one `here`, there is none before it is put there.
    pub fn follow(&mut self, before: Option<u64>, now: Option<u64>, here: bool) {
        if before != now {
            self.crosshair = now.filter(|_| here || self.crosshair.is_some()).map(|episode| episode as f32);
        }
    }

    /// What the selected curve means, in one line.
    pub(super) fn explanation(&self) -> String {
        if self.selected == Metric::Success {
            return format!("Share of the last {WINDOW} episodes that reached the goal; greedy: ● all, ○ none");
        }
        let meaning = self.selected.info().meaning.trim();
        meaning.split_inclusive(". ").next().unwrap_or_default().trim().to_owned()
    }

    /// Selects the curve that is `by` after the selected one.
    pub fn select_neighbour(&mut self, by: isize) {
        let count = Metric::CURVES.len();
        let now = Metric::CURVES.iter().position(|drawn| *drawn == self.selected).unwrap_or(0);
        self.selected = Metric::CURVES[(now + count).wrapping_add_signed(by) % count];
    }

    /// Smoothing of a metric: none for the success rate, which is a mean already, and for schedules, which are exact.
    pub(super) fn smoothing(metric: Metric) -> usize {
        match metric {
            Metric::Success | Metric::Epsilon | Metric::Noise => 1,
            _ => SMOOTHING,
        }
    }
}
