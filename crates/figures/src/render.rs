//! Renders the SVG of a page to pixels and PNG.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::error::{FigureError, MAX_SIDE};
use super::font::FONTS;
use super::provenance::Provenance;

/// Points per SVG unit, which is 1/96 inch.
pub const POINTS: f32 = 0.75;

/// The shapes of an SVG, with text as outlines of the bundled fonts.
///
/// # Errors
/// When the text is not valid SVG.
pub fn tree(svg: &str) -> Result<Tree, FigureError> {
    let options = Options { fontdb: FONTS.clone(), ..Options::default() };
    Tree::from_str(svg, &options).map_err(|error| FigureError::Encoding(error.to_string()))
}

/// The page as `width` x `height` pixels, rows of red, green, blue bytes.
///
/// # Errors
/// When the size is 0 or too large.
pub fn rgb(svg: &str, width: u32, height: u32) -> Result<Vec<u8>, FigureError> {
    draw(&tree(svg)?, width, height)
}

/// Checks that an image of this size is possible.
///
/// # Errors
/// When a side is 0 or too large.
pub fn check_size(width: u32, height: u32) -> Result<(), FigureError> {
    let fits = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if fits { Ok(()) } else { Err(FigureError::Size { width, height }) }
}

fn draw(tree: &Tree, width: u32, height: u32) -> Result<Vec<u8>, FigureError> {
    check_size(width, height)?;
    let mut pixels = Pixmap::new(width, height).ok_or(FigureError::Size { width, height })?;
    pixels.fill(resvg::tiny_skia::Color::WHITE);
    let size = tree.size();
    let scale = Transform::from_scale(width as f32 / size.width(), height as f32 / size.height());
    resvg::render(tree, scale, &mut pixels.as_mut());
    Ok(pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect())
}

/// Width and height in pixels of a page of `size` points at `dpi` dots per inch.
pub fn pixels(size: [f64; 2], dpi: u32) -> [u32; 2] {
    size.map(|points| (points / 72.0 * f64::from(dpi)).round() as u32)
}

/// The page as a PNG of `dpi` dots per inch that carries its provenance.
///
/// # Errors
/// When the resolution is 0 or too large.
pub fn png(svg: &str, provenance: &Provenance, dpi: u32) -> Result<Vec<u8>, FigureError> {
    let tree = tree(svg)?;
    let [width, height] = pixels([tree.size().width(), tree.size().height()].map(|side| f64::from(side * POINTS)), dpi);
    let image = draw(&tree, width, height)?;
    encode([width, height], &image, provenance, dpi).map_err(|error| FigureError::Encoding(error.to_string()))
}

fn encode(
    [width, height]: [u32; 2],
    pixels: &[u8],
    provenance: &Provenance,
    dpi: u32,
) -> Result<Vec<u8>, png::EncodingError> {
    const INCHES_PER_METRE: f64 = 39.370_078_74;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (f64::from(dpi) * INCHES_PER_METRE).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    provenance.describe(&mut encoder)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}
