//! The drawing surface of figures: a page in points, written as SVG.

use std::cell::{Cell, RefCell};
use std::fmt::Write as _;

use super::font::{self, Family};
use super::geometry::{Point, Rect};
use super::style::{Color, GREY, GRID, INK, LABEL_SIZE, SMALL_SIZE, TITLE_SIZE, WHITE};
use super::xml::escaped;

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

/// The part of a text that is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// Style and anchor of a text, which is vertically centred at its position.
#[derive(Debug, Clone, Copy)]
pub struct TextFormat {
    pub family: Family,
    pub size: f64,
    pub bold: bool,
    pub color: Color,
    pub anchor: Anchor,
    /// Whether it is rotated to read upwards.
    pub rotated: bool,
}

impl TextFormat {
    /// Titles of panels.
    pub const TITLE: Self = Self { size: TITLE_SIZE, bold: true, ..Self::LABEL };
    /// Axis and legend labels.
    pub const LABEL: Self =
        Self { family: Family::Sans, size: LABEL_SIZE, bold: false, color: INK, anchor: Anchor::Start, rotated: false };
    /// Ticks and notes.
    pub const SMALL: Self = Self { size: SMALL_SIZE, ..Self::LABEL };

    pub fn centered(self) -> Self {
        Self { anchor: Anchor::Middle, ..self }
    }

    pub fn right(self) -> Self {
        Self { anchor: Anchor::End, ..self }
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

/// The SVG of a page of `size` points, in which everything is magnified by `scale`; `head` is inserted after the
/// opening tag.
pub fn svg(size: [f64; 2], scale: f64, head: &str, draw: impl FnOnce(&Canvas)) -> String {
    let [width, height] = size.map(|side| side / scale);
    let page = Rect::new(0.0, 0.0, width, height);
    let canvas = Canvas { elements: RefCell::default(), page, clips: Cell::default() };
    canvas.fill(&page.corners(), WHITE);
    draw(&canvas);
    let [wide, high] = size;
    format!(
        "<svg width=\"{wide}pt\" height=\"{high}pt\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n{head}{}</svg>\n",
        canvas.elements.into_inner()
    )
}

/// A coordinate or length as written: in hundredths of a point, not farther from the page than any renderer can handle.
fn written(points: f64) -> f64 {
    const FAR: f64 = 1e4;
    // Adding 0 turns a negative zero into a positive one.
    (points.clamp(-FAR, FAR) * 100.0).round() / 100.0 + 0.0
}

/// The attributes of a colour that fills a shape or strokes a line.
fn paint(name: &str, Color(red, green, blue, opacity): Color) -> String {
    let color = format!("{name}=\"#{red:02X}{green:02X}{blue:02X}\"");
    if opacity < 1.0 { format!("{color} {name}-opacity=\"{opacity}\"") } else { color }
}

impl Canvas {
    /// The whole page.
    pub fn page(&self) -> Rect {
        self.page
    }

    fn put(&self, element: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.elements.borrow_mut(), "{element}");
    }

    /// A polyline or polygon, unless it is invisible.
    fn path(&self, name: &str, points: &[Point], Color(.., opacity): Color, style: &str) {
        if opacity > 0.0 && points.iter().flatten().all(|value| value.is_finite()) {
            let places: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", written(*x), written(*y))).collect();
            self.put(format_args!("<{name} {style} points=\"{}\"/>", places.join(" ")));
        }
    }

    /// A polyline.
    pub fn line(&self, points: &[Point], pen: Pen) {
        if points.len() < 2 {
            return;
        }
        let mut style = format!("fill=\"none\" {} stroke-width=\"{}\"", paint("stroke", pen.color), pen.width);
        if !pen.dash.is_empty() {
            let lengths: Vec<String> = pen.dash.iter().map(f64::to_string).collect();
            style += &format!(" stroke-dasharray=\"{}\"", lengths.join(","));
        }
        self.path("polyline", points, pen.color, &style);
    }

    /// The outline of a polygon.
    pub fn outline(&self, corners: &[Point], pen: Pen) {
        let closed: Vec<Point> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, pen);
    }

    /// A filled polygon.
    pub fn fill(&self, corners: &[Point], color: Color) {
        if corners.len() >= 3 {
            self.path("polygon", corners, color, &paint("fill", color));
        }
    }

    /// A filled dot.
    pub fn dot(&self, [x, y]: Point, radius: f64, color: Color) {
        if x.is_finite() && y.is_finite() {
            let [x, y, radius] = [x, y, radius].map(written);
            self.put(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {}/>", paint("fill", color)));
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
        self.put(format_args!("<clipPath id=\"clip{clip}\">{area}</clipPath>\n<g clip-path=\"url(#clip{clip})\">"));
        draw(points);
        self.put(format_args!("</g>"));
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
    pub fn text(&self, [x, y]: Point, text: &str, look: TextFormat) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        let anchor = match look.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let ([x, y, size], family, color) =
            ([x, y, look.size].map(written), look.family.name(), paint("fill", look.color));
        let weight = if look.bold { " font-weight=\"bold\"" } else { "" };
        let turn = if look.rotated { format!(" transform=\"rotate(270, {x}, {y})\"") } else { String::new() };
        let place = format_args!("x=\"{x}\" y=\"{y}\" dy=\"0.5ex\" text-anchor=\"{anchor}\"");
        let font = format_args!("font-family=\"{family}\" font-size=\"{size}\" {color}{weight}{turn}");
        self.put(format_args!("<text {place} {font}>\n{}\n</text>", escaped(text)));
    }

    /// A placeholder with a message for an empty figure.
    pub fn placeholder(&self, rect: Rect, message: &str) {
        self.outline(&rect.corners(), Pen::new(GRID, 0.8));
        self.text(rect.center(), message, TextFormat::LABEL.centered().color(GREY));
    }
}
