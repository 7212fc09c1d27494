//! An episode as an animated GIF.

use std::collections::BTreeMap;

use super::canvas::{Canvas, Pen, svg};
use super::layout::note;
use super::output::{encode, write_with_table};
use super::provenance::Provenance;
use super::render::{pixels, rgb};
use super::scene::{Mover, PLACED_TOOL, Position, SceneView, Window};
use super::style::{BLUE, MARGIN, SINGLE_COLUMN, faded};
use super::table::Table;
use super::tasks::heading;
use super::{Figure, FigureError};
use mge_base::atomic::Target;
use mge_base::paths::suffix;
use mge_physics::Tool;
use mge_task::Task;

/// The moments of an episode. As a still figure it shows the last moment with the whole path of the ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// The task.
    pub task: Task,
    /// The moments in order, one per frame.
    pub moments: Vec<Moment>,
    /// Duration of a frame in milliseconds.
    pub frame_ms: u32,
    /// Number of earlier ball positions drawn as a trail.
    pub trail: usize,
}

/// The scene at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time in seconds.
    pub time: f32,
    /// Normalised position of the ball.
    pub ball: Position,
    /// The marker, other balls and boxes; empty if their paths are not known.
    pub movers: Vec<Mover>,
    /// Tools placed so far.
    pub placed: Vec<Tool>,
    /// Stages (subgoals in order, then the goal) reached so far.
    pub reached: usize,
}

/// Duration of the last frame in milliseconds, before the animation repeats.
const LAST_FRAME_MS: u32 = 1500;

impl Animation {
    fn draw_moment(&self, canvas: &Canvas, index: usize, trail: usize) {
        let page = canvas.page().inset(MARGIN);
        let Some(moment) = self.moments.get(index) else { return canvas.placeholder(page, "nothing happened") };
        let stages = self.task.stage_count();
        let reached = if moment.reached >= stages {
            "goal reached".to_owned()
        } else {
            format!("subgoals reached: {} of {}", moment.reached, stages - 1)
        };
        let text = format!("t = {:.2} s, tools placed: {}, {reached}", moment.time, moment.placed.len());
        let rect = note(canvas, page, &text);
        let view = SceneView::new(canvas, rect, &heading(&self.task.name), Window::SCREEN);
        view.surroundings(&self.task);
        for tool in &moment.placed {
            view.tool(tool, PLACED_TOOL);
        }
        for mover in &moment.movers {
            view.mover(mover);
        }
        let past: Vec<Position> =
            self.moments[index.saturating_sub(trail)..=index].iter().map(|past| past.ball).collect();
        view.path(&past, Pen::new(faded(BLUE, 0.7), 1.2));
        view.ball(moment.ball, self.task.ball.radius)
    }

    /// The animation as a GIF of `dpi` dots per inch that loops forever and carries its provenance as a comment.
    ///
    /// # Errors
    /// When the resolution is 0 or too large for a GIF.
    pub fn to_gif(&self, provenance: &Provenance, dpi: u32) -> Result<Vec<u8>, FigureError> {
        let [wide, high] = pixels(self.size(), dpi);
        let (Ok(width), Ok(height)) = (u16::try_from(wide), u16::try_from(high)) else {
            return Err(FigureError::Size { width: wide, height: high });
        };
        let failed = |error: gif::EncodingError| FigureError::Encoding(error.to_string());
        let mut bytes = Vec::new();
        let mut encoder = gif::Encoder::new(&mut bytes, width, height, &[]).map_err(failed)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
        let comment = provenance.to_comment();
        let blocks: Vec<&[u8]> = comment.as_bytes().chunks(255).collect();
        encoder
            .write_raw_extension(gif::Extension::Comment.into(), &blocks)
            .map_err(|error| FigureError::Encoding(error.to_string()))?;
        for index in 0..self.moments.len().max(1) {
            let page = svg(self.size(), 1.0, "", |canvas| self.draw_moment(canvas, index, self.trail));
            let (palette, indices) = commonest_colors(&rgb(&page, wide, high)?);
            let mut frame = gif::Frame::from_palette_pixels(width, height, indices, palette, None);
            // GIF counts hundredths of a second.
            let last = index + 1 >= self.moments.len();
            let shown = if last { self.frame_ms.max(LAST_FRAME_MS) } else { self.frame_ms };
            frame.delay = u16::try_from(shown.div_ceil(10)).unwrap_or(u16::MAX);
            encoder.write_frame(&frame).map_err(failed)?;
        }
        drop(encoder);
        Ok(bytes)
    }
}

/// The 256 most common colours of an RGB image, and for each pixel the index of the nearest.
///
/// A scene has few colours, which mix only at the edges of shapes. Its flat colours stay exact, which quantisers for
/// photographs do not guarantee.
fn commonest_colors(pixels: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let mut counts: BTreeMap<[u8; 3], usize> = BTreeMap::new();
    let (colors, _) = pixels.as_chunks::<3>();
    for color in colors {
        *counts.entry(*color).or_default() += 1;
    }
    let mut palette: Vec<[u8; 3]> = counts.keys().copied().collect();
    palette.sort_by_key(|color| std::cmp::Reverse(counts[color]));
    palette.truncate(256);
    let distance = |a: &[u8; 3], b: &[u8; 3]| -> u32 { (0..3).map(|n| u32::from(a[n].abs_diff(b[n])).pow(2)).sum() };
    let nearest = |color: &[u8; 3]| {
        let found = (0u8..=255).zip(&palette).min_by_key(|(_, candidate)| distance(color, candidate));
        found.map_or(0, |(index, _)| index)
    };
    let index: BTreeMap<[u8; 3], u8> = counts.keys().map(|color| (*color, nearest(color))).collect();
    let indices = colors.iter().map(|color| index[color]).collect();
    (palette.concat(), indices)
}

impl Figure for Animation {
    fn size(&self) -> [f64; 2] {
        [SINGLE_COLUMN, 1.05 * SINGLE_COLUMN]
    }

    /// 480 pixels wide.
    fn resolution(&self) -> u32 {
        137
    }

    fn draw(&self, canvas: &Canvas) {
        self.draw_moment(canvas, self.moments.len().saturating_sub(1), self.moments.len())
    }

    /// Writes it as a GIF if the extension says so, otherwise as any figure.
    fn write(&self, to: &Target, provenance: &Provenance, dpi: u32) -> Result<(), FigureError> {
        let bytes = match suffix(&to.path).as_str() {
            "gif" => self.to_gif(provenance, dpi)?,
            _ => encode(&to.path, &self.to_svg(provenance), provenance, dpi)?,
        };
        write_with_table(to, &bytes, &self.table())
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["time_s", "ball_x", "ball_y", "tools_placed", "stages_reached"]);
        for moment in &self.moments {
            table.push(&[&moment.time, &moment.ball[0], &moment.ball[1], &moment.placed.len(), &moment.reached]);
        }
        table
    }
}
