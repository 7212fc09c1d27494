//! The common style of all figures: colours, type sizes, line widths, spacing. Lengths are in points (1/72 inch), so
//! that they do not depend on the resolution.

/// A colour: red, green, blue, and the opacity in [0, 1].
pub use plotters::style::RGBAColor as Color;

const fn rgb(r: u8, g: u8, b: u8) -> Color {
    Color(r, g, b, 1.0)
}

/// `color` at `opacity` in [0, 1].
pub fn faded(color: Color, opacity: f64) -> Color {
    Color { 3: opacity, ..color }
}

/// The palette of Okabe and Ito, distinguishable with every common form of colour vision.
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

/// Other colours, which are told apart from these and each other with every colour vision, also among 256 colours.
pub const NAVY: Color = rgb(0x00, 0x18, 0xF0);
/// See [`NAVY`].
pub const BRICK: Color = rgb(0xC0, 0x24, 0x24);
/// See [`NAVY`].
pub const BRASS: Color = rgb(0x6C, 0x6C, 0x30);

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

/// The colours of methods by the prefix of their labels, the same in every figure. Policies share the colour of the
/// method that explores like them.
const METHODS: [(&str, Color); 13] = [
    ("DDPG", BLUE),
    ("DDPG-MGE", VERMILLION),
    ("DDPG-MGE, epsilon 0.1", GREEN),
    ("DDPG-MGE, true physics", SKY),
    ("DDPG, uniform exploration", ORANGE),
    ("DDPG, model replay", PURPLE),
    ("planning", BLACK),
    ("adaptive DDPG", NAVY),
    ("adaptive DDPG-MGE", BRICK),
    ("adaptive DDPG, uniform exploration", BRASS),
    ("open-loop replay", GREEN),
    ("model-guided exploration", VERMILLION),
    ("random exploration", BLUE),
];

/// Colours of other series, twelve in all.
const PALETTE: [Color; 12] = [
    BLUE,
    VERMILLION,
    GREEN,
    PURPLE,
    ORANGE,
    SKY,
    BRICK,
    BRASS,
    NAVY,
    rgb(0x78, 0x78, 0x84),
    rgb(0x54, 0x90, 0x54),
    rgb(0xA8, 0x24, 0xF0),
];

/// Dash patterns of lines, in order of appearance, so that lines differ without colour.
const DASHES: [&[f64]; 7] =
    [&[], &[3.6, 1.6], &[1.0, 1.5], &[5.0, 1.5, 1.0, 1.5], &[2.0, 1.0], &[6.0, 1.2, 1.2, 1.2, 1.2, 1.2], &[8.0, 2.0]];

/// The style of one of several series: its colour identifies the method, its dash pattern its place in the
/// legend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series {
    /// Colour of lines, dots and bars.
    pub color: Color,
    /// Dash pattern of lines.
    pub dash: &'static [f64],
}

/// The styles of series with these labels, in legend order. A label has the same colour in any order of the same
/// labels.
pub fn series(labels: &[&str]) -> Vec<Series> {
    let mut sorted: Vec<&str> = labels.to_vec();
    // The plain name of a method comes before its variants.
    sorted.sort_unstable_by_key(|label| (method(label).is_none_or(|(name, _)| name != *label), *label));
    sorted.dedup();
    let colors = colors(&sorted.iter().map(|label| (*label, None)).collect::<Vec<_>>());
    let look = |(place, label): (usize, &&str)| {
        let color = sorted.iter().position(|known| known == label).map_or(GREY, |place| colors[place]);
        Series { color, dash: DASHES[place % DASHES.len()] }
    };
    labels.iter().enumerate().map(look).collect()
}

/// The colours of different labels, given in this order: the one that a label has had, or else that of its method or,
/// if another label has it, one of the others; after twelve, shades. Further labels at the end change none of them.
pub fn colors(labels: &[(&str, Option<Color>)]) -> Vec<Color> {
    let mut given: Vec<Option<Color>> = Vec::new();
    for (_, had) in labels {
        given.push(had.filter(|color| !given.contains(&Some(*color))));
    }
    for (place, (label, _)) in labels.iter().enumerate() {
        let own = method(label);
        // All that begins with the same method tries the same colours: the rest of a label changes with other labels.
        let name = own.map_or(*label, |(name, _)| name);
        let first = name.bytes().fold(0, |sum: usize, byte| sum.wrapping_mul(31).wrapping_add(byte.into()));
        let other = |next: usize| shade(PALETTE[first.wrapping_add(next) % PALETTE.len()], next / PALETTE.len());
        let mut all = own.map(|(_, color)| color).into_iter().chain((0..3 * PALETTE.len()).map(other));
        if given[place].is_none() {
            let free = all.find(|color| !given.contains(&Some(*color)));
            given[place] = free.or(Some(other(place)));
        }
    }
    given.into_iter().flatten().collect()
}

/// The method with the longest name that the label begins with.
fn method(label: &str) -> Option<(&'static str, Color)> {
    let ends = |rest: &str| rest.is_empty() || rest.starts_with([',', ' ']);
    let fitting = METHODS.into_iter().filter(|(name, _)| label.strip_prefix(name).is_some_and(ends));
    fitting.max_by_key(|(name, _)| name.len())
}

/// The colour itself, then a lighter and a darker shade, repeated.
pub fn shade(color: Color, index: usize) -> Color {
    let mix = |channel: u8, with: f64| (f64::from(channel) + 0.42 * (with - f64::from(channel))).round() as u8;
    let mixed = |with: f64| Color(mix(color.0, with), mix(color.1, with), mix(color.2, with), color.3);
    match index % 3 {
        0 => color,
        1 => mixed(255.0),
        _ => mixed(0.0),
    }
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
/// Default resolution of a PNG, in dots per inch.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_keeps_its_colour_and_others_take_those_that_are_free() {
        let first = colors(&[("DDPG", None), ("DDPG, a", None), ("x", None)]);
        assert_eq!(first[..2], colors(&[("DDPG", None), ("DDPG, b", None)]), "whatever comes after them");
        let kept = colors(&[("new", None), ("x", Some(first[2])), ("y", Some(first[2])), ("DDPG", None)]);
        assert!(kept[1] == first[2] && kept[2] != first[2] && kept[0] != first[2], "{kept:?}");
        let many: Vec<String> = (0..36).map(|n| n.to_string()).collect();
        let many = colors(&many.iter().map(|label| (&**label, None)).collect::<Vec<_>>());
        assert!((0..36).all(|n| !many[..n].contains(&many[n])), "{many:?}");
    }
}
