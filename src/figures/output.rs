//! From a figure to bytes and files: RGB, PNG, SVG, and the CSV beside.

use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters_backend::DrawingBackend;
use plotters_svg::SVGBackend;
use tiny_skia::Pixmap;

use super::canvas::{Canvas, Surface};
use super::provenance::Provenance;
use super::raster::{Raster, rgb};
use super::style::WHITE;
use super::table::Table;

/// Why a figure could not be drawn, written or read.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// The drawing backend failed.
    #[error("drawing failed: {0}")]
    Backend(String),
    /// No image of that size can be held.
    #[error(
        "an image of {width} x {height} pixels cannot be drawn: ask for a size from 1 to {MAX_SIDE} or a lower resolution"
    )]
    Size { width: u32, height: u32 },
    /// The name of the file says neither PNG nor SVG (nor GIF for animations).
    #[error("{}: figures are written as {known}: give the file one of these endings", path.display())]
    Format { path: PathBuf, known: &'static str },
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// The file is not one this program wrote.
    #[error("{}: {message}", path.display())]
    Unreadable { path: PathBuf, message: String },
}

impl FigureError {
    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }
}

/// Largest side of an image in pixels.
const MAX_SIDE: u32 = 20_000;
/// Points in an inch.
const POINTS_PER_INCH: f64 = 72.0;
/// Coordinates of an SVG per point.
const SVG_SCALE: f64 = 16.0;

/// A figure: numbers that know how to be drawn.
pub trait Figure {
    /// Name of the figure as the stem of a file name.
    fn name(&self) -> &'static str;

    /// Width and height on paper, in points.
    fn size(&self) -> [f64; 2];

    /// Draws the figure on the whole page of `canvas`.
    ///
    /// # Errors
    /// When the backend fails.
    fn draw(&self, canvas: &Canvas<'_>) -> Result<(), FigureError>;

    /// Every number in the figure.
    fn table(&self) -> Table;

    /// The figure as `width` x `height` pixels, rows of red, green, blue bytes. It is
    /// scaled to fit; what is left over is used by the panels.
    ///
    /// # Errors
    /// When the size is 0 or too large.
    fn to_rgb(&self, width: u32, height: u32) -> Result<Vec<u8>, FigureError> {
        rasterise(width, height, self.size(), |canvas| self.draw(canvas))
    }

    /// The figure as a PNG of `dpi` dots per inch that carries its provenance.
    ///
    /// # Errors
    /// When the resolution is 0 or too large.
    fn to_png(&self, provenance: &Provenance, dpi: u32) -> Result<Vec<u8>, FigureError> {
        let [width, height] = pixels(self.size(), dpi);
        let pixels = self.to_rgb(width, height)?;
        encode_png(&pixels, width, height, provenance, dpi).map_err(|error| FigureError::Backend(error.to_string()))
    }

    /// The figure as SVG that carries its provenance.
    ///
    /// # Errors
    /// When the backend fails.
    fn to_svg(&self, provenance: &Provenance) -> Result<String, FigureError> {
        let [width, height] = self.size();
        let (columns, rows) = ((width * SVG_SCALE).round() as u32, (height * SVG_SCALE).round() as u32);
        let mut text = String::new();
        draw_on(SVGBackend::with_string(&mut text, (columns, rows)).into_drawing_area(), self.size(), |canvas| {
            self.draw(canvas)
        })?;
        // The backend counts its coordinates as pixels and mitres every corner: say the
        // size on paper and round the joins, as the PNG does.
        let plain = format!("width=\"{columns}\" height=\"{rows}\"");
        let ours =
            format!("width=\"{width}pt\" height=\"{height}pt\" stroke-linejoin=\"round\" stroke-linecap=\"round\"");
        let text = text.replacen(&plain, &ours, 1);
        Ok(match text.find(">\n") {
            Some(end) => format!("{}{}{}", &text[..end + 2], provenance.to_svg(), &text[end + 2..]),
            None => text,
        })
    }

    /// Writes the figure to `path` (PNG or SVG by its ending) and its numbers beside it
    /// with the ending `.csv`.
    ///
    /// # Errors
    /// When the ending is another one, the resolution is impossible, or a file cannot be
    /// written; a file that was there before is then still whole.
    fn write(&self, path: &Path, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let bytes = match path.extension().and_then(|ending| ending.to_str()) {
            Some("png") => self.to_png(provenance, dpi)?,
            Some("svg") => self.to_svg(provenance)?.into_bytes(),
            _ => return Err(FigureError::Format { path: path.to_owned(), known: "`.png` or `.svg`" }),
        };
        write_with_table(path, &bytes, &self.table())
    }

    /// Writes the figure as PNG and as SVG, named `name` in `folder`, and its numbers beside them.
    ///
    /// # Errors
    /// As [`Self::write`].
    fn write_both(&self, folder: &Path, name: &str, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        ["png", "svg"].iter().try_for_each(|ending| {
            // Not `with_extension`: a name may have a dot in it.
            self.write(&folder.join(format!("{name}.{ending}")), provenance, dpi)
        })
    }
}

/// Width and height in pixels of a page of `size` points.
pub(super) fn pixels(size: [f64; 2], dpi: u32) -> [u32; 2] {
    size.map(|points| (points / POINTS_PER_INCH * f64::from(dpi)).round() as u32)
}

/// Writes `bytes` to `path` and the table beside it.
pub(super) fn write_with_table(path: &Path, bytes: &[u8], table: &Table) -> Result<(), FigureError> {
    let beside = path.with_extension("csv");
    crate::atomic::write(&beside, &table.to_csv()).map_err(|source| FigureError::io(&beside, source))?;
    crate::atomic::write(path, bytes).map_err(|source| FigureError::io(path, source))
}

/// Draws a page of `size` points on `width` x `height` pixels.
pub(super) fn rasterise(
    width: u32,
    height: u32,
    size: [f64; 2],
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), FigureError>,
) -> Result<Vec<u8>, FigureError> {
    let fits = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    let pixels = if fits { Pixmap::new(width, height) } else { None };
    let mut pixels = pixels.ok_or(FigureError::Size { width, height })?;
    draw_on(Raster::new(&mut pixels).into_drawing_area(), size, draw)?;
    Ok(rgb(&pixels))
}

fn draw_on<DB: DrawingBackend>(
    area: DrawingArea<DB, Shift>,
    size: [f64; 2],
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), FigureError>,
) -> Result<(), FigureError> {
    let failed = |error: &dyn std::fmt::Display| FigureError::Backend(error.to_string());
    area.fill(&WHITE).map_err(|error| failed(&error))?;
    draw(&Canvas::new(&area as &dyn Surface, size))?;
    area.present().map_err(|error| failed(&error))
}

fn encode_png(
    pixels: &[u8],
    width: u32,
    height: u32,
    provenance: &Provenance,
    dpi: u32,
) -> Result<Vec<u8>, png::EncodingError> {
    const INCHES_PER_METRE: f64 = 39.370_078_74;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Default);
    let per_metre = (f64::from(dpi) * INCHES_PER_METRE).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    provenance.describe(&mut encoder)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}
