//! The drawing surface of figures: a page in points, whose shapes and texts plotters writes as SVG.

use std::cell::{Cell, RefCell};
use std::fmt::Display;

use plotters::prelude::{DrawingBackend, SVGBackend, ShapeStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontDesc, FontFamily, FontStyle, FontTransform, TextStyle};

use super::font::{self, Family};
use super::geometry::{Point, Rect};
use super::style::{Color, GREY, GRID, INK, LABEL_SIZE, SMALL_SIZE, TITLE_SIZE, WHITE};
use super::xml::characters;

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

/// Style and anchor of a text, which is vertically centred at its position.
#[derive(Clone, Copy)]
pub struct TextFormat {
    pub family: Family,
    pub size: f64,
    pub bold: bool,
    pub color: Color,
    pub anchor: HPos,
    /// Whether it is rotated to read upwards.
    pub rotated: bool,
}

impl TextFormat {
    /// Titles of panels.
    pub const TITLE: Self = Self { size: TITLE_SIZE, bold: true, ..Self::LABEL };
    /// Axis and legend labels.
    pub const LABEL: Self =
        Self { family: Family::Sans, size: LABEL_SIZE, bold: false, color: INK, anchor: HPos::Left, rotated: false };
    /// Ticks and notes.
    pub const SMALL: Self = Self { size: SMALL_SIZE, ..Self::LABEL };

    pub fn centered(self) -> Self {
        Self { anchor: HPos::Center, ..self }
    }

    pub fn right(self) -> Self {
        Self { anchor: HPos::Right, ..self }
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

/// A page in points, origin at the upper left. Shapes with a coordinate that is not finite are not drawn.
pub struct Canvas {
    /// The elements drawn so far.
    elements: RefCell<String>,
    page: Rect,
    /// Number of clipped groups so far.
    clips: Cell<usize>,
}

/// Coordinates of plotters are integers: this many are a point.
const PER_POINT: f64 = 100.0;
/// The SVG of plotters has text smaller by this factor.
const PLOTTERS_EM: f64 = 1.24;

/// The SVG of a page of `size` points, in which everything is magnified by `scale`; `head` is inserted after the
/// opening tag.
pub fn svg(size: [f64; 2], scale: f64, head: &str, draw: impl FnOnce(&Canvas)) -> String {
    let page = Rect::new(0.0, 0.0, size[0] / scale, size[1] / scale);
    let canvas = Canvas { elements: RefCell::default(), page, clips: Cell::default() };
    canvas.fill(&page.corners(), WHITE);
    draw(&canvas);
    let [wide, high] = size;
    let [width, height] = [page.right, page.bottom].map(written);
    format!(
        "<svg width=\"{wide}pt\" height=\"{high}pt\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n{head}{}</svg>\n",
        canvas.elements.into_inner()
    )
}

/// A coordinate or length for plotters, not farther from the page than any renderer can handle.
fn written(points: f64) -> i32 {
    const FAR: f64 = 1e4;
    (points.clamp(-FAR, FAR) * PER_POINT).round() as i32
}

impl Canvas {
    /// The whole page.
    pub fn page(&self) -> Rect {
        self.page
    }

    /// Appends what plotters draws.
    fn put<E: std::fmt::Debug>(&self, draw: impl FnOnce(&mut SVGBackend<'_>) -> Result<(), E>) {
        let mut text = String::new();
        // A string takes every element.
        draw(&mut SVGBackend::with_string(&mut text, (1, 1))).expect("an element");
        // Without the document around it.
        let (_, elements) = text.split_once(">\n").unwrap_or_default();
        self.elements.borrow_mut().push_str(elements.trim_end().trim_end_matches("</svg>"));
    }

    /// Draws in a group with these attributes.
    fn group(&self, attributes: impl Display, draw: impl FnOnce()) {
        *self.elements.borrow_mut() += &format!("<g {attributes}>\n");
        draw();
        *self.elements.borrow_mut() += "</g>\n";
    }

    /// A polyline.
    pub fn line(&self, points: &[Point], pen: Pen) {
        let style = ShapeStyle { color: pen.color, filled: false, stroke_width: written(pen.width).unsigned_abs() };
        let draw = || self.put(|backend| backend.draw_path(places(points), &style));
        match pen.dash {
            _ if points.len() < 2 || !is_finite(points) => (),
            [] => draw(),
            dash => {
                let lengths: Vec<String> = dash.iter().map(|length| written(*length).to_string()).collect();
                self.group(format_args!("stroke-dasharray=\"{}\"", lengths.join(",")), draw);
            }
        }
    }

    /// The outline of a polygon.
    pub fn outline(&self, corners: &[Point], pen: Pen) {
        let closed: Vec<Point> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, pen);
    }

    /// A filled polygon.
    pub fn fill(&self, corners: &[Point], color: Color) {
        if corners.len() >= 3 && is_finite(corners) {
            self.put(|backend| backend.fill_polygon(places(corners), &color));
        }
    }

    /// A filled dot.
    pub fn dot(&self, center: Point, radius: f64, color: Color) {
        if is_finite(&[center]) {
            let radius = written(radius).unsigned_abs();
            self.put(|backend| backend.draw_circle(place(center), radius, &color, true));
        }
    }

    /// Draws a shape around these points; what lies outside `rect` is cut off.
    pub fn within(&self, rect: &Rect, points: &[Point], draw: impl FnOnce(&[Point])) {
        if points.iter().all(|point| rect.contains(*point)) {
            return draw(points);
        }
        let clip = self.clips.replace(self.clips.get() + 1);
        let [x, y, width, height] = [rect.left, rect.top, rect.width(), rect.height()].map(written);
        let area = format_args!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>");
        *self.elements.borrow_mut() += &format!("<clipPath id=\"clip{clip}\">{area}</clipPath>\n");
        self.group(format_args!("clip-path=\"url(#clip{clip})\""), || draw(points));
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
    pub fn text(&self, position: Point, text: &str, look: TextFormat) {
        if !is_finite(&[position]) {
            return;
        }
        let weight = if look.bold { FontStyle::Bold } else { FontStyle::Normal };
        let size = look.size * PLOTTERS_EM * PER_POINT;
        let font = FontDesc::new(FontFamily::Name(look.family.name()), size, weight);
        let font = if look.rotated { font.transform(FontTransform::Rotate270) } else { font };
        let style = TextStyle::from(font).color(&look.color).pos(Pos::new(look.anchor, VPos::Center));
        self.put(|backend| backend.draw_text(&characters(text), &style, place(position)));
    }

    /// A placeholder with a message for an empty figure.
    pub fn placeholder(&self, rect: Rect, message: &str) {
        self.outline(&rect.corners(), Pen::new(GRID, 0.8));
        self.text(rect.center(), message, TextFormat::LABEL.centered().color(GREY));
    }
}

fn is_finite(points: &[Point]) -> bool {
    points.iter().flatten().all(|value| value.is_finite())
}

fn place([x, y]: Point) -> (i32, i32) {
    (written(x), written(y))
}

fn places(points: &[Point]) -> impl Iterator<Item = (i32, i32)> {
    points.iter().copied().map(place)
}
