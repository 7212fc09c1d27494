//! How a figure is set on its page, as far as a person chooses that.

use super::style::{DOUBLE_COLUMN, LABEL_SIZE, SINGLE_COLUMN};

/// Width, type and axis of a figure of curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// As wide as one column of a page, not two.
    pub single: bool,
    /// The x axis is logarithmic.
    pub logarithmic: bool,
    /// Size of its type.
    font: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self { single: false, logarithmic: false, font: Self::FONT }
    }
}

impl Look {
    /// Size of axis and legend labels unless another is asked for, in points.
    pub const FONT: f64 = LABEL_SIZE;
    /// The least and the greatest size.
    pub const FONTS: [f64; 2] = [4.0, 16.0];

    /// Size of axis and legend labels, in points.
    pub fn font(&self) -> f64 {
        self.font
    }

    /// With another size of axis and legend labels; all else has its size to them.
    ///
    /// # Errors
    /// When nobody could read it, or nothing else would have room.
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

    /// How much larger it is drawn than figures usually are.
    pub(super) fn scale(&self) -> f64 {
        self.font / Self::FONT
    }
}
