//! Plane geometry of drawing: rectangles and their division, clipping, dashes.
//! Points are `[x, y]` with y downwards, lengths in points (1/72 inch).

use mge_physics::{Tool, to_normalised};

/// A point on the page.
pub type Point = [f64; 2];

/// An axis-aligned rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub fn new(left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self { left, top, right, bottom }
    }

    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn center(&self) -> Point {
        [(self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0]
    }

    /// The rectangle reduced by `margin` on each side.
    pub fn inset(&self, margin: f64) -> Self {
        self.cut(margin, margin, margin, margin)
    }

    /// The rectangle reduced by these widths on each side.
    pub fn cut(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(self.left + left, self.top + top, self.right - right, self.bottom - bottom)
    }

    /// The upper `height` and the rest.
    pub fn split_top(&self, height: f64) -> (Self, Self) {
        let y = self.top + height;
        (Self { bottom: y, ..*self }, Self { top: y, ..*self })
    }

    /// The rest and the lower `height`.
    pub fn split_bottom(&self, height: f64) -> (Self, Self) {
        self.split_top(self.height() - height)
    }

    /// Equal cells, row by row, `gap` apart.
    pub fn grid(&self, rows: usize, columns: usize, gap: f64) -> Vec<Self> {
        let width = (self.width() - gap * (columns - 1) as f64) / columns as f64;
        let height = (self.height() - gap * (rows - 1) as f64) / rows as f64;
        (0..rows * columns)
            .map(|n| {
                let left = self.left + (n % columns) as f64 * (width + gap);
                let top = self.top + (n / columns) as f64 * (height + gap);
                Self::new(left, top, left + width, top + height)
            })
            .collect()
    }

    /// The largest square in it, centred horizontally, at the top.
    pub fn square(&self) -> Self {
        let side = self.width().min(self.height());
        let left = self.center()[0] - side / 2.0;
        Self::new(left, self.top, left + side, self.top + side)
    }

    pub fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    pub fn contains(&self, [x, y]: Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// The corners in order.
    pub fn corners(&self) -> [Point; 4] {
        [[self.left, self.top], [self.right, self.top], [self.right, self.bottom], [self.left, self.bottom]]
    }
}

/// The parts of a polyline inside `rect`; a non-finite point ends a part.
pub fn clip_polyline(points: &[Point], rect: &Rect) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let clipped =
            if pair.iter().flatten().all(|v| v.is_finite()) { clip_segment(pair[0], pair[1], rect) } else { None };
        let Some((from, to)) = clipped else {
            open = false;
            continue;
        };
        match parts.last_mut() {
            Some(part) if open && from == pair[0] => part.push(to),
            _ => parts.push(vec![from, to]),
        }
        open = to == pair[1];
    }
    parts
}

/// The part of a segment inside `rect` (Liang and Barsky).
pub fn clip_segment(from: Point, to: Point, rect: &Rect) -> Option<(Point, Point)> {
    let delta = [to[0] - from[0], to[1] - from[1]];
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (p, q) in [
        (-delta[0], from[0] - rect.left),
        (delta[0], rect.right - from[0]),
        (-delta[1], from[1] - rect.top),
        (delta[1], rect.bottom - from[1]),
    ] {
        if p == 0.0 {
            if q < 0.0 {
                return None;
            }
        } else if p < 0.0 {
            enter = enter.max(q / p);
        } else {
            leave = leave.min(q / p);
        }
    }
    let at = |t: f64| [from[0] + t * delta[0], from[1] + t * delta[1]];
    (enter <= leave).then(|| (if enter > 0.0 { at(enter) } else { from }, if leave < 1.0 { at(leave) } else { to }))
}

/// The part of a convex polygon inside `rect` (Sutherland and Hodgman); may be empty.
pub fn clip_polygon(polygon: &[Point], rect: &Rect) -> Vec<Point> {
    // Signed distance to each side, positive inside.
    let sides: [&dyn Fn(Point) -> f64; 4] =
        [&|p| p[0] - rect.left, &|p| rect.right - p[0], &|p| p[1] - rect.top, &|p| rect.bottom - p[1]];
    sides.iter().fold(polygon.to_vec(), |polygon, inside| {
        let mut clipped = Vec::with_capacity(polygon.len() + 1);
        for (n, &to) in polygon.iter().enumerate() {
            let from = polygon[(n + polygon.len() - 1) % polygon.len()];
            let (a, b) = (inside(from), inside(to));
            if (a < 0.0) != (b < 0.0) {
                let t = a / (a - b);
                clipped.push([from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
            }
            if b >= 0.0 {
                clipped.push(to);
            }
        }
        clipped
    })
}

/// The strokes of a dashed polyline; `pattern` holds alternating lengths of dashes and gaps.
pub fn dashes(points: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    let mut lengths = pattern.iter().copied().cycle();
    let mut strokes = Vec::new();
    let (Some(&first), Some(mut left)) = (points.first(), lengths.next()) else { return strokes };
    let (mut stroke, mut drawing) = (vec![first], true);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        let mut length = (to[0] - from[0]).hypot(to[1] - from[1]);
        while length > left {
            let t = left / length;
            from = [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
            length -= left;
            if drawing {
                stroke.push(from);
                strokes.push(std::mem::take(&mut stroke));
            } else {
                stroke = vec![from];
            }
            drawing = !drawing;
            left = lengths.next().unwrap_or(f64::INFINITY);
        }
        left -= length;
        if drawing {
            stroke.push(to);
        }
    }
    if drawing && stroke.len() > 1 {
        strokes.push(stroke);
    }
    strokes
}

/// The outline of a tool, normalised. Segments have round ends and a thickness of at least twice `least` units.
pub fn tool_outline(tool: &Tool, least: f32) -> Vec<[f32; 2]> {
    const STEPS: u32 = 16;
    let corners = tool.vertices();
    let outline = match corners[..] {
        [from, to] => {
            let (radius, along) = ((tool.radius as f32).max(least), (to[1] - from[1]).atan2(to[0] - from[0]));
            let end = |center: [f32; 2], start: f32| {
                (0..=STEPS).map(move |n| {
                    let (sin, cos) = (start + std::f32::consts::PI * n as f32 / STEPS as f32).sin_cos();
                    [center[0] + radius * cos, center[1] + radius * sin]
                })
            };
            let quarter = std::f32::consts::FRAC_PI_2;
            end(to, along - quarter).chain(end(from, along + quarter)).collect()
        }
        _ => corners,
    };
    outline.into_iter().map(to_normalised).collect()
}

/// A circle as a polygon fine enough for print.
pub fn circle(center: Point, radius: f64) -> Vec<Point> {
    ellipse(center, [radius, radius])
}

/// An axis-aligned ellipse as a polygon fine enough for print.
pub fn ellipse(center: Point, radii: [f64; 2]) -> Vec<Point> {
    const CORNERS: u32 = 72;
    (0..CORNERS)
        .map(|n| {
            let (sin, cos) = (f64::from(n) * std::f64::consts::TAU / f64::from(CORNERS)).sin_cos();
            [center[0] + radii[0] * cos, center[1] + radii[1] * sin]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_physics::ToolKind;

    const UNIT: Rect = Rect { left: 0.0, top: 0.0, right: 1.0, bottom: 1.0 };

    #[test]
    fn polylines_end_at_the_border_and_at_gaps() {
        let parts = clip_polyline(&[[-1.0, 0.5], [0.5, 0.5], [2.0, 0.5], [0.5, 0.5]], &UNIT);
        assert_eq!(parts, [vec![[0.0, 0.5], [0.5, 0.5], [1.0, 0.5]], vec![[1.0, 0.5], [0.5, 0.5]]]);
        let gap = [[0.1, 0.1], [0.2, 0.1], [f64::NAN, 0.1], [0.3, 0.1], [0.4, 0.1]];
        assert_eq!(clip_polyline(&gap, &UNIT), [vec![[0.1, 0.1], [0.2, 0.1]], vec![[0.3, 0.1], [0.4, 0.1]]]);
        assert!(clip_polyline(&[[2.0, 2.0], [3.0, 2.0]], &UNIT).is_empty());
    }

    #[test]
    fn a_wall_has_its_thickness_and_round_ends() {
        let wall = Tool::new(ToolKind::Wall, [42.0, 42.0]).with_size(20.0);
        let extent = |outline: &[[f32; 2]]| [0, 1].map(|axis| outline.iter().map(|p| p[axis]).fold(f32::MIN, f32::max));
        let [width, height] = extent(&tool_outline(&wall, 0.0));
        assert!((width - 1.0 / 42.0).abs() < 1e-6 && (height - 11.0 / 42.0).abs() < 1e-6);
        assert!((extent(&tool_outline(&wall, 3.0))[0] - 3.0 / 42.0).abs() < 1e-6);
        assert_eq!(tool_outline(&Tool::new(ToolKind::Box, [42.0, 42.0]), 3.0).len(), 4);
    }

    #[test]
    fn polygons_are_cut_at_the_border() {
        let half = clip_polygon(&[[-1.0, 0.0], [0.5, 0.0], [0.5, 1.0], [-1.0, 1.0]], &UNIT);
        assert_eq!(half, [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]]);
        assert!(clip_polygon(&circle([5.0, 5.0], 1.0), &UNIT).is_empty());
    }

    #[test]
    fn dashes_cover_the_requested_share() {
        let drawn: f64 =
            dashes(&[[0.0, 0.0], [10.0, 0.0]], &[2.0, 3.0]).iter().map(|s| s[s.len() - 1][0] - s[0][0]).sum();
        assert_eq!(drawn, 4.0);
    }
}
