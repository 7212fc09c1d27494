//! Figure 2: the dynamic relative coordinate system, with the moving ball as its origin.

use super::Figure;
use super::axes::{X_LABEL, number};
use super::canvas::{Canvas, Pen};
use super::geometry::circle;
use super::layout::{LEGEND, Mark, NOTE, around_panels, panels, squares_height};
use super::scene::{PLACED_TOOL, Position, SceneView, Window};
use super::style::{BLUE, DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, TITLE_SIZE, VERMILLION, faded};
use super::table::Table;
use mge_task::Task;

/// One scene at a few instants, in screen coordinates (above) and relative to the ball (below).
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeFrames {
    /// The scene.
    pub task: Task,
    /// Surface distance in units up to which an edge is active.
    pub cutoff: f32,
    /// The instants in order of time; two or three are legible.
    pub instants: Vec<Instant>,
}

/// The scene at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Time in seconds.
    pub time: f32,
    /// Normalised position of the ball: the origin.
    pub ball: Position,
    /// Earlier normalised positions of the ball.
    pub trail: Vec<Position>,
    /// Normalised positions of the tools the agent has placed.
    pub placed: Vec<Position>,
    /// The ball's edges to tools.
    pub edges: Vec<Edge>,
}

/// An edge of the graph, from a tool to the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Normalised position of the tool.
    pub object: Position,
    /// Whether it is within the cutoff, so that it sends a message.
    pub active: bool,
}

impl Edge {
    fn relative(&self, ball: Position) -> Position {
        [self.object[0] - ball[0], self.object[1] - ball[1]]
    }
}

/// Only the upper row has titles; this is their height.
const TITLE: f64 = 1.3 * TITLE_SIZE;
/// Smallest half width of a view around the ball, and the margin beyond the farthest tool.
const RELATIVE_REACH: f64 = 1.0;
const BEYOND: f64 = 0.2;

impl RelativeFrames {
    fn scene(&self, view: &SceneView<'_>, canvas: &Canvas, instant: &Instant) {
        view.surroundings(&self.task);
        for position in &instant.placed {
            view.tool(&self.task.placeable.tool(*position), PLACED_TOOL);
        }
        let (rect, [x, y]) = (view.rect(), view.at(instant.ball));
        let axis = Pen::new(BLUE, 0.8);
        if rect.contains([x, y]) {
            canvas.arrow([rect.left, y], [rect.right, y], axis);
            canvas.arrow([x, rect.bottom], [x, rect.top], axis);
        }
        let reach = circle([x, y], view.length(self.cutoff));
        view.shape(&reach, faded(BLUE, 0.06), Pen::new(BLUE, 0.6).dashed(&[1.0, 1.6]));
        view.path(&instant.trail, Pen::new(GREY, 0.8).dashed(&[1.6, 1.6]));
        view.ball(instant.ball, self.task.ball.radius);
        for edge in instant.edges.iter().filter(|edge| view.shows(edge.object) && view.shows(instant.ball)) {
            let pen = if edge.active { Pen::new(VERMILLION, 1.3) } else { Pen::new(GREY, 0.7).dashed(&[2.2, 1.6]) };
            canvas.arrow([x, y], view.at(edge.object), pen);
        }
    }

    /// Half the width of the views around the ball, large enough for every tool.
    fn reach(&self) -> f64 {
        let vectors = self.instants.iter().flat_map(|instant| instant.edges.iter().map(|e| e.relative(instant.ball)));
        let farthest = vectors.flatten().map(|value| f64::from(value.abs())).filter(|value| value.is_finite());
        farthest.map(|value| value + BEYOND).fold(RELATIVE_REACH, f64::max)
    }
}

impl Figure for RelativeFrames {
    fn size(&self) -> [f64; 2] {
        let columns = self.instants.len().clamp(2, 4);
        [DOUBLE_COLUMN, squares_height(DOUBLE_COLUMN, 2 * columns, columns, X_LABEL - TITLE + LEGEND + 2.0 * NOTE)]
    }

    fn draw(&self, canvas: &Canvas) {
        let text = format!(
            "Above: the screen's coordinates. Below: the same instants with the ball as origin. Dotted circle: cutoff of {} units from the ball to a tool's surface.",
            self.cutoff
        );
        let marks = [
            (Mark::Line(Pen::new(BLUE, 1.4 * LINE_WIDTH)), "axes of the ball".to_owned()),
            (Mark::Line(Pen::new(VERMILLION, 1.4 * LINE_WIDTH)), "active edge".to_owned()),
            (Mark::Line(Pen::new(GREY, LINE_WIDTH).dashed(&[2.5, 1.8])), "inactive edge".to_owned()),
            (Mark::Patch(PLACED_TOOL), "placed by the agent".to_owned()),
        ];
        let empty = self.instants.is_empty().then_some("no instants");
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, &text, &marks) else { return };
        let count = self.instants.len();
        let (above, below) = rect.split_top((rect.height() + TITLE) / 2.0);
        let places = panels(above, count, count).into_iter().zip(panels(below, count, count));
        for (instant, (upper, lower)) in self.instants.iter().zip(places) {
            let window = Window { labels: [upper.x_label, upper.y_label], ..Window::SCREEN };
            let title = format!("t = {} s", number(f64::from(instant.time), 2));
            self.scene(&SceneView::new(canvas, upper.cell, &title, window), canvas, instant);
            let origin = instant.ball.map(f64::from);
            let names = ["x relative to the ball", "y relative to the ball"];
            let view = SceneView::new(
                canvas,
                lower.cell,
                "",
                Window { center: origin, half: self.reach(), origin, names, ..window },
            );
            self.scene(&view, canvas, instant);
        }
    }

    fn table(&self) -> Table {
        let mut table =
            Table::new(["time_s", "ball_x", "ball_y", "object", "x", "y", "relative_x", "relative_y", "active"]);
        for instant in &self.instants {
            for (n, edge) in instant.edges.iter().enumerate() {
                let [dx, dy] = edge.relative(instant.ball);
                let ([ball_x, ball_y], [x, y]) = (instant.ball, edge.object);
                table.push(&[&instant.time, &ball_x, &ball_y, &n, &x, &y, &dx, &dy, &edge.active]);
            }
        }
        table
    }
}
