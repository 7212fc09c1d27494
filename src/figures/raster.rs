//! A plotters backend on tiny-skia: anti-aliased lines, fills and text.
//!
//! Backend coordinates are whole numbers, so one pixel is [`SUBPIXELS`] of them:
//! hairlines and positions keep their true size at screen resolution.

use std::convert::Infallible;

use ab_glyph::OutlineCurve;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontStyle,
    FontTransform,
};
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use super::font;

/// Backend coordinates per pixel.
pub const SUBPIXELS: u32 = 16;

/// Plotters gives text sizes in a box of 1.24 em (its SVG backend divides alike).
pub const PLOTTERS_EM: f64 = 1.24;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// An image that plotters draws on.
pub struct Raster<'p> {
    pixels: &'p mut Pixmap,
}

impl<'p> Raster<'p> {
    /// Clears `pixels` to white and draws on them.
    pub fn new(pixels: &'p mut Pixmap) -> Self {
        pixels.fill(tiny_skia::Color::WHITE);
        Self { pixels }
    }

    fn fill(&mut self, path: Option<Path>, color: BackendColor, rule: FillRule) -> Drawn {
        if let Some(path) = path {
            self.pixels.fill_path(&path, &paint(color), rule, Transform::identity(), None);
        }
        Ok(())
    }

    fn stroke<S: BackendStyle>(&mut self, path: Option<Path>, style: &S) -> Drawn {
        if let Some(path) = path {
            let stroke = Stroke {
                width: style.stroke_width() as f32 / SUBPIXELS as f32,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            self.pixels.stroke_path(&path, &paint(style.color()), &stroke, Transform::identity(), None);
        }
        Ok(())
    }
}

fn paint(color: BackendColor) -> Paint<'static> {
    let (r, g, b) = color.rgb;
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (color.alpha * 255.0).round() as u8);
    paint
}

fn pixel((x, y): BackendCoord) -> (f32, f32) {
    (x as f32 / SUBPIXELS as f32, y as f32 / SUBPIXELS as f32)
}

fn polyline(points: impl IntoIterator<Item = BackendCoord>, closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (n, point) in points.into_iter().enumerate() {
        let (x, y) = pixel(point);
        if n == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path.finish()
}

fn corners((x0, y0): BackendCoord, (x1, y1): BackendCoord) -> [BackendCoord; 4] {
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
}

/// The glyphs of `text` as one path, anchored as in the SVG backend: the ends of the
/// baseline, and heights in em.
fn glyphs<S: BackendTextStyle>(text: &str, style: &S, pos: BackendCoord) -> Option<Path> {
    let bold = matches!(style.style(), FontStyle::Bold);
    let size = style.size() / PLOTTERS_EM / f64::from(SUBPIXELS);
    let anchor = style.anchor();
    let left = -font::width(text, 1.0, bold)
        * match anchor.h_pos {
            HPos::Left => 0.0,
            HPos::Center => 0.5,
            HPos::Right => 1.0,
        };
    let drop = match anchor.v_pos {
        VPos::Top => 0.76,
        VPos::Center => 0.5 * X_HEIGHT,
        VPos::Bottom => -0.5 * X_HEIGHT,
    };
    let (x, y) = pixel(pos);
    let place = |point: ab_glyph::Point| {
        let (u, v) = ((f64::from(point.x) + left) * size, (drop - f64::from(point.y)) * size);
        let (u, v) = match style.transform() {
            FontTransform::None => (u, v),
            FontTransform::Rotate90 => (-v, u),
            FontTransform::Rotate180 => (-u, -v),
            FontTransform::Rotate270 => (v, -u),
        };
        (x + u as f32, y + v as f32)
    };
    let mut path = PathBuilder::new();
    let mut end = None;
    for curve in font::outline(text, bold) {
        let (first, last) = match curve {
            OutlineCurve::Line(a, b) => (a, b),
            OutlineCurve::Quad(a, _, c) => (a, c),
            OutlineCurve::Cubic(a, _, _, d) => (a, d),
        };
        if end != Some(first) {
            let (x, y) = place(first);
            path.move_to(x, y);
        }
        let (x, y) = place(last);
        match curve {
            OutlineCurve::Line(..) => path.line_to(x, y),
            OutlineCurve::Quad(_, b, _) => {
                let b = place(b);
                path.quad_to(b.0, b.1, x, y);
            }
            OutlineCurve::Cubic(_, b, c, _) => {
                let (b, c) = (place(b), place(c));
                path.cubic_to(b.0, b.1, c.0, c.1, x, y);
            }
        }
        end = Some(last);
    }
    path.finish()
}

/// Height of a small letter of the typeface, in em.
const X_HEIGHT: f64 = 0.547;

/// Rows of red, green, blue bytes of an opaque image.
pub fn rgb(pixels: &Pixmap) -> Vec<u8> {
    pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect()
}

impl DrawingBackend for Raster<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.pixels.width() * SUBPIXELS, self.pixels.height() * SUBPIXELS)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        self.fill(polyline(corners((x, y), (x + 1, y + 1)), true), color, FillRule::Winding)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.stroke(polyline([from, to], false), style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let path = polyline(corners(upper_left, bottom_right), true);
        if fill { self.fill(path, style.color(), FillRule::Winding) } else { self.stroke(path, style) }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        self.stroke(polyline(path, false), style)
    }

    fn draw_circle<S: BackendStyle>(&mut self, center: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        let (x, y) = pixel(center);
        let path = PathBuilder::from_circle(x, y, radius as f32 / SUBPIXELS as f32);
        if fill { self.fill(path, style.color(), FillRule::Winding) } else { self.stroke(path, style) }
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, vertices: I, style: &S) -> Drawn {
        self.fill(polyline(vertices, true), style.color(), FillRule::Winding)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, pos: BackendCoord) -> Drawn {
        self.fill(glyphs(text, style, pos), style.color(), FillRule::Winding)
    }
}
