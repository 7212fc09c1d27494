//! Output of figures as RGB, PNG and SVG, with the CSV beside them.

use std::path::Path;

use super::canvas::{Canvas, svg};
use super::curves::LearningCurves;
use super::error::FigureError;
use super::provenance::Provenance;
use super::render;
use super::table::Table;
use mge_base::atomic::{Format, Target};
use mge_base::paths::suffix;

/// The format of pictures: PNG and SVG with [`Provenance`].
pub const PICTURE: Format<'static> = Format { name: "a figure", is: &is_picture };

fn is_picture(found: &[u8]) -> bool {
    let has = |mark: &[u8]| found.windows(mark.len()).any(|part| part == mark);
    // As the first of the chunks of a provenance is written in each format.
    (found.starts_with(b"\x89PNG") && has(b"Software\0mge ")) || (found.starts_with(b"<svg") && has(b"Software: mge "))
}

/// File extensions of the supported formats.
pub const EXTENSIONS: [&str; 2] = ["png", "svg"];

/// A figure: data that can be drawn.
pub trait Figure {
    /// Width and height on paper, in points.
    fn size(&self) -> [f64; 2];

    /// Magnification of everything in it relative to other figures.
    fn scale(&self) -> f64 {
        1.0
    }

    /// Draws the figure on the whole page of `canvas`.
    fn draw(&self, canvas: &Canvas);

    /// Every number in the figure.
    fn table(&self) -> Table;

    /// The learning curves that it shows, for displays that draw them themselves.
    fn curves(&self) -> Option<&LearningCurves> {
        None
    }

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

    /// Writes the figure in the format of the file's extension (see [`EXTENSIONS`]), and its numbers to the same
    /// path with the extension `.csv`.
    ///
    /// # Errors
    /// When the extension is unknown, the resolution is impossible, or a file cannot be written or replaced; existing
    /// files then stay whole.
    fn write(&self, to: &Target, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let bytes = encode(&to.path, &self.to_svg(provenance), provenance, dpi)?;
        write_with_table(to, &bytes, &self.table())
    }

    /// Writes the figure in every format, named `name` in `folder`, and its numbers beside them.
    ///
    /// # Errors
    /// As [`Self::write`].
    fn write_all(&self, folder: &Target, name: &str, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let (page, table) = (self.to_svg(provenance), self.table());
        EXTENSIONS.iter().try_for_each(|extension| {
            // Not `with_extension`: a name may contain a dot.
            let to = folder.join(format!("{name}.{extension}"));
            write_with_table(&to, &encode(&to.path, &page, provenance, dpi)?, &table)
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
        _ => Err(FigureError::Format(path.to_owned())),
    }
}

/// Checks that figures of these names may be written into a folder by [`Figure::write_all`].
///
/// # Errors
/// When a file of another origin is in the way.
pub fn check_all(folder: &Target, names: &[&str]) -> Result<(), FigureError> {
    let files = names.iter().flat_map(|name| EXTENSIONS.map(|extension| folder.join(format!("{name}.{extension}"))));
    files.into_iter().try_for_each(|to| to.check(&PICTURE).map_err(|source| FigureError::io(&to.path, source)))
}

/// Writes a picture and the table beside it.
fn write_with_table(to: &Target, bytes: &[u8], table: &Table) -> Result<(), FigureError> {
    let beside = Target { path: to.path.with_extension("csv"), force: to.force };
    let text = table.to_csv();
    // A table has nothing that tells its origin but its columns. Those of learning curves name the chosen axis.
    let columns = |text: &[u8]| {
        let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let axes = ["environment_steps", "charged_actions", "actions"];
        axes.iter().fold(String::from_utf8_lossy(first).into_owned(), |text, axis| text.replace(axis, "episode"))
    };
    let has_columns = |found: &[u8]| columns(found) == columns(&text);
    let format = Format { name: "the table of such a figure", is: &has_columns };
    let of_picture = |source| FigureError::io(&to.path, source);
    to.check(&PICTURE).map_err(of_picture)?;
    beside.write(&text, &format).map_err(|source| FigureError::io(&beside.path, source))?;
    to.write(bytes, &PICTURE).map_err(of_picture)
}
