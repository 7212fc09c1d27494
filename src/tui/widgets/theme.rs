//! Colours and markers, adapted to what the terminal can show.

use anstyle_lossy::rgb_to_xterm;
use ratatui::prelude::*;
pub use ratatui::symbols::Marker;

use mge_base::text::is_unsafe;
use mge_figures as figures;

/// One character per cell represents dots; for terminals without Unicode or braille.
pub const ASCII: Marker = Marker::Custom('*');

/// The signs of the screens, and in the same order what represents them in ASCII.
const SIGNS: [&str; 2] = ["·─│┊╭╮╰╯›└■█░○□●◐✓★", "--||++++>`##.oO@+v*"];

/// How many colours the terminal can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// None: shapes, labels and text attributes only (`NO_COLOR`).
    None,
    /// 256 indexed colours.
    Ansi256,
    /// 24-bit colours.
    True,
}

/// A set of colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// For dark backgrounds.
    Dark,
    /// For light backgrounds.
    Light,
    /// Okabe and Ito's colours, which people with any colour vision can tell apart.
    ColourBlind,
}

mge_base::names!(Palette { Dark = "dark", Light = "light", ColourBlind = "colour-blind" });

/// Whether the character set of a locale, such as `de_DE.UTF-8@euro`, is UTF-8. That of one which names none is not.
fn is_unicode(locale: &str) -> bool {
    let name = locale.split('@').next().unwrap_or_default();
    let charset = name.rsplit('.').next().unwrap_or_default();
    charset.replace('-', "").eq_ignore_ascii_case("utf8")
}

/// The meaning of each colour on screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Theme {
    /// The palette.
    pub palette: Palette,
    /// The colour depth of the terminal.
    pub depth: Depth,
    /// The characters that represent dots: braille or [`ASCII`].
    pub marker: Marker,
    /// Secondary text, grids.
    pub dim: Color,
    /// Titles, keys, the focused pane.
    pub accent: Color,
    /// Frames of panes.
    pub border: Color,
    /// The ball.
    pub ball: Color,
    /// The trail of the ball.
    pub trail: Color,
    /// Tools of the scene.
    pub tool: Color,
    /// Tools the agent placed.
    pub placed: Color,
    /// The final goal.
    pub goal: Color,
    /// Something succeeded.
    pub good: Color,
    /// Something needs attention.
    pub warn: Color,
    /// Something failed.
    pub bad: Color,
    /// One colour per stage of guidance, repeated; also for overlaid curves.
    pub stages: [Color; 6],
}

/// 24-bit colours: dim, accent, border, ball, trail, tool, placed, goal, good, warn and bad; then the stages.
type Swatch = ([u32; 11], [u32; 6]);

const DARK: Swatch = (
    [0x8a8f98, 0x7aa2f7, 0x4c5264, 0xf2f4f8, 0x8f9bb3, 0x9aa5b8, 0xe0af68, 0x9ece6a, 0x9ece6a, 0xe0af68, 0xf7768e],
    [0x7dcfff, 0xbb9af7, 0xff9e64, 0x73daca, 0xf7768e, 0xe0af68],
);
const LIGHT: Swatch = (
    [0x6b7280, 0x1d4ed8, 0xb3b9c4, 0x111827, 0x6b7280, 0x4b5563, 0xb45309, 0x15803d, 0x15803d, 0xb45309, 0xb91c1c],
    [0x0369a1, 0x7e22ce, 0xc2410c, 0x0f766e, 0xbe123c, 0xa16207],
);
const COLOUR_BLIND: Swatch = (
    [0x999999, 0x56b4e9, 0x666666, 0xffffff, 0x999999, 0xb0b0b0, 0xe69f00, 0x009e73, 0x009e73, 0xf0e442, 0xd55e00],
    [0x56b4e9, 0xcc79a7, 0xe69f00, 0x009e73, 0xd55e00, 0xf0e442],
);

impl Theme {
    /// Makes a drawn screen safe for the terminal: characters that it would interpret are removed from text, and
    /// where it needs ASCII, others are replaced.
    pub fn make_safe(&self, buffer: &mut Buffer) {
        for cell in &mut buffer.content {
            let symbol = cell.symbol();
            // A picture is in its first cell as a sequence, or in each as placeholders of kitty.
            let is_picture = symbol.starts_with(['\u{1b}', '\u{10eeee}']);
            let is_plain = self.marker == ASCII;
            if symbol.is_ascii() || is_picture || !(is_plain || symbol.contains(is_unsafe)) {
                continue;
            }
            let shown = symbol.chars().find(|c| !is_unsafe(*c)).unwrap_or(' ');
            let place = SIGNS[0].chars().position(|sign| sign == shown);
            let plain = place.and_then(|place| SIGNS[1].chars().nth(place)).unwrap_or('?');
            cell.set_char(if is_plain && !shown.is_ascii() { plain } else { shown });
        }
    }

    /// The theme of a palette at a depth.
    pub fn new(palette: Palette, depth: Depth, marker: Marker) -> Self {
        let (main, stages) = match palette {
            Palette::Dark => DARK,
            Palette::Light => LIGHT,
            Palette::ColourBlind => COLOUR_BLIND,
        };
        let main = main.map(|rgb| fit(Color::from_u32(rgb), depth));
        let [dim, accent, border, ball, trail, tool, placed, goal, good, warn, bad] = main;
        let stages = stages.map(|rgb| fit(Color::from_u32(rgb), depth));
        Self { palette, depth, marker, dim, accent, border, ball, trail, tool, placed, goal, good, warn, bad, stages }
    }

    /// The theme for the terminal, from whether its background is light, if it tells, and from the environment:
    /// `NO_COLOR`, `COLORTERM`, `TERM`, `COLORFGBG`, the character set of the locale, and `MGE_THEME`, a list of words
    /// such as `light,256,ascii` (`dark`, `light`, `colour-blind`; `none`, `256`, `true`; `braille`, `ascii`).
    pub fn from_env(variable: impl Fn(&str) -> Option<String>, is_light: Option<bool>) -> Self {
        let value = |name: &str| variable(name).unwrap_or_default();
        let is_true = matches!(value("COLORTERM").as_str(), "truecolor" | "24bit");
        let mut depth = if is_true { Depth::True } else { Depth::Ansi256 };
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().filter_map(&variable).find(|text| !text.is_empty());
        let is_plain = value("TERM") == "linux" || locale.is_some_and(|locale| !is_unicode(&locale));
        let mut marker = if is_plain { ASCII } else { Marker::Braille };
        let is_light =
            is_light.unwrap_or_else(|| value("COLORFGBG").ends_with(";15") || value("COLORFGBG").ends_with(";7"));
        let mut palette = if is_light { Palette::Light } else { Palette::Dark };
        for word in value("MGE_THEME").split([',', ' ']) {
            match word {
                "none" => depth = Depth::None,
                "256" => depth = Depth::Ansi256,
                "true" => depth = Depth::True,
                "braille" => marker = Marker::Braille,
                "ascii" => marker = ASCII,
                word => {
                    let word = word.replace("color", "colour");
                    palette = Palette::ALL.into_iter().find(|known| known.name() == word).unwrap_or(palette);
                }
            }
        }
        if !value("NO_COLOR").is_empty() {
            depth = Depth::None;
        }
        Self::new(palette, depth, marker)
    }

    /// The colour of a stage of guidance: subgoals in order, then the goal.
    pub fn stage(&self, stage: usize) -> Color {
        self.stages[stage % self.stages.len()]
    }

    /// A colour of the figures, lightened where it would be too dark for the terminal's background.
    pub fn visible(&self, colour: figures::Color) -> Color {
        let channels = [colour.0, colour.1, colour.2];
        let luminance = channels.iter().zip([0.21, 0.72, 0.07]).map(|(channel, share)| f32::from(*channel) * share);
        // Dark colours are moved halfway to white.
        let is_dark = self.palette != Palette::Light && luminance.sum::<f32>() < 64.0;
        let [r, g, b] = if is_dark { channels.map(|channel| channel / 2 + 127) } else { channels };
        self.fit(Color::Rgb(r, g, b))
    }

    /// Secondary text.
    pub fn faint(&self) -> Style {
        if self.depth == Depth::None { Style::new().add_modifier(Modifier::DIM) } else { Style::new().fg(self.dim) }
    }

    /// Titles and keys.
    pub fn strong(&self) -> Style {
        Style::new().fg(self.accent).add_modifier(Modifier::BOLD)
    }

    /// The selected row, tab or object.
    pub fn selected(&self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// The nearest colour that the terminal can show; named and indexed colours stay as they are.
    pub fn fit(&self, colour: Color) -> Color {
        fit(colour, self.depth)
    }

    /// The colour of the heat map for a value from 0 to 1. With 256 colours it is one of the greys: only these are close
    /// enough for a smooth ramp.
    pub fn heat(&self, share: f32) -> Color {
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        if self.depth == Depth::Ansi256 {
            let step = (share * 14.0).round() as u8;
            return Color::Indexed(if self.palette == Palette::Light { 255 - step } else { 232 + step });
        }
        let [low, high] = match self.palette {
            Palette::Light => [[245.0, 245.0, 255.0], [252.0, 165.0, 90.0]],
            _ => [[18.0, 20.0, 48.0], [170.0, 60.0, 40.0]],
        };
        let [r, g, b] = [0, 1, 2].map(|channel| (low[channel] + (high[channel] - low[channel]) * share) as u8);
        self.fit(Color::Rgb(r, g, b))
    }
}

/// The nearest colour at a depth; named and indexed colours stay as they are.
fn fit(colour: Color, depth: Depth) -> Color {
    match (colour, depth) {
        (Color::Rgb(..), Depth::None) => Color::Reset,
        (Color::Rgb(r, g, b), Depth::Ansi256) => Color::Indexed(rgb_to_xterm((r, g, b).into()).0),
        (colour, _) => colour,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A colour as seen without red (0) or green (1) cones, or with all (2): lightness, green to red, and blue to yellow
    /// in CIELAB. The matrices are those of Machado et al. (2009), at full severity.
    fn seen([r, g, b]: [u8; 3], vision: usize) -> [f64; 3] {
        const VISIONS: [[[f64; 3]; 3]; 3] = [
            [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
            [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ];
        const WHITE: [[f64; 3]; 3] = [[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0177, 0.1095, 0.8729]];
        let linear = [r, g, b].map(|channel| match f64::from(channel) / 255.0 {
            low if low <= 0.04045 => low / 12.92,
            high => ((high + 0.055) / 1.055).powf(2.4),
        });
        let times = |matrix: [[f64; 3]; 3], vector: [f64; 3]| {
            matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum::<f64>().clamp(0.0, 1.0))
        };
        let [x, y, z] = times(WHITE, times(VISIONS[vision], linear)).map(|value| match value {
            low if low <= 0.008856 => 7.787 * low + 16.0 / 116.0,
            high => high.cbrt(),
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn the_twelve_colours_of_runs_are_told_apart_with_every_colour_vision() {
        let names: Vec<String> = (0..12).map(|number| format!("run {number}")).collect();
        let series = figures::series(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let channels = |colour| match colour {
            Color::Rgb(r, g, b) => [r, g, b],
            Color::Indexed(grey @ 232..) => [8 + 10 * (grey - 232); 3],
            Color::Indexed(cube) => [(cube - 16) / 36, (cube - 16) / 6 % 6, (cube - 16) % 6]
                .map(|level| [0, 95, 135, 175, 215, 255][usize::from(level)]),
            other => panic!("{other:?}"),
        };
        for (palette, depth) in [Palette::Dark, Palette::Light]
            .map(|palette| [Depth::True, Depth::Ansi256].map(|depth| (palette, depth)))
            .concat()
        {
            let theme = Theme::new(palette, depth, ASCII);
            let shown: Vec<_> = series.iter().map(|look| channels(theme.visible(look.color))).collect();
            for vision in 0..3 {
                for (place, colour) in shown.iter().enumerate() {
                    for other in &shown[..place] {
                        let apart =
                            seen(*colour, vision).into_iter().zip(seen(*other, vision)).map(|(a, b)| (a - b).powi(2));
                        let apart = apart.sum::<f64>().sqrt();
                        assert!(apart > 12.0, "{colour:?} and {other:?}, vision {vision}, {depth:?}: {apart:.1}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_environment_determines_depth_palette_and_marker() {
        let from = |variables: &[(&str, &str)], is_light| {
            let of = |name: &str| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
            Theme::from_env(of, is_light)
        };
        type Case = (&'static [(&'static str, &'static str)], Depth, Palette, Marker);
        let cases: [Case; 18] = [
            (&[("COLORTERM", "truecolor")], Depth::True, Palette::Dark, Marker::Braille),
            (&[("TERM", "xterm-256color")], Depth::Ansi256, Palette::Dark, Marker::Braille),
            (&[("TERM", "linux")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("NO_COLOR", "1"), ("COLORTERM", "truecolor")], Depth::None, Palette::Dark, Marker::Braille),
            (&[("COLORFGBG", "0;15")], Depth::Ansi256, Palette::Light, Marker::Braille),
            (&[("LC_ALL", "C")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("LANG", "en_GB.UTF-8")], Depth::Ansi256, Palette::Dark, Marker::Braille),
            (&[("LANG", "de_DE.utf8@euro")], Depth::Ansi256, Palette::Dark, Marker::Braille),
            (&[("LC_CTYPE", "UTF-8"), ("LANG", "C")], Depth::Ansi256, Palette::Dark, Marker::Braille),
            (&[("LC_ALL", ""), ("LANG", "ja_JP.UTF-8")], Depth::Ansi256, Palette::Dark, Marker::Braille),
            (&[("LANG", "en_US.ISO-8859-1")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("LANG", "ja_JP.eucJP")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("LANG", "de_DE@euro")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("LC_ALL", "POSIX"), ("LANG", "de_DE.UTF-8")], Depth::Ansi256, Palette::Dark, ASCII),
            (&[("MGE_THEME", "light,256")], Depth::Ansi256, Palette::Light, Marker::Braille),
            (&[("MGE_THEME", "colour-blind,256,ascii")], Depth::Ansi256, Palette::ColourBlind, ASCII),
            (&[("MGE_THEME", "true")], Depth::True, Palette::Dark, Marker::Braille),
            (&[("MGE_THEME", "none"), ("COLORTERM", "24bit")], Depth::None, Palette::Dark, Marker::Braille),
        ];
        for (variables, depth, palette, marker) in cases {
            let theme = from(variables, None);
            assert_eq!((theme.depth, theme.palette, theme.marker), (depth, palette, marker), "{variables:?}");
        }
        let light = |variables| from(variables, Some(true)).palette;
        assert_eq!(light(&[("COLORFGBG", "15;0")]), Palette::Light, "the terminal itself knows better");
        assert_eq!(light(&[("MGE_THEME", "dark")]), Palette::Dark);
    }

    #[test]
    fn signs_have_a_replacement_in_ascii() {
        let mut buffer = Buffer::with_lines(["╭─● ball", "│··é★"]);
        Theme::new(Palette::Dark, Depth::True, ASCII).make_safe(&mut buffer);
        assert_eq!(buffer, Buffer::with_lines(["+-@ ball", "|--?*"]));
        assert_eq!(SIGNS[0].chars().count(), SIGNS[1].len());
    }

    #[test]
    fn colours_of_stages_repeat() {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        let stages = theme.stages;
        assert_eq!((0..7).map(|stage| theme.stage(stage)).collect::<Vec<_>>(), [&stages[..], &stages[..1]].concat());
    }

    #[test]
    fn titles_and_selections_stand_out() {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
        assert!(theme.strong().fg == Some(theme.accent) && theme.strong().add_modifier.contains(Modifier::BOLD));
        assert!(theme.selected().add_modifier.contains(Modifier::REVERSED));
    }

    #[test]
    fn runs_have_the_colours_of_the_figures_unless_these_are_too_dark() {
        let shown = |palette| {
            let theme = Theme::new(palette, Depth::True, Marker::Braille);
            let looks = figures::series(&["planning", "DDPG", "adaptive DDPG"]);
            looks.into_iter().map(|look| theme.visible(look.color)).collect::<Vec<_>>()
        };
        let blue = Color::Rgb(0, 114, 178);
        assert_eq!(shown(Palette::Light), [Color::Rgb(0, 0, 0), blue, Color::Rgb(0, 24, 240)]);
        assert_eq!(shown(Palette::Dark), [Color::Rgb(127, 127, 127), blue, Color::Rgb(127, 139, 247)]);
    }

    #[test]
    fn the_heat_map_goes_from_the_background_to_a_warm_colour() {
        let heat = |palette| {
            let theme = Theme::new(palette, Depth::True, Marker::Braille);
            [0.0, 0.5, 1.0].map(|share| theme.heat(share))
        };
        let dark = [Color::Rgb(18, 20, 48), Color::Rgb(94, 40, 44), Color::Rgb(170, 60, 40)];
        let light = [Color::Rgb(245, 245, 255), Color::Rgb(248, 205, 172), Color::Rgb(252, 165, 90)];
        assert_eq!([heat(Palette::Dark), heat(Palette::Light), heat(Palette::ColourBlind)], [dark, light, dark]);
    }

    #[test]
    fn colours_become_the_nearest_that_the_terminal_has() {
        let fitted = |depth| {
            let theme = Theme::new(Palette::Dark, depth, Marker::Braille);
            move |[r, g, b]: [u8; 3]| theme.fit(Color::Rgb(r, g, b))
        };
        let indexed = fitted(Depth::Ansi256);
        for (rgb, index) in [
            ([255, 0, 0], 196),
            ([95, 135, 175], 67),
            ([0, 0, 0], 16),
            ([4, 4, 4], 16),
            ([8, 8, 8], 232),
            ([118, 118, 118], 243),
            ([208, 208, 208], 252),
            ([255, 255, 255], 231),
        ] {
            assert_eq!(indexed(rgb), Color::Indexed(index), "{rgb:?}");
        }
        assert_eq!(fitted(Depth::True)([1, 2, 3]), Color::Rgb(1, 2, 3));
    }

    #[test]
    fn without_colour_the_terminals_defaults_are_used() {
        let theme = Theme::new(Palette::Dark, Depth::None, Marker::Braille);
        assert!([theme.ball, theme.goal, theme.bad, theme.heat(0.5)].iter().all(|colour| *colour == Color::Reset));
        assert!(theme.faint().add_modifier.contains(Modifier::DIM));
    }

    #[test]
    fn each_depth_uses_only_its_colours_and_keeps_meanings_distinct() {
        for palette in [Palette::Dark, Palette::Light, Palette::ColourBlind] {
            for depth in [Depth::Ansi256, Depth::True] {
                let theme = Theme::new(palette, depth, Marker::Braille);
                for colour in theme.stages.into_iter().chain([theme.ball, theme.goal, theme.bad]) {
                    let fits = match depth {
                        Depth::True => matches!(colour, Color::Rgb(..)),
                        _ => matches!(colour, Color::Indexed(16..)),
                    };
                    assert!(fits, "{palette:?} {depth:?} {colour:?}");
                }
                assert_ne!(theme.good, theme.bad);
                assert_ne!(theme.tool, theme.placed);
                assert_ne!(theme.stages[0], theme.stages[1]);
            }
        }
    }
}
