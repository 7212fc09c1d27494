//! Output of figures as RGB, PNG, SVG and PDF, with the CSV beside them.

use std::path::Path;

use super::canvas::{Canvas, svg};
use super::error::FigureError;
use super::pdf::pdf;
use super::provenance::Provenance;
use super::render;
use super::table::Table;
use crate::paths::suffix;

/// File extensions of the supported formats.
pub const EXTENSIONS: [&str; 3] = ["png", "svg", "pdf"];

/// A figure: data that can be drawn.
pub trait Figure {
    /// Width and height on paper, in points.
    fn size(&self) -> [f64; 2];

    /// Magnification of everything in it relative to other figures.
    fn scale(&self) -> f64 {
        1.0
    }

    /// Draws the figure on the whole page of `canvas`.
    fn draw(&self, canvas: &Canvas<'_>);

    /// Every number in the figure.
    fn table(&self) -> Table;

    /// The figure as `width` x `height` pixels, rows of red, green, blue bytes. It is scaled to fit; the panels grow
    /// into the remaining space.
    ///
    /// # Errors
    /// When the size is 0 or too large.
    fn to_rgb(&self, width: u32, height: u32) -> Result<Vec<u8>, FigureError> {
        render::check_size(width, height)?;
        let (size, pixels) = (self.size(), [f64::from(width), f64::from(height)]);
        let points = (pixels[0] / size[0]).min(pixels[1] / size[1]);
        let page = svg(pixels.map(|side| side / points), self.scale(), "", |canvas| self.draw(canvas));
        render::rgb(&page, width, height)
    }

    /// The figure as SVG that carries its provenance.
    fn to_svg(&self, provenance: &Provenance) -> String {
        svg(self.size(), self.scale(), &provenance.to_svg(), |canvas| self.draw(canvas))
    }

    /// Writes the figure to `path` in the format of its extension (see [`EXTENSIONS`]), and its numbers to the same
    /// path with the extension `.csv`.
    ///
    /// # Errors
    /// When the extension is unknown, the resolution is impossible, or a file cannot be written; existing files then
    /// stay whole.
    fn write(&self, path: &Path, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let bytes = encode(path, &self.to_svg(provenance), provenance, dpi)?;
        write_with_table(path, &bytes, &self.table())
    }

    /// Writes the figure in every format, named `name` in `folder`, and its numbers beside them.
    ///
    /// # Errors
    /// As [`Self::write`].
    fn write_all(&self, folder: &Path, name: &str, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let (page, table) = (self.to_svg(provenance), self.table());
        EXTENSIONS.iter().try_for_each(|extension| {
            // Not `with_extension`: a name may contain a dot.
            let path = folder.join(format!("{name}.{extension}"));
            write_with_table(&path, &encode(&path, &page, provenance, dpi)?, &table)
        })
    }
}

/// Encodes the SVG of a page in the format given by the extension of `path`.
///
/// # Errors
/// When the extension is not one of [`EXTENSIONS`], or the resolution is 0 or too large.
pub fn encode(path: &Path, svg: &str, provenance: &Provenance, dpi: u32) -> Result<Vec<u8>, FigureError> {
    match suffix(path).as_str() {
        "png" => render::png(svg, provenance, dpi),
        "svg" => Ok(svg.as_bytes().to_vec()),
        "pdf" => pdf(svg, provenance),
        _ => Err(FigureError::Format { path: path.to_owned(), known: "`.png`, `.svg` or `.pdf`" }),
    }
}

/// Writes `bytes` to `path` and the table beside it.
pub(super) fn write_with_table(path: &Path, bytes: &[u8], table: &Table) -> Result<(), FigureError> {
    let beside = path.with_extension("csv");
    crate::atomic::write(&beside, &table.to_csv()).map_err(|source| FigureError::io(&beside, source))?;
    crate::atomic::write(path, bytes).map_err(|source| FigureError::io(path, source))
}
