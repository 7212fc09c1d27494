//! The bundled typefaces, the only fonts that figures use. System fonts are never looked up.

use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

use resvg::usvg::fontdb::{Database, Source};
use rustybuzz::{Face, UnicodeBuffer};

/// A typeface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// DejaVu Sans.
    Sans,
    /// DejaVu Sans Mono.
    Mono,
}

impl Family {
    /// The font family in SVG files: the bundled typeface if the reader has it installed, else a similar one.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sans => "DejaVu Sans, Verdana, sans-serif",
            Self::Mono => "DejaVu Sans Mono, monospace",
        }
    }
}

/// Each family, plain and bold.
const FILES: [&[u8]; 4] = [
    include_bytes!("../fonts/DejaVuSans.ttf"),
    include_bytes!("../fonts/DejaVuSans-Bold.ttf"),
    include_bytes!("../fonts/DejaVuSansMono.ttf"),
    include_bytes!("../fonts/DejaVuSansMono-Bold.ttf"),
];

static FACES: LazyLock<[Face<'static>; 4]> =
    // The files are compiled in, and every test that draws parses them.
    LazyLock::new(|| FILES.map(|file| Face::from_slice(file, 0).expect("a font")));

/// The fonts for rendering SVG.
pub static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    for file in FILES {
        fonts.load_font_source(Source::Binary(Arc::new(file)));
    }
    Arc::new(fonts)
});

/// The letters of `text` that the typefaces lack, each once.
pub fn lacking(text: &str) -> String {
    let is_drawn = |letter: char| letter.is_control() || FACES[0].glyph_index(letter).is_some();
    text.chars().filter(|letter| !is_drawn(*letter)).collect::<BTreeSet<char>>().into_iter().collect()
}

/// Width of `text` in em, shaped as the renderer shapes it.
pub fn width(text: &str, family: Family, bold: bool) -> f64 {
    let face = &FACES[2 * usize::from(family == Family::Mono) + usize::from(bold)];
    let mut buffer = UnicodeBuffer::new();
    buffer.push_str(text);
    let shaped = rustybuzz::shape(face, &[], buffer);
    let units: i32 = shaped.glyph_positions().iter().map(|glyph| glyph.x_advance).sum();
    f64::from(units) / f64::from(face.units_per_em())
}
