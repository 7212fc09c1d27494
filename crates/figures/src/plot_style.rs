//! The style that users choose for a figure of curves.

use super::style::{DOUBLE_COLUMN, LABEL_SIZE, SINGLE_COLUMN};

/// Width, font size and x axis of a figure of curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlotStyle {
    /// Whether it spans one column of a page instead of two.
    pub single: bool,
    /// Whether the x axis is logarithmic.
    pub logarithmic: bool,
    /// Font size of axis and legend labels.
    font: f64,
}

impl Default for PlotStyle {
    fn default() -> Self {
        Self { single: false, logarithmic: false, font: Self::FONT }
    }
}

impl PlotStyle {
    /// Default size of axis and legend labels, in points.
    pub const FONT: f64 = LABEL_SIZE;
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

    /// Width on paper, in points.
    pub(super) fn width(&self) -> f64 {
        if self.single { SINGLE_COLUMN } else { DOUBLE_COLUMN }
    }

    /// Magnification relative to the default font size.
    pub(super) fn scale(&self) -> f64 {
        self.font / Self::FONT
    }
}
