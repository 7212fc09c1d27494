//! What a chart shows: curves over episodes, or over what has happened by then, and how.

use ratatui::style::Color;

use super::axes::Scale;
use super::decimated::place;
use super::range::Window;
use mge_stats::rolling::finite_means;

/// A curve.
#[derive(Clone)]
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Its colour.
    pub colour: Color,
    /// Episodes, in order.
    pub episodes: &'a [u64],
    /// One value per episode; values that are not finite are gaps.
    pub values: &'a [f32],
    /// Lower and upper bounds of the band around it, one per value.
    pub band: Option<[&'a [f32]; 2]>,
    /// Number of values in the moving average of each.
    pub smoothing: usize,
    /// Values up to this episode are means over an unfilled window and drawn dotted.
    pub partial: u64,
    /// Evaluations: episode and share of successes.
    pub evaluations: &'a [(u64, f32)],
}

impl Curve<'_> {
    /// Its smoothed value at the crosshair, or its latest one; NaN if there is none.
    pub fn value(&self, crosshair: Option<f32>) -> f32 {
        let last = match crosshair {
            None => self.values.iter().rposition(|value| value.is_finite()),
            Some(at) => Some(place(self.episodes, at.round() as u64)).filter(|last| *last < self.values.len()),
        };
        let Some(last) = last else { return f32::NAN };
        let window = &self.values[(last + 1).saturating_sub(self.smoothing)..=last];
        finite_means(window, self.smoothing).last().unwrap_or(f32::NAN)
    }
}

/// Curves over one pair of axes.
pub struct Plot<'a> {
    /// The title.
    pub title: &'a str,
    /// The curves, the last one in front.
    pub curves: Vec<Curve<'a>>,
    /// Episodes to show.
    pub x: Window,
    /// The unit in which the x axis is labelled: its size, such as 1000 for seconds where x is in milliseconds, and name.
    pub unit: (f32, &'a str),
    /// The least range of a linear y axis.
    pub y: Option<[f32; 2]>,
    /// How values map to heights.
    pub scale: Scale,
    /// Where the values are that the legend shows, on the x axis and as an episode.
    pub crosshair: Option<[f32; 2]>,
    /// What follows the number of curves that the legend has no room for, such as where it has more.
    pub more: &'a str,
    /// The text shown without data.
    pub empty: &'a str,
}
