//! CREATE's pictures of tools, rotated and scaled as in pygame, so that images equal CREATE's pixel for pixel. The
//! pictures are not part of this program; CREATE has them in `create_game/assets`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::canvas::{Canvas, Colour};
use mge_base::sync::lock;

/// Files of the pictures.
const FILES: [&str; 11] = [
    "basket.png",
    "basketball.png",
    "belt_left.png",
    "belt_right.png",
    "box.png",
    "bucket.png",
    "cannon.png",
    "fan.png",
    "funnel.png",
    "ladder.png",
    "trampoline.png",
];
/// Most rotated and scaled pictures kept in the cache.
const REMEMBERED: usize = 10_000;
/// Largest accepted width or height of a picture, in pixels.
const MAX_SIDE: u32 = 4096;

/// A picture; its discriminant is its index in `FILES`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Picture {
    Basket,
    Basketball,
    BeltLeft,
    BeltRight,
    Box,
    Bucket,
    Cannon,
    Fan,
    Funnel,
    Ladder,
    Trampoline,
}

/// Why the pictures cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[error("{}: {message}; give the folder `create_game/assets` of CREATE", path.display())]
pub struct PicturesError {
    path: PathBuf,
    message: String,
}

/// Pixels by row; background pixels are None.
#[derive(Debug, Clone)]
struct Pixels {
    width: usize,
    pixels: Vec<Option<Colour>>,
}

/// Cache key of a rotated and scaled picture: the bits of angle, width and height.
type Look = (Picture, [u64; 3]);

/// CREATE's pictures, with a cache of rotated and scaled versions.
#[derive(Debug)]
pub struct Pictures {
    pictures: Vec<Pixels>,
    looks: Mutex<HashMap<Look, Pixels>>,
}

impl Pictures {
    /// Reads CREATE's pictures from its folder of assets.
    ///
    /// # Errors
    /// At the first picture that is missing or cannot be read.
    pub fn load(folder: &Path) -> Result<Self, PicturesError> {
        let read = |file: &&str| {
            let path = folder.join(file);
            let failed = |message: String| PicturesError { path: path.clone(), message };
            let picture = image::open(&path).map_err(|error| failed(error.to_string()))?.into_rgba8();
            if picture.width().max(picture.height()) > MAX_SIDE {
                return Err(failed(format!("has more than {MAX_SIDE} pixels per side")));
            }
            let colour = |pixel: &image::Rgba<u8>| [pixel[0], pixel[1], pixel[2]];
            // The first pixel has the background colour; alpha is ignored.
            let background = picture.pixels().next().map(colour).ok_or_else(|| failed("is empty".to_owned()))?;
            let pixels = picture.pixels().map(colour).map(|pixel| (pixel != background).then_some(pixel)).collect();
            Ok(Pixels { width: picture.width() as usize, pixels })
        };
        let pictures = FILES.iter().map(read).collect::<Result<_, _>>()?;
        Ok(Self { pictures, looks: Mutex::default() })
    }

    /// Draws a picture, rotated by an angle in radians, into the box from `low` to `high`, in pixels from the upper
    /// left corner.
    pub(super) fn draw(&self, canvas: &mut Canvas, picture: Picture, angle: f64, low: [f64; 2], high: [f64; 2]) {
        let size = [high[0] - low[0], high[1] - low[1]];
        let look = (picture, [angle, size[0], size[1]].map(f64::to_bits));
        // Ignores poisoning: entries are inserted whole, so a panic elsewhere leaves no partial entry.
        let mut looks = lock(&self.looks);
        if looks.len() >= REMEMBERED {
            looks.clear();
        }
        let pixels = looks.entry(look).or_insert_with(|| {
            self.pictures[picture as usize]
                .turned(angle)
                .scaled(size)
                .map_or(Pixels::empty(), |pixels| pixels.cropped())
        });
        let [left, top] = low.map(|p| p as i32);
        for (y, row) in (top..).zip(pixels.pixels.chunks(pixels.width.max(1))) {
            for (x, pixel) in (left..).zip(row) {
                if let Some(colour) = pixel {
                    canvas.point([x, y], *colour);
                }
            }
        }
    }
}

impl Pixels {
    fn empty() -> Self {
        Self { width: 0, pixels: Vec::new() }
    }

    fn height(&self) -> usize {
        self.pixels.len() / self.width.max(1)
    }

    /// The bounding box of the non-background pixels: its corner and its size.
    fn extent(&self) -> ([usize; 2], [usize; 2]) {
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for (index, _) in self.pixels.iter().enumerate().filter(|(_, pixel)| pixel.is_some()) {
            let place = [index % self.width, index / self.width];
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis] + 1);
            }
        }
        if high[0] == 0 { ([0; 2], [0; 2]) } else { (low, [high[0] - low[0], high[1] - low[1]]) }
    }

    /// Rotated counter-clockwise, with nearest-neighbour sampling, and enlarged to hold the whole picture.
    fn turned(&self, angle: f64) -> Self {
        let degrees = (angle * (180.0 / std::f64::consts::PI)) as f32;
        if degrees % 90.0 == 0.0 {
            return self.turned_square((degrees / 90.0).rem_euclid(4.0) as usize);
        }
        let radians = f64::from(degrees) * 0.017_453_292_519_89;
        let (sin, cos) = radians.sin_cos();
        let [w, h] = [self.width as f64, self.height() as f64];
        let room = |along: f64, across: f64| (along + across).abs().max((along - across).abs()) as i64;
        let (width, height) = (room(cos * w, sin * h).max(1), room(sin * w, cos * h).max(1));
        let (isin, icos) = ((sin * 65536.0) as i64, (cos * 65536.0) as i64);
        let middle = height >> 1;
        let (own_width, own_height) = (self.width as i64, self.height() as i64);
        let half = ((width - 1) << 15) as f64;
        let ax = (width << 15) - (cos * half) as i64 + ((own_width - width) << 15);
        let ay = (height << 15) - (sin * half) as i64 + ((own_height - height) << 15);
        let mut pixels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let (mut dx, mut dy) = (ax + isin * (middle - y), ay - icos * (middle - y));
            for _ in 0..width {
                let (x, y) = (dx >> 16, dy >> 16);
                let inside = (0..own_width).contains(&x) && (0..own_height).contains(&y);
                pixels.push(if inside { self.pixels[(y * own_width + x) as usize] } else { None });
                dx += icos;
                dy += isin;
            }
        }
        Self { width: width as usize, pixels }
    }

    /// Rotated counter-clockwise by a number of quarter turns.
    fn turned_square(&self, quarters: usize) -> Self {
        let (w, h) = (self.width, self.height());
        let at = |x: usize, y: usize| self.pixels[y * w + x];
        let (width, height) = if quarters.is_multiple_of(2) { (w, h) } else { (h, w) };
        let pixel = |index: usize| {
            let (x, y) = (index % width, index / width);
            match quarters {
                0 => at(x, y),
                1 => at(w - 1 - y, x),
                2 => at(w - 1 - x, h - 1 - y),
                _ => at(y, h - 1 - x),
            }
        };
        Self { width, pixels: (0..width * height).map(pixel).collect() }
    }

    /// Scaled, with nearest-neighbour sampling, so that the non-background part fills `size`. None if nothing would
    /// be visible.
    fn scaled(&self, size: [f64; 2]) -> Option<Self> {
        let own = [self.width, self.height()];
        let (_, shown) = self.extent();
        let side = |axis: usize| (size[axis] / (shown[axis] as f64 / own[axis] as f64)) as usize;
        let [width, height] = [side(0), side(1)];
        // No scene needs a picture larger than `MAX_SIDE`.
        if shown[0] == 0 || width == 0 || height == 0 || width.max(height) > MAX_SIDE as usize {
            return None;
        }
        let (columns, rows) = (steps(own[0], width), steps(own[1], height));
        let pixels = rows.iter().flat_map(|y| columns.iter().map(move |x| self.pixels[y * self.width + x])).collect();
        Some(Self { width, pixels })
    }

    fn cropped(&self) -> Self {
        let ([left, top], [width, height]) = self.extent();
        let row = |y: usize| &self.pixels[y * self.width + left..][..width];
        Self { width, pixels: (top..top + height).flat_map(row).copied().collect() }
    }
}

/// For each of `to` output pixels, the index of the input pixel (of `from`) that it shows.
fn steps(from: usize, to: usize) -> Vec<usize> {
    let (from2, to2) = (2 * from as i64, 2 * to as i64);
    let mut error = from2 - to2;
    let mut place = 0;
    let mut places = Vec::with_capacity(to);
    for _ in 0..to {
        places.push(place.min(from - 1));
        while error >= 0 {
            place += 1;
            error -= to2;
        }
        error += from2;
    }
    places
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::canvas::IMAGE_LEN;
    use super::*;
    use crate::{Autoreset, State, VectorEnvironment};
    use mge_task::load;

    const RED: Colour = [255, 0, 0];
    const BLUE: Colour = [0, 0, 255];

    /// A folder of test pictures: a white border around red on the left and blue on the right.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let mut picture = image::RgbImage::from_pixel(6, 4, image::Rgb([255; 3]));
        for y in 1..3 {
            for x in 1..5 {
                picture.put_pixel(x, y, image::Rgb(if x < 3 { RED } else { BLUE }));
            }
        }
        FILES.iter().for_each(|file| picture.save(folder.path().join(file)).unwrap());
        folder
    }

    /// The colours in an image other than white, each with its bounding box, with the mirroring undone.
    fn drawn(angle: f64, low: [f64; 2], high: [f64; 2]) -> Vec<(Colour, [usize; 4])> {
        let folder = folder();
        let pictures = Pictures::load(folder.path()).unwrap();
        let mut image = [0; IMAGE_LEN];
        pictures.draw(&mut Canvas::new(&mut image), Picture::Fan, angle, low, high);
        let mut found: Vec<(Colour, [usize; 4])> = Vec::new();
        for (index, colour) in image.as_chunks::<3>().0.iter().enumerate().filter(|(_, colour)| **colour != [255; 3]) {
            let (x, y) = (83 - index % 84, index / 84);
            match found.iter_mut().find(|(known, _)| known == colour) {
                Some((_, [left, top, right, bottom])) => {
                    (*left, *top, *right, *bottom) = ((*left).min(x), (*top).min(y), (*right).max(x), (*bottom).max(y));
                }
                None => found.push((*colour, [x, y, x, y])),
            }
        }
        found.sort();
        found
    }

    #[test]
    fn the_visible_part_of_a_picture_fills_the_box() {
        let whole = drawn(0.0, [10.5, 20.9], [18.5, 24.9]);
        assert_eq!(whole, [(BLUE, [14, 20, 17, 23]), (RED, [10, 20, 13, 23])]);
    }

    #[test]
    fn pictures_are_turned_counter_clockwise() {
        let quarter = drawn(std::f64::consts::FRAC_PI_2, [30.0, 40.0], [34.0, 48.0]);
        assert_eq!(quarter, [(BLUE, [30, 40, 33, 43]), (RED, [30, 44, 33, 47])]);
        let half = drawn(std::f64::consts::PI, [10.0, 20.0], [18.0, 24.0]);
        assert_eq!(half, [(BLUE, [10, 20, 13, 23]), (RED, [14, 20, 17, 23])]);
    }

    #[test]
    fn missing_and_unreadable_pictures_are_named() {
        let folder = folder();
        std::fs::write(folder.path().join("fan.png"), "no picture").unwrap();
        let error = Pictures::load(folder.path()).unwrap_err().to_string();
        assert!(error.contains("fan.png") && error.contains("create_game/assets"), "{error}");
        std::fs::remove_file(folder.path().join("box.png")).unwrap();
        assert!(Pictures::load(folder.path()).unwrap_err().to_string().contains("box.png"));
    }

    #[test]
    fn an_environment_keeps_its_pictures_when_a_state_is_restored() {
        let pictures = Arc::new(Pictures::load(folder().path()).unwrap());
        let task = Arc::new(load("create/Ladder").unwrap());
        let mut vector = VectorEnvironment::new(task.clone(), 1, Autoreset::Disabled).with_pictures(&pictures);
        let mut row = vec![0.0; vector.observation_len()];
        vector.reset(&[Some(1)], None, &mut row);
        let image = |vector: &VectorEnvironment| {
            let mut pixels = vec![0; IMAGE_LEN];
            vector.draw(&mut pixels);
            pixels
        };
        let before = image(&vector);
        let read = State::parse(&vector.state(0).unwrap().to_json(), &task).unwrap();
        vector.restore(0, &read, &mut row).unwrap();
        assert!(image(&vector) == before);
    }
}
