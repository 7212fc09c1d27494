//! The one look of all figures: colours, type sizes, line widths, spacing. Lengths are
//! in points (1/72 inch), so that they are the same on paper at any resolution.

use plotters::style::{Color as _, RGBAColor, RGBColor};

/// A colour with an opacity.
pub type Color = RGBAColor;

const fn rgb(r: u8, g: u8, b: u8) -> Color {
    RGBAColor(r, g, b, 1.0)
}

/// `color` at `opacity` in [0, 1].
pub fn faded(color: Color, opacity: f64) -> Color {
    RGBColor(color.0, color.1, color.2).mix(opacity)
}

/// The palette of Okabe and Ito, told apart with every common colour vision.
pub const BLACK: Color = rgb(0x00, 0x00, 0x00);
/// See [`BLACK`].
pub const ORANGE: Color = rgb(0xE6, 0x9F, 0x00);
/// See [`BLACK`].
pub const SKY: Color = rgb(0x56, 0xB4, 0xE9);
/// See [`BLACK`].
pub const GREEN: Color = rgb(0x00, 0x9E, 0x73);
/// See [`BLACK`].
pub const YELLOW: Color = rgb(0xF0, 0xE4, 0x42);
/// See [`BLACK`].
pub const BLUE: Color = rgb(0x00, 0x72, 0xB2);
/// See [`BLACK`].
pub const VERMILLION: Color = rgb(0xD5, 0x5E, 0x00);
/// See [`BLACK`].
pub const PURPLE: Color = rgb(0xCC, 0x79, 0xA7);

/// Paper.
pub const WHITE: Color = rgb(0xFF, 0xFF, 0xFF);
/// Text and frames.
pub const INK: Color = rgb(0x22, 0x22, 0x22);
/// Secondary text and outlines.
pub const GREY: Color = rgb(0x66, 0x66, 0x66);
/// Bodies of scene tools.
pub const LIGHT_GREY: Color = rgb(0xC4, 0xC4, 0xC4);
/// Grid lines.
pub const GRID: Color = rgb(0xE4, 0xE4, 0xE4);

/// Colours of compared things (methods, policies, predictors), in order of appearance.
pub const SERIES: [Color; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK];

/// The colour of the `index`-th compared thing; they repeat after seven, lines then dashed
/// (see [`Pen::series`](super::canvas::Pen::series)).
pub fn series_color(index: usize) -> Color {
    SERIES[index % SERIES.len()]
}

/// The colour of a stage of a task: subgoals in order of reach, the goal always green.
pub fn stage_color(stage: usize, stages: usize) -> Color {
    const SUBGOALS: [Color; 5] = [BLUE, VERMILLION, PURPLE, ORANGE, SKY];
    if stage + 1 == stages { GREEN } else { SUBGOALS[stage % SUBGOALS.len()] }
}

/// Width of a figure over one column, in points (3.5 inches).
pub const SINGLE_COLUMN: f64 = 252.0;
/// Width of a figure over both columns, in points (7.2 inches).
pub const DOUBLE_COLUMN: f64 = 518.4;
/// Resolution of a PNG unless another is asked for, in dots per inch.
pub const DEFAULT_DPI: u32 = 300;

/// Size of titles.
pub const TITLE_SIZE: f64 = 8.5;
/// Size of axis and legend labels.
pub const LABEL_SIZE: f64 = 7.5;
/// Size of tick labels and notes.
pub const SMALL_SIZE: f64 = 6.5;

/// Width of frames and ticks.
pub const FRAME_WIDTH: f64 = 0.6;
/// Width of a data line.
pub const LINE_WIDTH: f64 = 1.1;
/// Width of error bars and object outlines.
pub const THIN_WIDTH: f64 = 0.8;
/// Opacity of an interval's band.
pub const BAND_OPACITY: f64 = 0.22;
/// Length of a tick.
pub const TICK_LENGTH: f64 = 2.5;
/// Space around a whole figure.
pub const MARGIN: f64 = 4.0;
/// Space between panels.
pub const GAP: f64 = 8.0;
