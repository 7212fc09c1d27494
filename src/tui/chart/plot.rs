//! What a chart shows: curves over episodes, and how.

use std::borrow::Cow;

use ratatui::style::Color;

use super::axes::Scale;
use super::range::Window;

/// A curve.
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: Cow<'a, str>,
    /// Its colour.
    pub colour: Color,
    /// Episodes, in order.
    pub episodes: &'a [u64],
    /// One value per episode; values that are not finite are gaps.
    pub values: &'a [f32],
    /// Lower and upper bounds of the band around it, one per value.
    pub band: Option<[&'a [f32]; 2]>,
    /// Values up to this episode are means over an unfilled window and drawn dotted.
    pub partial: u64,
    /// Separate points: episode and value, such as evaluations.
    pub points: &'a [(u64, f32)],
}

/// Curves over one pair of axes.
pub struct Plot<'a> {
    /// The title.
    pub title: &'a str,
    /// The curves, the last one in front.
    pub curves: Vec<Curve<'a>>,
    /// Episodes to show.
    pub x: Window,
    /// The least range of a linear y axis.
    pub y: Option<[f32; 2]>,
    /// How values map to heights.
    pub scale: Scale,
    /// Number of episodes in the moving average of each value.
    pub smoothing: usize,
    /// The episode whose values the legend shows.
    pub crosshair: Option<f32>,
    /// Interventions: episode, colour and description.
    pub marks: Vec<(u64, Color, &'a str)>,
    /// The text shown without data.
    pub empty: &'a str,
}
