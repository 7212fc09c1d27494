//! A canvas of ratatui over cells of a screen, and the shapes that ratatui lacks.

use ratatui::prelude::*;
use ratatui::widgets::canvas::{Canvas, Context, Line, Painter, Points, Shape};

use crate::tui::widgets::theme::Marker;

/// A point in the coordinates of a canvas.
pub type Point = [f32; 2];

/// Number of corners of a drawn ellipse.
const CORNERS: usize = 64;

/// Paints over `area`, whose edges have the coordinates `bounds`, from left to right and from bottom to top. Cells
/// without a dot stay as they are.
pub fn draw(area: Rect, marker: Marker, bounds: [[f32; 2]; 2], buffer: &mut Buffer, paint: impl Fn(&mut Context)) {
    let [x, y] = bounds.map(|ends| ends.map(f64::from));
    let canvas = Canvas::default().marker(marker).x_bounds(x).y_bounds(y).paint(paint);
    canvas.render(area.intersection(buffer.area), buffer);
}

/// Draws single points; those that are not finite are left out.
pub fn dots(context: &mut Context, points: impl IntoIterator<Item = Point>, color: Color) {
    let finite = points.into_iter().filter(is_finite);
    let coords: Vec<(f64, f64)> = finite.map(|[x, y]| (x.into(), y.into())).collect();
    context.draw(&Points { coords: &coords, color });
}

/// Draws a line through points; those that are not finite are gaps.
pub fn path(context: &mut Context, points: &[Point], color: Color) {
    // A point between two gaps is a dot.
    dots(context, points.iter().copied(), color);
    for pair in points.windows(2).filter(|pair| pair.iter().all(is_finite)) {
        let [[x1, y1], [x2, y2]] = [pair[0], pair[1]].map(|end| end.map(f64::from));
        context.draw(&Line { x1, y1, x2, y2, color });
    }
}

/// Draws the outline of a closed polygon.
pub fn outline(context: &mut Context, corners: &[Point], color: Color) {
    path(context, corners, color);
    if let [first, .., last] = corners {
        path(context, &[*last, *first], color);
    }
}

/// Draws a filled polygon with its outline.
pub fn fill(context: &mut Context, corners: &[Point], color: Color) {
    if corners.iter().all(is_finite) {
        context.draw(&Inside { corners, color });
    }
    outline(context, corners, color);
}

/// The corners of an axis-aligned ellipse.
pub fn ellipse(centre: Point, radii: [f32; 2]) -> Vec<Point> {
    let corner = |index: usize| {
        let (sin, cos) = (index as f32 / CORNERS as f32 * std::f32::consts::TAU).sin_cos();
        [centre[0] + radii[0] * cos, centre[1] + radii[1] * sin]
    };
    (0..CORNERS).map(corner).collect()
}

fn is_finite(point: &Point) -> bool {
    point.iter().all(|value| value.is_finite())
}

/// The inside of a polygon, by rows of dots.
struct Inside<'a> {
    corners: &'a [Point],
    color: Color,
}

impl Shape for Inside<'_> {
    fn draw(&self, painter: &mut Painter) {
        let ([left, right], [bottom, top]) = painter.bounds();
        let (left, right, bottom, top) = (*left, *right, *bottom, *top);
        let Some((last, lowest)) = painter.get_point(right, bottom) else { return };
        let column = |x: f64| (x - left) / (right - left) * last as f64;
        for row in 0..=lowest {
            let y = top - (top - bottom) * row as f64 / lowest.max(1) as f64;
            let mut crossings: Vec<f64> = Vec::new();
            for (index, from) in self.corners.iter().enumerate() {
                let to = self.corners[(index + 1) % self.corners.len()];
                let [[x1, y1], [x2, y2]] = [*from, to].map(|end| end.map(f64::from));
                if (y1 <= y) != (y2 <= y) {
                    crossings.push(x1 + (y - y1) / (y2 - y1) * (x2 - x1));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let [first, end] = [column(pair[0]).ceil().max(0.0), column(pair[1]).floor().min(last as f64) + 1.0];
                (first as usize..end.max(0.0) as usize).for_each(|x| painter.paint(x, row, self.color));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::ASCII;

    /// The symbols of four by two cells; dots have the coordinates of their indices, from the lower left.
    fn drawn(marker: Marker, paint: impl Fn(&mut Context)) -> Vec<String> {
        let area = Rect::new(0, 0, 4, 2);
        let mut buffer = Buffer::empty(area);
        draw(area, marker, [[0.0, 7.0], [0.0, 7.0]], &mut buffer, paint);
        (0..2).map(|y| (0..4).map(|x| buffer[(x, y)].symbol().to_owned()).collect()).collect()
    }

    #[test]
    fn lines_are_clipped_and_have_gaps() {
        let lines = drawn(Marker::Braille, |context| path(context, &[[-100.0, 7.0], [100.0, 7.0]], Color::Red));
        assert_eq!(lines, ["⠉⠉⠉⠉", "    "]);
        let gap = [[0.0, 7.0], [1.0, f32::NAN], [2.0, 7.0], [f32::INFINITY, 0.0], [6.0, 0.0], [7.0, 0.0]];
        assert_eq!(drawn(Marker::Braille, |context| path(context, &gap, Color::Red)), ["⠁⠁  ", "   ⣀"]);
    }

    #[test]
    fn filled_shapes_cover_their_inside_in_each_marker_set() {
        let all = |context: &mut Context| fill(context, &[[0.0, 0.0], [7.0, 0.0], [7.0, 7.0], [0.0, 7.0]], Color::Blue);
        assert_eq!(drawn(Marker::Braille, all), ["⣿⣿⣿⣿", "⣿⣿⣿⣿"]);
        assert_eq!(drawn(ASCII, all), ["****", "****"]);
        let beyond =
            |context: &mut Context| fill(context, &[[-9.0, 4.0], [3.0, 4.0], [3.0, 99.0], [-9.0, 99.0]], Color::Red);
        assert_eq!(drawn(Marker::Braille, beyond), ["⣿⣿  ", "    "]);
    }

    #[test]
    fn a_tiny_ellipse_is_still_one_dot_and_one_that_is_not_finite_none() {
        let ellipse =
            |centre, radii| drawn(Marker::Braille, move |context| fill(context, &ellipse(centre, radii), Color::Red));
        assert_eq!(ellipse([0.0, 0.0], [0.1; 2]), ["    ", "⡀   "]);
        assert_eq!(ellipse([f32::NAN, 1.0], [2.0; 2]), ["    ", "    "]);
        assert_eq!(ellipse([1.0; 2], [f32::NAN; 2]), ["    ", "    "]);
    }
}
