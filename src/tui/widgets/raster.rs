//! A dot raster over terminal cells: what scene, curves and schedules are drawn with.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use crate::figures;
use crate::tui::widgets::theme::Marker;

/// Dots over an area of cells. Later dots win the colour of their cell.
pub struct Raster {
    area: Rect,
    marker: Marker,
    width: usize,
    height: usize,
    dots: Vec<Option<Color>>,
    cells: Vec<Color>,
}

/// A point in dots, from the upper left corner of the area.
pub type Dot = [f32; 2];

impl Raster {
    /// An empty raster over `area`.
    pub fn new(area: Rect, marker: Marker) -> Self {
        let [x, y] = marker.dots();
        let (width, height) = (area.width as usize * x, area.height as usize * y);
        Self {
            area,
            marker,
            width,
            height,
            dots: vec![None; width * height],
            cells: vec![Color::Reset; area.width as usize * area.height as usize],
        }
    }

    /// Width and height in dots.
    pub fn size(&self) -> [f32; 2] {
        [self.width as f32, self.height as f32]
    }

    /// Sets the dot that contains `at`; outside of the area nothing happens.
    pub fn point(&mut self, at: Dot, colour: Color) {
        if at[0] < 0.0 || at[1] < 0.0 || !at[0].is_finite() || !at[1].is_finite() {
            return;
        }
        let (x, y) = (at[0] as usize, at[1] as usize);
        if x < self.width && y < self.height {
            self.dots[y * self.width + x] = Some(colour);
            let [per_x, per_y] = self.marker.dots();
            self.cells[y / per_y * self.area.width as usize + x / per_x] = colour;
        }
    }

    /// A straight line, clipped to the area.
    pub fn line(&mut self, from: Dot, to: Dot, colour: Color) {
        if !from.iter().chain(&to).all(|value| value.is_finite()) {
            return;
        }
        let area = figures::Rect::new(0.0, 0.0, self.width as f64, self.height as f64);
        let Some((from, to)) = figures::clip_segment(from.map(f64::from), to.map(f64::from), &area) else { return };
        let [from, to] = [from, to].map(|end| end.map(|value| value as f32));
        let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()).ceil().max(1.0);
        for step in 0..=steps as usize {
            let share = step as f32 / steps;
            self.point([from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share], colour);
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
        for y in 0..self.height {
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
                let from = pair[0].round().max(0.0) as usize;
                let to = pair[1].round().clamp(0.0, self.width as f32) as usize;
                for x in from..to {
                    self.point([x as f32, y as f32], colour);
                }
            }
        }
        self.outline(corners, colour);
    }

    /// The outline of an axis-aligned ellipse.
    pub fn ellipse(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        for dot in around(centre, radii) {
            self.point(dot, colour);
        }
    }

    /// The outline of an axis-aligned ellipse with gaps.
    pub fn dotted_ellipse(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        for (_, dot) in around(centre, radii).enumerate().filter(|(index, _)| index % 8 < 4) {
            self.point(dot, colour);
        }
    }

    /// An axis-aligned ellipse, filled; at least one dot.
    pub fn disc(&mut self, centre: Dot, radii: [f32; 2], colour: Color) {
        if !centre.iter().chain(&radii).all(|value| value.is_finite()) {
            return;
        }
        self.point(centre, colour);
        let (top, bottom) = ((centre[1] - radii[1]).floor().max(0.0), (centre[1] + radii[1]).min(self.height as f32));
        let mut y = top;
        while y < bottom {
            let share = (y + 0.5 - centre[1]) / radii[1];
            let half = radii[0] * (1.0 - share * share).max(0.0).sqrt();
            let mut x = (centre[0] - half).round().max(0.0);
            while x < (centre[0] + half).round().min(self.width as f32) {
                self.point([x, y], colour);
                x += 1.0;
            }
            y += 1.0;
        }
    }

    /// Writes the dots into the buffer; cells without a dot stay as they are.
    pub fn render(&self, buffer: &mut Buffer) {
        let [per_x, per_y] = self.marker.dots();
        for row in 0..self.area.height {
            for column in 0..self.area.width {
                let dot = |x: usize, y: usize| {
                    self.dots[(row as usize * per_y + y) * self.width + column as usize * per_x + x]
                };
                let Some(cell) = buffer.cell_mut((self.area.x + column, self.area.y + row)) else { continue };
                let colour = self.cells[row as usize * self.area.width as usize + column as usize];
                match self.marker {
                    Marker::Braille => {
                        let mask = braille_mask(|x, y| dot(x, y).is_some());
                        if mask != 0 {
                            cell.set_char(char::from_u32(0x2800 + mask).unwrap_or(' ')).set_fg(colour);
                        }
                    }
                    Marker::HalfBlock => match (dot(0, 0), dot(0, 1)) {
                        (Some(top), Some(bottom)) if top == bottom => _ = cell.set_char('█').set_fg(top),
                        (Some(top), Some(bottom)) => _ = cell.set_char('▀').set_fg(top).set_bg(bottom),
                        (Some(top), None) => _ = cell.set_char('▀').set_fg(top),
                        (None, Some(bottom)) => _ = cell.set_char('▄').set_fg(bottom),
                        (None, None) => {}
                    },
                    Marker::Ascii => {
                        if dot(0, 0).is_some() {
                            cell.set_char('*').set_fg(colour);
                        }
                    }
                }
            }
        }
    }
}

/// Bits of the braille pattern: columns from the top, the lowest row last.
fn braille_mask(set: impl Fn(usize, usize) -> bool) -> u32 {
    const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
    let mut mask = 0;
    for (y, row) in BITS.iter().enumerate() {
        for (x, bit) in row.iter().enumerate() {
            if set(x, y) {
                mask |= bit;
            }
        }
    }
    mask
}

fn around(centre: Dot, radii: [f32; 2]) -> impl Iterator<Item = Dot> {
    let steps = (8.0 * radii[0].max(radii[1])).clamp(12.0, 2000.0) as usize;
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
        let mut raster = Raster::new(area, marker);
        paint(&mut raster);
        let mut buffer = Buffer::empty(area);
        raster.render(&mut buffer);
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
        let mut raster = Raster::new(area, Marker::HalfBlock);
        raster.point([0.0, 0.0], Color::Red);
        raster.point([0.0, 1.0], Color::Blue);
        let mut buffer = Buffer::empty(area);
        raster.render(&mut buffer);
        assert_eq!((buffer[(0, 0)].fg, buffer[(0, 0)].bg), (Color::Red, Color::Blue));
    }

    #[test]
    fn what_is_not_finite_is_not_drawn() {
        let lines = drawn(Marker::Braille, |raster| {
            raster.line([f32::NAN, 0.0], [3.0, 3.0], Color::Red);
            raster.point([f32::INFINITY, 0.0], Color::Red);
            raster.disc([f32::NAN, 1.0], [2.0; 2], Color::Red);
            raster.disc([1.0; 2], [f32::NAN; 2], Color::Red);
            raster.ellipse([1.0, f32::NAN], [2.0; 2], Color::Red);
        });
        assert_eq!(lines, ["    ", "    "]);
    }
}
