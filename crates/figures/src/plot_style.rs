//! The style that users choose for a figure of curves.

use std::ops::RangeInclusive;

use educe::Educe;

use super::style::{DOUBLE_COLUMN, LABEL_SIZE, SINGLE_COLUMN};

/// Size, font size, axes and bands of a figure of curves.
#[derive(Debug, Clone, Copy, Educe, PartialEq)]
#[educe(Default)]
pub struct PlotStyle {
    /// Whether it spans one column of a page instead of two.
    pub single: bool,
    /// The ends of the x axis, if they do not follow from the curves.
    pub x: Option<[f64; 2]>,
    /// The ends of the y axis in percent, if they are not 0 and 100.
    pub y: Option<[f64; 2]>,
    /// Whether the bands around curves are left out.
    pub without_bands: bool,
    /// Height of a panel with its labels, in points before magnification, within [`Self::HEIGHTS`].
    #[educe(Default = Self::HEIGHT)]
    pub height: f64,
    /// Size of axis and legend labels, in points, within [`Self::FONTS`]; everything else scales with it.
    #[educe(Default = Self::FONT)]
    pub font: f64,
}

impl PlotStyle {
    /// Default size of axis and legend labels, in points.
    pub const FONT: f64 = LABEL_SIZE;
    /// The smallest and largest font size.
    pub const FONTS: RangeInclusive<f64> = 4.0..=16.0;
    /// Default height of a panel, in points.
    pub const HEIGHT: f64 = 138.0;
    /// The smallest and largest height of a panel.
    pub const HEIGHTS: RangeInclusive<f64> = 80.0..=600.0;

    /// Width on paper, in points.
    pub(super) fn width(&self) -> f64 {
        if self.single { SINGLE_COLUMN } else { DOUBLE_COLUMN }
    }

    /// Magnification relative to the default font size.
    pub(super) fn scale(&self) -> f64 {
        self.font / Self::FONT
    }
}
