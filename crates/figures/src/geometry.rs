//! Plane geometry of drawing: rectangles and their division, outlines.
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

    pub fn contains(&self, [x, y]: Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// The corners in order.
    pub fn corners(&self) -> [Point; 4] {
        [[self.left, self.top], [self.right, self.top], [self.right, self.bottom], [self.left, self.bottom]]
    }
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

    #[test]
    fn a_wall_has_its_thickness_and_round_ends() {
        let wall = Tool::new(ToolKind::Wall, [42.0, 42.0]).with_size(20.0);
        let extent = |outline: &[[f32; 2]]| [0, 1].map(|axis| outline.iter().map(|p| p[axis]).fold(f32::MIN, f32::max));
        let [width, height] = extent(&tool_outline(&wall, 0.0));
        assert!((width - 1.0 / 42.0).abs() < 1e-6 && (height - 11.0 / 42.0).abs() < 1e-6);
        assert!((extent(&tool_outline(&wall, 3.0))[0] - 3.0 / 42.0).abs() < 1e-6);
        assert_eq!(tool_outline(&Tool::new(ToolKind::Box, [42.0, 42.0]), 3.0).len(), 4);
    }
}
