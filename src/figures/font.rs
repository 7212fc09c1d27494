//! The bundled typeface: outlines and widths of text. No system font is ever looked up.

use std::sync::LazyLock;

use ab_glyph::{Font as _, FontRef, GlyphId, OutlineCurve};

/// The family as SVG readers see it: ours when installed, else the nearest.
pub const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

static REGULAR: LazyLock<FontRef<'static>> =
    // The file is part of the program; every test that draws parses it.
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("../../assets/fonts/DejaVuSans.ttf")).expect("a font"));
static BOLD: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    // As above.
    FontRef::try_from_slice(include_bytes!("../../assets/fonts/DejaVuSans-Bold.ttf")).expect("a font")
});

fn font(bold: bool) -> &'static FontRef<'static> {
    if bold { &BOLD } else { &REGULAR }
}

/// Glyphs of `text` with the place of each on the baseline, and the end of the last,
/// all in units of the font's size (em).
fn layout(text: &str, bold: bool) -> (Vec<(GlyphId, f32)>, f32) {
    let font = font(bold);
    let em = font.units_per_em().unwrap_or(1.0);
    let (mut x, mut previous) = (0.0, None);
    let mut glyphs = Vec::with_capacity(text.len());
    for character in text.chars() {
        let glyph = font.glyph_id(character);
        if let Some(previous) = previous {
            x += font.kern_unscaled(previous, glyph) / em;
        }
        glyphs.push((glyph, x));
        x += font.h_advance_unscaled(glyph) / em;
        previous = Some(glyph);
    }
    (glyphs, x)
}

/// Width of `text` at `size`, in the unit of `size`.
pub fn width(text: &str, size: f64, bold: bool) -> f64 {
    f64::from(layout(text, bold).1) * size
}

/// The outline curves of `text`, x to the right and y up, in em, from the start of the
/// baseline.
pub fn outline(text: &str, bold: bool) -> Vec<OutlineCurve> {
    let font = font(bold);
    let em = font.units_per_em().unwrap_or(1.0);
    let mut curves = Vec::new();
    for (glyph, shift) in layout(text, bold).0 {
        let Some(outline) = font.outline(glyph) else { continue };
        let at = |point: ab_glyph::Point| ab_glyph::point(point.x / em + shift, point.y / em);
        curves.extend(outline.curves.iter().map(|curve| match *curve {
            OutlineCurve::Line(a, b) => OutlineCurve::Line(at(a), at(b)),
            OutlineCurve::Quad(a, b, c) => OutlineCurve::Quad(at(a), at(b), at(c)),
            OutlineCurve::Cubic(a, b, c, d) => OutlineCurve::Cubic(at(a), at(b), at(c), at(d)),
        }));
    }
    curves
}
