//! An 84 x 84 image with drawing primitives that match pygame's pixel for pixel. CREATE's observations are drawn with
//! it.

use mge_physics::SCREEN;

/// Width and height of an image, in pixels.
pub const IMAGE_SIDE: usize = SCREEN as usize;
/// Bytes of an image: rows from the top, pixels from the left, red, green, blue.
pub const IMAGE_LEN: usize = IMAGE_SIDE * IMAGE_SIDE * 3;

/// Red, green, blue.
pub type Colour = [u8; 3];
/// A pixel position, from the upper left corner; may lie outside the image.
pub type Pixel = [i32; 2];

const LAST: i32 = IMAGE_SIDE as i32 - 1;

/// An image being drawn. Column x is written to column 83 - x, because CREATE mirrors its images.
pub struct Canvas<'a> {
    pixels: &'a mut [u8; IMAGE_LEN],
}

impl<'a> Canvas<'a> {
    /// A white image.
    pub fn new(pixels: &'a mut [u8; IMAGE_LEN]) -> Self {
        pixels.fill(255);
        Self { pixels }
    }

    /// A horizontal run of pixels, both ends included.
    fn row(&mut self, from: i32, y: i32, to: i32, colour: Colour) {
        let (from, to) = (from.min(to).max(0), from.max(to).min(LAST));
        if (0..=LAST).contains(&y) && from <= to {
            let first = (y * (LAST + 1) + LAST - to) as usize * 3;
            let count = (to - from + 1) as usize * 3;
            self.pixels[first..first + count].as_chunks_mut().0.fill(colour);
        }
    }

    fn column(&mut self, x: i32, from: i32, to: i32, colour: Colour) {
        for y in from.max(0)..=to.min(LAST) {
            self.row(x, y, x, colour);
        }
    }

    /// A filled rectangle, from its upper left corner.
    pub fn rectangle(&mut self, [x, y]: Pixel, [width, height]: [i32; 2], colour: Colour) {
        for y in y.max(0)..(y + height).min(LAST + 1) {
            if width > 0 {
                self.row(x, y, x + width - 1, colour);
            }
        }
    }

    /// A disc, centred between pixels as in pygame.
    pub fn disc(&mut self, [x, y]: Pixel, radius: i32, colour: Colour) {
        if radius == 1 {
            return self.rectangle([x - 1, y - 1], [2, 2], colour);
        }
        let (mut error, mut step_x, mut step_y) = (1 - radius, 0, -2 * radius);
        let (mut across, mut down) = (0, radius);
        while across < down {
            if error >= 0 {
                down -= 1;
                step_y += 2;
                error += step_y;
            }
            across += 1;
            step_x += 2;
            error += step_x + 1;
            for (half, offset) in [(across, down), (down, across)] {
                // An outer row has its full width only when `down` is about to decrease.
                if half == down || error >= 0 {
                    self.row(x - half, y + offset - 1, x + half - 1, colour);
                    self.row(x - half, y - offset, x + half - 1, colour);
                }
            }
        }
    }

    /// A filled polygon, which need not be convex.
    pub fn polygon(&mut self, corners: &[Pixel], colour: Colour) {
        let Some(lowest) = corners.iter().map(|corner| corner[1]).max() else { return };
        let highest = corners.iter().map(|corner| corner[1]).fold(lowest, i32::min);
        if lowest == highest {
            let columns = corners.iter().map(|corner| corner[0]);
            let (left, right) = (columns.clone().min().unwrap_or(0), columns.max().unwrap_or(0));
            return self.row(left, lowest, right, colour);
        }
        let sides =
            || (0..corners.len()).map(|index| (corners[(index + corners.len() - 1) % corners.len()], corners[index]));
        let mut crossings = Vec::with_capacity(corners.len());
        for y in highest.max(0)..=lowest.min(LAST) {
            crossings.clear();
            for (a, b) in sides() {
                let ([x1, y1], [x2, y2]) = if a[1] < b[1] { (a, b) } else { (b, a) };
                if y1 != y2 && ((y1..y2).contains(&y) || (y == lowest && y2 == lowest)) {
                    crossings.push(((y - y1) as f32 * (x2 - x1) as f32 / (y2 - y1) as f32 + x1 as f32) as i32);
                }
            }
            crossings.sort_unstable();
            for pair in crossings.chunks_exact(2) {
                self.row(pair[0], y, pair[1], colour);
            }
        }
        for (a, b) in sides() {
            if a[1] == b[1] && highest < a[1] && a[1] < lowest {
                self.row(a[0], a[1], b[0], colour);
            }
        }
    }

    /// A line one or two pixels wide.
    pub fn line(&mut self, [mut x, mut y]: Pixel, [to_x, to_y]: Pixel, is_wide: bool, colour: Colour) {
        let (dx, dy) = ((to_x - x).abs(), (to_y - y).abs());
        let (step_x, step_y) = (if x < to_x { 1 } else { -1 }, if y < to_y { 1 } else { -1 });
        let mut error = if dx > dy { dx / 2 } else { -dy / 2 };
        loop {
            match is_wide {
                false => self.row(x, y, x, colour),
                true if dx <= dy => self.row(x, y, x + 1, colour),
                true => self.column(x, y, y + 1, colour),
            }
            if [x, y] == [to_x, to_y] {
                break;
            }
            let before = error;
            if before > -dx {
                error -= dy;
                x += step_x;
            }
            if before < dy {
                error += dx;
                y += step_y;
            }
        }
    }
}
