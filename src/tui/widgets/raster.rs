//! Dots over terminal cells: what scene, curves and schedules are drawn with. It is ratatui's canvas,
//! with the shapes that it lacks.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::widgets::Widget;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};

use crate::tui::widgets::theme::Marker;

/// Dots over an area of cells. Later dots win the colour of their cell.
pub struct Raster<'a, 'b> {
    context: &'a mut Context<'b>,
    size: [f32; 2],
}

/// A point in dots, from the upper left corner of the area.
pub type Dot = [f32; 2];

/// Paints dots over `area`; cells without a dot stay as they are.
pub fn draw(area: Rect, marker: Marker, buffer: &mut Buffer, paint: impl Fn(&mut Raster)) {
    let [x, y] = marker.dots();
    let size = [f32::from(area.width * x), f32::from(area.height * y)];
    let bounds = size.map(|dots| [0.0, f64::from(dots)]);
    let canvas = Canvas::default().marker(marker.symbol()).x_bounds(bounds[0]).y_bounds(bounds[1]);
    canvas.paint(|context| paint(&mut Raster { context, size })).render(area, buffer);
}

impl Raster<'_, '_> {
    /// Width and height in dots.
    pub fn size(&self) -> [f32; 2] {
        self.size
    }

    /// The middle of the dot that contains `at`, on the canvas, whose second axis points up. None if
    /// it is nowhere.
    fn place(&self, at: Dot) -> Option<(f64, f64)> {
        let [x, y] = at.map(|value| f64::from(value.floor()) + 0.5);
        (x.is_finite() && y.is_finite()).then(|| (x, f64::from(self.size[1]) - y))
    }

    /// What is painted from now on has its cells for itself: dots before are gone from them.
    pub fn layer(&mut self) {
        self.context.layer();
    }

    /// Sets the dots that contain these points; outside of the area nothing happens.
    pub fn points(&mut self, points: impl IntoIterator<Item = Dot>, colour: Color) {
        let coords: Vec<(f64, f64)> = points.into_iter().filter_map(|point| self.place(point)).collect();
        self.context.draw(&Points::new(&coords, colour));
    }

    /// A straight line, clipped to the area.
    pub fn line(&mut self, from: Dot, to: Dot, colour: Color) {
        if let (Some((x1, y1)), Some((x2, y2))) = (self.place(from), self.place(to)) {
            self.context.draw(&Line::new(x1, y1, x2, y2, colour));
        }
    }

    /// The outline of a closed polygon.
    pub fn outline(&mut self, corners: &[Dot], colour: Color) {
        for (index, corner) in corners.iter().enumerate() {
            self.line(*corner, corners[(index + 1) % corners.len()], colour);
        }
    }

    /// The inside of a convex or concave polygon, by scan lines, and its outline.
    pub fn fill(&mut self, corners: &[Dot], colour: Color) {
        for y in 0..self.size[1] as usize {
            let middle = y as f32 + 0.5;
            let mut crossings: Vec<f32> = Vec::with_capacity(4);
            for (index, a) in corners.iter().enumerate() {
                let b = corners[(index + 1) % corners.len()];
                if (a[1] <= middle) != (b[1] <= middle) {
                    crossings.push(a[0] + (middle - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
                }
            }
            crossings.sort_by(f32::total_cmp);
            for pair in crossings.chunks_exact(2) {
                self.span(pair[0], pair[1], middle, colour);
            }
        }
        self.outline(corners, colour);
    }

    /// The dots of a row whose middles lie between two places.
    fn span(&mut self, from: f32, to: f32, y: f32, colour: Color) {
        let [first, end] = [from.round(), to.round()];
        if first < end {
            self.line([first, y], [end - 1.0, y], colour);
        }
    }

    /// The outline of an axis-aligned ellipse.
    pub fn ellipse(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        // So many corners that no line is a twentieth of a dot away from the curve.
        let corners = (10.0 * radii[0].max(radii[1]).sqrt()).clamp(12.0, 400.0) as usize;
        let corners: Vec<Dot> = around(centre, radii, corners).collect();
        self.outline(&corners, colour);
    }

    /// The outline of an axis-aligned ellipse with gaps.
    pub fn dotted_ellipse(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        let dots = (8.0 * radii[0].max(radii[1])).clamp(12.0, 2000.0) as usize;
        let dots = around(centre, radii, dots).enumerate().filter(|(index, _)| index % 8 < 4);
        self.points(dots.map(|(_, dot)| dot), colour);
    }

    /// An axis-aligned ellipse, filled; at least one dot.
    pub fn disc(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        self.points([centre].into_iter().filter(|_| radii.iter().all(|radius| radius.is_finite())), colour);
        for y in 0..self.size[1] as usize {
            let y = y as f32 + 0.5;
            let share = (y - centre[1]) / radii[1];
            let half = radii[0] * (1.0 - share * share).max(0.0).sqrt();
            self.span(centre[0] - half, centre[0] + half, y, colour);
        }
    }
}

/// Points on an axis-aligned ellipse, evenly spread.
fn around(centre: Dot, radii: [f32; 2], steps: usize) -> impl Iterator<Item = Dot> {
    (0..steps).map(move |step| {
        let (sin, cos) = (step as f32 / steps as f32 * std::f32::consts::TAU).sin_cos();
        [centre[0] + radii[0] * cos, centre[1] + radii[1] * sin]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(marker: Marker, paint: impl Fn(&mut Raster)) -> Vec<String> {
        let area = Rect::new(0, 0, 4, 2);
        let mut buffer = Buffer::empty(area);
        draw(area, marker, &mut buffer, paint);
        (0..2).map(|y| (0..4).map(|x| buffer[(x, y)].symbol().to_owned()).collect()).collect()
    }

    #[test]
    fn lines_are_clipped_and_set_braille_dots() {
        let lines = drawn(Marker::Braille, |raster| raster.line([-100.0, 0.5], [100.0, 0.5], Color::Red));
        assert_eq!(lines, ["⠉⠉⠉⠉", "    "]);
    }

    #[test]
    fn filled_shapes_cover_their_inside_in_each_marker_set() {
        let all = |raster: &mut Raster| {
            let [w, h] = raster.size();
            raster.fill(&[[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]], Color::Blue);
        };
        assert_eq!(drawn(Marker::Braille, all), ["⣿⣿⣿⣿", "⣿⣿⣿⣿"]);
        assert_eq!(drawn(Marker::HalfBlock, all), ["████", "████"]);
        assert_eq!(drawn(Marker::Ascii, all), ["****", "****"]);
    }

    #[test]
    fn a_tiny_disc_is_still_one_dot() {
        let lines = drawn(Marker::Ascii, |raster| raster.disc([1.5, 0.5], [0.1, 0.1], Color::Red));
        assert_eq!(lines, [" *  ", "    "]);
    }

    #[test]
    fn half_blocks_keep_two_colours() {
        let area = Rect::new(0, 0, 1, 1);
        let mut buffer = Buffer::empty(area);
        draw(area, Marker::HalfBlock, &mut buffer, |raster| {
            raster.points([[0.0, 0.0]], Color::Red);
            raster.points([[0.0, 1.0]], Color::Blue);
        });
        assert_eq!((buffer[(0, 0)].fg, buffer[(0, 0)].bg), (Color::Red, Color::Blue));
    }

    #[test]
    fn what_is_not_finite_is_not_drawn() {
        let lines = drawn(Marker::Braille, |raster| {
            raster.line([f32::NAN, 0.0], [3.0, 3.0], Color::Red);
            raster.points([[f32::INFINITY, 0.0]], Color::Red);
            raster.disc([f32::NAN, 1.0], [2.0; 2], Color::Red);
            raster.disc([1.0; 2], [f32::NAN; 2], Color::Red);
            raster.ellipse([1.0, f32::NAN], [2.0; 2], Color::Red);
        });
        assert_eq!(lines, ["    ", "    "]);
    }
}
