//! Conversion between normalised positions and cells.

use ratatui::layout::Rect;

use crate::tui::widgets::layout::centred;

/// The normalised positions at the edges of the scene: left and right, bottom and top.
pub const BOUNDS: [[f32; 2]; 2] = [[-1.0, 1.0]; 2];

/// The square part of an area in which the scene is drawn: a cell is about twice as
/// high as wide, so it has twice as many columns as rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct View {
    /// Cells of the scene.
    pub area: Rect,
}

impl View {
    /// The largest square in the middle of `within`.
    pub fn fit(within: Rect) -> Self {
        let rows = within.height.min(within.width / 2);
        Self { area: centred(2 * rows, rows, within) }
    }

    /// The cell of a normalised position, if it is inside.
    pub fn cell(&self, position: [f32; 2]) -> Option<(u16, u16)> {
        let x = (position[0] + 1.0) / 2.0 * f32::from(self.area.width);
        let y = (1.0 - position[1]) / 2.0 * f32::from(self.area.height);
        let inside = x >= 0.0 && y >= 0.0 && x < f32::from(self.area.width) && y < f32::from(self.area.height);
        inside.then(|| (self.area.x + x as u16, self.area.y + y as u16))
    }

    /// The normalised position of a cell's centre; cells outside are clamped to the nearest one inside.
    pub fn nearest(&self, column: u16, row: u16) -> [f32; 2] {
        let share = |at: u16, start: u16, length: u16| {
            let inside = at.clamp(start, start + length.saturating_sub(1)) - start;
            (f32::from(inside) + 0.5) / f32::from(length.max(1))
        };
        let x = share(column, self.area.x, self.area.width);
        let y = share(row, self.area.y, self.area.height);
        [2.0 * x - 1.0, 1.0 - 2.0 * y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_is_square_and_in_the_middle() {
        assert_eq!(View::fit(Rect::new(0, 0, 100, 20)).area, Rect::new(30, 0, 40, 20));
        assert_eq!(View::fit(Rect::new(2, 3, 40, 50)).area, Rect::new(2, 18, 40, 20));
        assert_eq!(View::fit(Rect::new(0, 0, 0, 0)).area.area(), 0);
    }

    #[test]
    fn cells_and_positions_round_trip() {
        let view = View::fit(Rect::new(5, 7, 60, 30));
        for (column, row) in [(5, 7), (64, 36), (30, 20)] {
            let position = view.nearest(column, row);
            assert_eq!(view.cell(position), Some((column, row)));
        }
        assert_eq!(view.nearest(0, 0), view.nearest(5, 7));
        assert!(view.nearest(5, 7)[1] > 0.9, "the first row is at the top");
    }

    #[test]
    fn positions_outside_have_no_cell_and_cells_outside_have_the_nearest_position() {
        let view = View::fit(Rect::new(5, 7, 60, 30));
        for outside in [[-1.1, 0.0], [1.1, 0.0], [0.0, 1.1], [0.0, -1.1], [1.0, 0.0], [0.0, -1.0]] {
            assert_eq!(view.cell(outside), None, "{outside:?}");
        }
        assert_eq!(view.nearest(100, 100), view.nearest(64, 36));
    }
}
