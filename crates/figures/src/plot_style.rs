//! The style that users choose for a figure of curves.

use educe::Educe;

use super::style::{DOUBLE_COLUMN, LABEL_SIZE, SINGLE_COLUMN};

/// Size, font size, axes and bands of a figure of curves.
#[derive(Debug, Clone, Copy, Educe, PartialEq)]
#[educe(Default)]
pub struct PlotStyle {
    /// Whether it spans one column of a page instead of two.
    pub single: bool,
    /// Whether the x axis is logarithmic.
    pub logarithmic: bool,
    /// The ends of the x axis, if they do not follow from the curves.
    pub x: Option<[f64; 2]>,
    /// The ends of the y axis in percent, if they are not 0 and 100.
    pub y: Option<[f64; 2]>,
    /// Whether the bands around curves are left out.
    pub without_bands: bool,
    /// Height of a panel with its labels, before magnification.
    #[educe(Default = Self::HEIGHT)]
    height: f64,
    /// Font size of axis and legend labels.
    #[educe(Default = Self::FONT)]
    font: f64,
}

impl PlotStyle {
    /// Default size of axis and legend labels, in points.
    pub const FONT: f64 = LABEL_SIZE;
    /// Default height of a panel, in points.
    pub const HEIGHT: f64 = 138.0;
    /// The smallest and largest height of a panel.
    pub const HEIGHTS: [f64; 2] = [80.0, 600.0];
    /// The smallest and largest font size.
    pub const FONTS: [f64; 2] = [4.0, 16.0];

    /// Size of axis and legend labels, in points.
    pub fn font(&self) -> f64 {
        self.font
    }

    /// Sets the size of axis and legend labels; everything else scales with it.
    ///
    /// # Errors
    /// When the size is outside [`Self::FONTS`].
    pub fn with_font(self, font: f64) -> Result<Self, String> {
        let [least, greatest] = Self::FONTS;
        match (least..=greatest).contains(&font) {
            true => Ok(Self { font, ..self }),
            false => Err(format!("a font has {least} to {greatest} points, not {font}")),
        }
    }

    /// Height of a panel with its labels, in points.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Sets the height of a panel.
    ///
    /// # Errors
    /// When the height is outside [`Self::HEIGHTS`].
    pub fn with_height(self, height: f64) -> Result<Self, String> {
        let [least, greatest] = Self::HEIGHTS;
        match (least..=greatest).contains(&height) {
            true => Ok(Self { height, ..self }),
            false => Err(format!("a panel is {least} to {greatest} points high, not {height}")),
        }
    }

    /// Width on paper, in points.
    pub(super) fn width(&self) -> f64 {
        if self.single { SINGLE_COLUMN } else { DOUBLE_COLUMN }
    }

    /// Magnification relative to the default font size.
    pub(super) fn scale(&self) -> f64 {
        self.font / Self::FONT
    }
}
