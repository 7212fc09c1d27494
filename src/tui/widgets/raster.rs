//! A raster of dots over terminal cells, used to draw scenes, curves and schedules.

use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;

use crate::tui::widgets::theme::Marker;

/// Dots over an area of cells. The latest dot determines the colour of its cell.
pub struct Raster<'a> {
    marker: Marker,
    area: Rect,
    buffer: &'a mut Buffer,
    /// Dots across and down.
    dots: [usize; 2],
    /// The dots painted in each cell since the latest layer, row by row.
    cells: Vec<Dots>,
}

/// The dots of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Dots {
    /// A bit for each dot that is set: for braille as in its Unicode block, otherwise from the top.
    set: u8,
    /// The colour of the latest dot; for half blocks the colour of each half.
    colours: [Color; 2],
}

/// A point in units of dots, from the upper left corner of the area.
pub type Dot = [f32; 2];

/// Paints dots over `area`; cells without a dot stay as they are.
pub fn draw(area: Rect, marker: Marker, buffer: &mut Buffer, paint: impl FnOnce(&mut Raster)) {
    let area = area.intersection(buffer.area);
    if area.is_empty() {
        return;
    }
    let [x, y] = marker.dots().map(usize::from);
    let dots = [usize::from(area.width) * x, usize::from(area.height) * y];
    let cells = vec![Dots::default(); usize::from(area.width) * usize::from(area.height)];
    let mut raster = Raster { marker, area, buffer, dots, cells };
    paint(&mut raster);
    raster.layer();
}

impl Raster<'_> {
    /// Width and height in dots.
    pub fn size(&self) -> [f32; 2] {
        self.dots.map(|dots| dots as f32)
    }

    /// Begins a layer: dots painted from now on replace earlier dots in their cells.
    pub fn layer(&mut self) {
        for (dots, position) in self.cells.iter_mut().zip(self.area.positions()) {
            if dots.set > 0 {
                dots.show(self.marker, &mut self.buffer[position]);
                *dots = Dots::default();
            }
        }
    }

    /// The indices of the dot that contains `at`. None if it is outside the area or not finite.
    fn place(&self, at: Dot) -> Option<[usize; 2]> {
        let size = self.size();
        let is_inside = (0..2).all(|axis| (0.0..size[axis]).contains(&at[axis]));
        is_inside.then(|| at.map(|value| value as usize))
    }

    fn set(&mut self, [x, y]: [usize; 2], colour: Color) {
        let [wide, high] = self.marker.dots().map(usize::from);
        if let Some(dots) = self.cells.get_mut(y / high * usize::from(self.area.width) + x / wide) {
            dots.add(self.marker, x % wide, y % high, colour);
        }
    }

    /// Sets the dots that contain these points; points outside the area are ignored.
    pub fn points(&mut self, points: impl IntoIterator<Item = Dot>, colour: Color) {
        for point in points {
            if let Some(place) = self.place(point) {
                self.set(place, colour);
            }
        }
    }

    /// A straight line, clipped to the area.
    pub fn line(&mut self, from: Dot, to: Dot, colour: Color) {
        let ends = match (self.place(from), self.place(to)) {
            (Some(from), Some(to)) => Some([from, to]),
            _ => clipped(from, to, self.dots),
        };
        if let Some([from, to]) = ends {
            along(from, to, |place| self.set(place, colour));
        }
    }

    /// The outline of a closed polygon.
    pub fn outline(&mut self, corners: &[Dot], colour: Color) {
        for (index, corner) in corners.iter().enumerate() {
            self.line(*corner, corners[(index + 1) % corners.len()], colour);
        }
    }

    /// The rows of dots between two heights, clipped to the area.
    fn rows(&self, top: f32, bottom: f32) -> std::ops::Range<usize> {
        // If `bottom` is NaN, the range is empty.
        let end = (bottom.ceil().max(0.0) as usize).min(self.dots[1]);
        (top.floor().max(0.0) as usize).min(end)..end
    }

    /// A filled convex or concave polygon, drawn by scan lines, with its outline.
    pub fn fill(&mut self, corners: &[Dot], colour: Color) {
        let heights = || corners.iter().map(|corner| corner[1]);
        let mut crossings: Vec<f32> = Vec::with_capacity(4);
        for y in self.rows(heights().fold(f32::MAX, f32::min), heights().fold(f32::MIN, f32::max)) {
            let middle = y as f32 + 0.5;
            crossings.clear();
            for (index, a) in corners.iter().enumerate() {
                let b = corners[(index + 1) % corners.len()];
                if (a[1] <= middle) != (b[1] <= middle) {
                    crossings.push(a[0] + (middle - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
                }
            }
            crossings.sort_by(f32::total_cmp);
            for pair in crossings.chunks_exact(2) {
                self.span(pair[0], pair[1], y, colour);
            }
        }
        self.outline(corners, colour);
    }

    /// The dots of a row whose centres lie between two x values.
    fn span(&mut self, from: f32, to: f32, y: usize, colour: Color) {
        // NaN becomes the left edge.
        let [first, end] = [from.round(), to.round()].map(|x| (x.max(0.0) as usize).min(self.dots[0]));
        (first..end).for_each(|x| self.set([x, y], colour));
    }

    /// The outline of an axis-aligned ellipse.
    pub fn ellipse(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        // Enough corners to keep each line within a twentieth of a dot of the curve.
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

    /// A filled axis-aligned ellipse of at least one dot.
    pub fn disc(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        if !radii.iter().chain(&centre).all(|value| value.is_finite()) {
            return;
        }
        self.points([centre], colour);
        for row in self.rows(centre[1] - radii[1], centre[1] + radii[1]) {
            let share = (row as f32 + 0.5 - centre[1]) / radii[1];
            let half = radii[0] * (1.0 - share * share).max(0.0).sqrt();
            self.span(centre[0] - half, centre[0] + half, row, colour);
        }
    }
}

impl Dots {
    /// Sets a dot.
    fn add(&mut self, marker: Marker, x: usize, y: usize, colour: Color) {
        /// The bits of braille, row by row.
        const BRAILLE: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        let (bit, half) = match marker {
            Marker::Braille => (BRAILLE[y % 4][x % 2], 0),
            Marker::HalfBlock => (1 << y, y % 2),
            Marker::Ascii => (1, 0),
        };
        self.set |= bit;
        self.colours[half] = colour;
    }

    /// Shows the dots in a cell of the screen.
    fn show(&self, marker: Marker, cell: &mut Cell) {
        let [upper, lower] = self.colours;
        let (symbol, fg, bg) = match (marker, self.set) {
            (Marker::Braille, set) => (char::from_u32(0x2800 + u32::from(set)).unwrap_or(' '), upper, None),
            (Marker::Ascii, _) => ('*', upper, None),
            (Marker::HalfBlock, 1) => ('▀', upper, None),
            (Marker::HalfBlock, 2) => ('▄', lower, None),
            (Marker::HalfBlock, _) if upper == lower => ('█', upper, Some(upper)),
            (Marker::HalfBlock, _) => ('▀', upper, Some(lower)),
        };
        cell.set_char(symbol).set_fg(fg);
        if let Some(bg) = bg {
            cell.set_bg(bg);
        }
    }
}

/// Clips a line to a raster of `dots`: the dots at the ends of its visible part. None if nothing is visible.
fn clipped(from: Dot, to: Dot, dots: [usize; 2]) -> Option<[[usize; 2]; 2]> {
    // Move the ends to the centres of their dots.
    let [from, to] = [from, to].map(|end| end.map(|value| f64::from(value.floor()) + 0.5));
    if ![from, to].as_flattened().iter().all(|value| value.is_finite()) {
        return None;
    }
    // The visible part lies between these fractions of the line.
    let (mut begin, mut end) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let way = to[axis] - from[axis];
        let [low, high] = [-from[axis], dots[axis] as f64 - from[axis]];
        if way == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let [near, far] = if way > 0.0 { [low / way, high / way] } else { [high / way, low / way] };
        (begin, end) = (begin.max(near), end.min(far));
    }
    if begin > end {
        return None;
    }
    let at = |share: f64| {
        [0, 1].map(|axis| {
            let (value, last) = (from[axis] + share * (to[axis] - from[axis]), dots[axis] as f64 - 1.0);
            (value * last / dots[axis] as f64).round().clamp(0.0, last) as usize
        })
    };
    Some([at(begin), at(end)])
}

/// Visits the dots on a straight line: one per column, or one per row of a steep line.
fn along(from: [usize; 2], to: [usize; 2], mut visit: impl FnMut([usize; 2])) {
    let [dx, dy] = [0, 1].map(|axis| from[axis].abs_diff(to[axis]) as isize);
    let long = usize::from(dy >= dx);
    let short = 1 - long;
    let [first, last] = if from[long] <= to[long] { [from, to] } else { [to, from] };
    let (ahead, aside) = if long == 0 { (dx, dy) } else { (dy, dx) };
    let is_rising = last[short] >= first[short];
    let mut at = first;
    let mut error = 2 * aside - ahead;
    for place in first[long]..=last[long] {
        at[long] = place;
        visit(at);
        if error > 0 {
            at[short] = if is_rising { at[short] + 1 } else { at[short].saturating_sub(1) };
            error -= 2 * ahead;
        }
        error += 2 * aside;
    }
}

/// Points on an axis-aligned ellipse at equal angles.
fn around(centre: Dot, radii: [f32; 2], steps: usize) -> impl Iterator<Item = Dot> {
    (0..steps).map(move |step| {
        let (sin, cos) = (step as f32 / steps as f32 * std::f32::consts::TAU).sin_cos();
        [centre[0] + radii[0] * cos, centre[1] + radii[1] * sin]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(marker: Marker, paint: impl FnOnce(&mut Raster)) -> Vec<String> {
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
    fn a_disc_reaches_as_far_up_as_down() {
        let area = Rect::new(0, 0, 8, 8);
        let rows = |centre: f32| {
            let mut buffer = Buffer::empty(area);
            draw(area, Marker::Ascii, &mut buffer, |raster| raster.disc([4.0, centre], [4.0; 2], Color::Red));
            let count = |y: u16| (0..8u16).filter(|x| buffer[(*x, y)].symbol() == "*").count();
            (0..8u16).map(count).collect::<Vec<_>>()
        };
        let whole = rows(4.0);
        assert!(whole[0] > 0 && whole[..4].iter().eq(whole[4..].iter().rev()), "{whole:?}");
        assert_eq!(rows(0.0), [&whole[4..], &[0; 4]].concat(), "the lower half");
    }

    #[test]
    fn lines_beside_the_area_are_not_drawn() {
        let lines = drawn(Marker::Braille, |raster| {
            for at in [-5.0, 20.0] {
                raster.line([at, -9.0], [at, 30.0], Color::Red);
                raster.line([-9.0, at], [30.0, at], Color::Red);
            }
        });
        assert_eq!(lines, ["    ", "    "]);
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
    fn values_that_are_not_finite_are_not_drawn() {
        let lines = drawn(Marker::Braille, |raster| {
            raster.line([f32::NAN, 0.0], [3.0, 3.0], Color::Red);
            raster.points([[f32::INFINITY, 0.0]], Color::Red);
            raster.disc([f32::NAN, 1.0], [2.0; 2], Color::Red);
            raster.disc([1.0; 2], [f32::NAN; 2], Color::Red);
            raster.ellipse([1.0, f32::NAN], [2.0; 2], Color::Red);
        });
        assert_eq!(lines, ["    ", "    "]);
    }

    #[test]
    fn lines_equal_those_of_ratatuis_canvas() {
        use ratatui::symbols;
        use ratatui::widgets::Widget;
        use ratatui::widgets::canvas::{Canvas, Line};

        let area = Rect::new(0, 0, 11, 7);
        let canvas = [symbols::Marker::Braille, symbols::Marker::HalfBlock, symbols::Marker::Custom('*')];
        for (marker, symbol) in [Marker::Braille, Marker::HalfBlock, Marker::Ascii].into_iter().zip(canvas) {
            let [w, h] = [0, 1].map(|axis| f64::from([11, 7][axis] * marker.dots()[axis]));
            let ends = |number: u32| {
                let at = |step: u32, size: f64| (f64::from(number * step % 97) / 97.0 * 1.6 - 0.3) * size;
                [[at(31, w), at(57, h)], [at(71, w), at(13, h)]].map(|end| end.map(|value| value.floor() + 0.5))
            };
            let lines: Vec<_> = (1..60).map(ends).collect();
            let colours = [Color::Red, Color::Blue];
            let mut ours = Buffer::empty(area);
            draw(area, marker, &mut ours, |raster| {
                for (line, colour) in lines.iter().zip(colours.iter().cycle()) {
                    let [from, to] = line.map(|end| end.map(|value| value as f32));
                    raster.line(from, to, *colour);
                }
            });
            let mut theirs = Buffer::empty(area);
            let paint = |context: &mut ratatui::widgets::canvas::Context| {
                for ([[x1, y1], [x2, y2]], colour) in lines.iter().zip(colours.iter().cycle()) {
                    context.draw(&Line::new(*x1, h - y1, *x2, h - y2, *colour));
                }
            };
            Canvas::default()
                .marker(symbol)
                .x_bounds([0.0, w])
                .y_bounds([0.0, h])
                .paint(paint)
                .render(area, &mut theirs);
            assert_eq!(ours, theirs, "{marker:?}");
        }
    }
}
