//! What figures draw on: a plotters drawing area measured in points, whatever the
//! backend and the resolution.

use std::fmt::Display;

use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::element::{Circle, PathElement, Polygon, Text as TextElement};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontDesc, FontFamily, FontStyle, FontTransform, ShapeStyle, TextStyle};
use plotters_backend::DrawingBackend;

use super::FigureError;
use super::font;
use super::geometry::{Point, Rect, dashes};
use super::raster::PLOTTERS_EM;
use super::style::{Color, GREY, GRID, INK, LABEL_SIZE, SERIES, SMALL_SIZE, TITLE_SIZE, series_color};

type Drawn = Result<(), FigureError>;

/// The few things figures ask of a plotters area, whatever its backend. Every plotters
/// `DrawingArea` is one; each call fails when the backend does.
pub trait Surface {
    /// Width and height in backend coordinates.
    fn extent(&self) -> (u32, u32);
    /// An open polyline.
    fn path(&self, points: Vec<(i32, i32)>, style: ShapeStyle) -> Drawn;
    /// A filled polygon.
    fn polygon(&self, points: Vec<(i32, i32)>, style: ShapeStyle) -> Drawn;
    /// A filled circle.
    fn disc(&self, center: (i32, i32), radius: u32, style: ShapeStyle) -> Drawn;
    /// One line of text.
    fn text(&self, text: &str, at: (i32, i32), style: TextStyle<'_>) -> Drawn;
}

impl<DB: DrawingBackend> Surface for DrawingArea<DB, Shift> {
    fn extent(&self) -> (u32, u32) {
        self.dim_in_pixel()
    }

    fn path(&self, points: Vec<(i32, i32)>, style: ShapeStyle) -> Drawn {
        self.draw(&PathElement::new(points, style)).map_err(backend)
    }

    fn polygon(&self, points: Vec<(i32, i32)>, style: ShapeStyle) -> Drawn {
        self.draw(&Polygon::new(points, style)).map_err(backend)
    }

    fn disc(&self, center: (i32, i32), radius: u32, style: ShapeStyle) -> Drawn {
        self.draw(&Circle::new(center, radius, style)).map_err(backend)
    }

    fn text(&self, text: &str, at: (i32, i32), style: TextStyle<'_>) -> Drawn {
        self.draw(&TextElement::new(text, at, style)).map_err(backend)
    }
}

fn backend(error: impl Display) -> FigureError {
    FigureError::Backend(error.to_string())
}

/// How a line looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    pub color: Color,
    pub width: f64,
    /// Lengths drawn and left out, in turn.
    pub dash: Option<(f64, f64)>,
}

impl Pen {
    pub fn new(color: Color, width: f64) -> Self {
        Self { color, width, dash: None }
    }

    /// The line of the `index`-th compared thing: seven colours, drawn through, then dashed,
    /// then dotted, so that 21 things are told apart.
    pub fn series(index: usize, width: f64) -> Self {
        let pen = Self::new(series_color(index), width);
        match index / SERIES.len() % 3 {
            0 => pen,
            1 => pen.dashed(4.0, 2.0),
            _ => pen.dashed(1.0, 1.6),
        }
    }

    pub fn dashed(self, on: f64, off: f64) -> Self {
        Self { dash: Some((on, off)), ..self }
    }
}

/// How a text looks and which of its points is placed.
#[derive(Clone, Copy)]
pub struct Type {
    pub size: f64,
    pub bold: bool,
    pub color: Color,
    pub horizontal: HPos,
    pub vertical: VPos,
    /// Read from below upwards.
    pub upright: bool,
}

impl Type {
    /// Titles of panels: left edge, vertically centred.
    pub const TITLE: Self = Self { size: TITLE_SIZE, bold: true, ..Self::LABEL };
    /// Axis and legend labels.
    pub const LABEL: Self = Self {
        size: LABEL_SIZE,
        bold: false,
        color: INK,
        horizontal: HPos::Left,
        vertical: VPos::Center,
        upright: false,
    };
    /// Ticks and notes.
    pub const SMALL: Self = Self { size: SMALL_SIZE, ..Self::LABEL };

    pub fn centered(self) -> Self {
        Self { horizontal: HPos::Center, ..self }
    }

    pub fn right(self) -> Self {
        Self { horizontal: HPos::Right, ..self }
    }

    pub fn color(self, color: Color) -> Self {
        Self { color, ..self }
    }

    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub fn upright(self) -> Self {
        Self { upright: true, ..self }
    }

    /// Width of `text` in points.
    pub fn width(&self, text: &str) -> f64 {
        font::width(text, self.size, self.bold)
    }
}

/// A page in points, origin at the upper left.
pub struct Canvas<'a> {
    surface: &'a dyn Surface,
    scale: f64,
    page: Rect,
}

impl<'a> Canvas<'a> {
    /// The page on `surface` on which a figure of `size` (points) just fits.
    pub fn new(surface: &'a dyn Surface, size: [f64; 2]) -> Self {
        let (width, height) = surface.extent();
        let scale = (f64::from(width) / size[0]).min(f64::from(height) / size[1]);
        let page = Rect::new(0.0, 0.0, f64::from(width) / scale, f64::from(height) / scale);
        Self { surface, scale, page }
    }

    /// The whole page; at least as large as the figure.
    pub fn page(&self) -> Rect {
        self.page
    }

    fn map(&self, points: &[Point]) -> Vec<(i32, i32)> {
        // Out-of-range and non-finite numbers saturate: they never reach here from data,
        // which is clipped, and would only be drawn off the page.
        points.iter().map(|p| ((p[0] * self.scale).round() as i32, (p[1] * self.scale).round() as i32)).collect()
    }

    /// A polyline.
    pub fn line(&self, points: &[Point], pen: Pen) -> Drawn {
        if let Some((on, off)) = pen.dash {
            let solid = Pen { dash: None, ..pen };
            return dashes(points, on, off).iter().try_for_each(|stroke| self.line(stroke, solid));
        }
        if points.len() < 2 {
            return Ok(());
        }
        let width = (pen.width * self.scale).round().max(1.0) as u32;
        self.surface.path(self.map(points), pen.color.stroke_width(width))
    }

    /// The outline of a polygon.
    pub fn outline(&self, corners: &[Point], pen: Pen) -> Drawn {
        let closed: Vec<Point> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, pen)
    }

    /// A filled polygon.
    pub fn fill(&self, corners: &[Point], color: Color) -> Drawn {
        if corners.len() < 3 {
            return Ok(());
        }
        self.surface.polygon(self.map(corners), color.filled())
    }

    /// A filled dot.
    pub fn dot(&self, center: Point, radius: f64, color: Color) -> Drawn {
        let radius = (radius * self.scale).round().max(1.0) as u32;
        self.surface.disc(self.map(&[center])[0], radius, color.filled())
    }

    /// A line with a head at its end.
    pub fn arrow(&self, from: Point, to: Point, pen: Pen) -> Drawn {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        if length < 1e-6 {
            return Ok(());
        }
        let head = (2.5 + 2.0 * pen.width).min(length);
        let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let neck = [to[0] - head * along[0], to[1] - head * along[1]];
        let side = [-along[1] * head * 0.4, along[0] * head * 0.4];
        self.line(&[from, neck], pen)?;
        self.fill(&[to, [neck[0] + side[0], neck[1] + side[1]], [neck[0] - side[0], neck[1] - side[1]]], pen.color)
    }

    /// One line of text.
    pub fn text(&self, at: Point, text: &str, look: Type) -> Drawn {
        let style = TextStyle::from(font_of(look, look.size * PLOTTERS_EM * self.scale))
            .color(&look.color)
            .pos(Pos::new(look.horizontal, look.vertical));
        self.surface.text(text, self.map(&[at])[0], style)
    }

    /// What stands where there is nothing to show.
    pub fn nothing(&self, rect: Rect, message: &str) -> Drawn {
        self.outline(&rect.corners(), Pen::new(GRID, 0.8))?;
        self.text(rect.center(), message, Type::LABEL.centered().color(GREY))
    }
}

/// The plotters font of a look; `size` in backend coordinates.
fn font_of(look: Type, size: f64) -> FontDesc<'static> {
    let weight = if look.bold { FontStyle::Bold } else { FontStyle::Normal };
    let font = FontDesc::new(FontFamily::Name(font::FAMILY), size, weight);
    if look.upright { font.transform(FontTransform::Rotate270) } else { font }
}
