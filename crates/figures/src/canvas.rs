//! The drawing surface of figures: a page in points, written as SVG by plotters.

use std::cell::RefCell;

use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontDesc, FontFamily, FontStyle, FontTransform, TextStyle};
use plotters_backend::{BackendCoord, DrawingBackend};
use plotters_svg::SVGBackend;

use super::font::{self, Family};
use super::geometry::{Point, Rect, dashes};
use super::style::{Color, GREY, GRID, INK, LABEL_SIZE, SMALL_SIZE, TITLE_SIZE, WHITE};
use super::xml;

/// Backend coordinates per point. Backend coordinates are integers; one per point would be too coarse for hairlines.
const SCALE: f64 = 16.0;
/// The SVG backend of plotters divides text sizes by this factor.
const PLOTTERS_EM: f64 = 1.24;

/// Style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pen {
    pub color: Color,
    pub width: f64,
    /// Alternating lengths of dashes and gaps; empty for a solid line.
    pub dash: &'static [f64],
}

impl Pen {
    pub fn new(color: Color, width: f64) -> Self {
        Self { color, width, dash: &[] }
    }

    pub fn dashed(self, dash: &'static [f64]) -> Self {
        Self { dash, ..self }
    }
}

/// Style and anchor of a text.
#[derive(Clone, Copy)]
pub struct TextFormat {
    pub family: Family,
    pub size: f64,
    pub bold: bool,
    pub color: Color,
    pub horizontal: HPos,
    pub vertical: VPos,
    /// Whether it is rotated to read upwards.
    pub rotated: bool,
}

impl TextFormat {
    /// Titles of panels: left edge, vertically centred.
    pub const TITLE: Self = Self { size: TITLE_SIZE, bold: true, ..Self::LABEL };
    /// Axis and legend labels.
    pub const LABEL: Self = Self {
        family: Family::Sans,
        size: LABEL_SIZE,
        bold: false,
        color: INK,
        horizontal: HPos::Left,
        vertical: VPos::Center,
        rotated: false,
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

    pub fn rotated(self) -> Self {
        Self { rotated: true, ..self }
    }

    /// Width of `text` in points.
    pub fn width(&self, text: &str) -> f64 {
        font::width(text, self.family, self.bold) * self.size
    }
}

/// A page in points, origin at the upper left.
pub struct Canvas<'t> {
    backend: RefCell<SVGBackend<'t>>,
    page: Rect,
}

/// The SVG of a page of `size` points, in which everything is magnified by `scale`; `head` is inserted after the
/// opening tag.
pub fn svg(size: [f64; 2], scale: f64, head: &str, draw: impl FnOnce(&Canvas<'_>)) -> String {
    let [paper_width, paper_height] = size;
    let [width, height] = size.map(|side| side / scale);
    let (columns, rows) = ((width * SCALE).round() as u32, (height * SCALE).round() as u32);
    let mut text = String::new();
    let backend = RefCell::new(SVGBackend::with_string(&mut text, (columns, rows)));
    let canvas = Canvas { backend, page: Rect::new(0.0, 0.0, width, height) };
    canvas.fill(&canvas.page.corners(), WHITE);
    draw(&canvas);
    drop(canvas);
    // The backend gives the size in pixels and mitres every corner: set the size on paper, and round the joins.
    let plain = format!("width=\"{columns}\" height=\"{rows}\"");
    let ours = format!(
        "width=\"{paper_width}pt\" height=\"{paper_height}pt\" stroke-linejoin=\"round\" stroke-linecap=\"round\""
    );
    text.replacen(&plain, &ours, 1).replacen(">\n", &format!(">\n{head}"), 1)
}

impl Canvas<'_> {
    /// The whole page.
    pub fn page(&self) -> Rect {
        self.page
    }

    fn put<E: std::fmt::Debug>(&self, draw: impl FnOnce(&mut SVGBackend<'_>) -> Result<(), E>) {
        // The backend appends to a string, which cannot fail.
        draw(&mut self.backend.borrow_mut()).expect("a string takes every element");
    }

    /// A point in backend coordinates. Out-of-range and non-finite numbers saturate: data is clipped before it gets
    /// here, so such points could only lie off the page.
    fn place(point: Point) -> BackendCoord {
        ((point[0] * SCALE).round() as i32, (point[1] * SCALE).round() as i32)
    }

    fn map(points: &[Point]) -> impl Iterator<Item = BackendCoord> {
        points.iter().copied().map(Self::place)
    }

    /// A polyline.
    pub fn line(&self, points: &[Point], pen: Pen) {
        if !pen.dash.is_empty() {
            let solid = Pen { dash: &[], ..pen };
            return dashes(points, pen.dash).iter().for_each(|stroke| self.line(stroke, solid));
        }
        if points.len() >= 2 {
            let width = (pen.width * SCALE).round().max(1.0) as u32;
            self.put(|backend| backend.draw_path(Self::map(points), &pen.color.stroke_width(width)));
        }
    }

    /// The outline of a polygon.
    pub fn outline(&self, corners: &[Point], pen: Pen) {
        let closed: Vec<Point> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, pen);
    }

    /// A filled polygon.
    pub fn fill(&self, corners: &[Point], color: Color) {
        if corners.len() >= 3 {
            self.put(|backend| backend.fill_polygon(Self::map(corners), &color.filled()));
        }
    }

    /// A filled dot.
    pub fn dot(&self, center: Point, radius: f64, color: Color) {
        let radius = (radius * SCALE).round().max(1.0) as u32;
        self.put(|backend| backend.draw_circle(Self::place(center), radius, &color.filled(), true));
    }

    /// A line with an arrowhead at its end.
    pub fn arrow(&self, from: Point, to: Point, pen: Pen) {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        if length < 1e-6 {
            return;
        }
        let head = (2.5 + 2.0 * pen.width).min(length);
        let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let neck = [to[0] - head * along[0], to[1] - head * along[1]];
        let side = [-along[1] * head * 0.4, along[0] * head * 0.4];
        self.line(&[from, neck], pen);
        self.fill(&[to, [neck[0] + side[0], neck[1] + side[1]], [neck[0] - side[0], neck[1] - side[1]]], pen.color);
    }

    /// One line of text.
    pub fn text(&self, at: Point, text: &str, look: TextFormat) {
        let weight = if look.bold { FontStyle::Bold } else { FontStyle::Normal };
        let size = look.size * PLOTTERS_EM * SCALE;
        let font = FontDesc::new(FontFamily::Name(look.family.name()), size, weight);
        let font = if look.rotated { font.transform(FontTransform::Rotate270) } else { font };
        let style = TextStyle::from(font).color(&look.color).pos(Pos::new(look.horizontal, look.vertical));
        self.put(|backend| backend.draw_text(&xml::characters(text), &style, Self::place(at)));
    }

    /// A placeholder with a message for an empty figure.
    pub fn placeholder(&self, rect: Rect, message: &str) {
        self.outline(&rect.corners(), Pen::new(GRID, 0.8));
        self.text(rect.center(), message, TextFormat::LABEL.centered().color(GREY));
    }
}
