//! A drawn scene: tools with their true geometry, subgoals numbered in order, goal and ball.

use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, Pen, TextFormat};
use super::geometry::{Point, Rect, circle, tool_outline};
use super::style::{
    BLACK, Color, GREEN, GREY, INK, LIGHT_GREY, SMALL_SIZE, THIN_WIDTH, WHITE, YELLOW, faded, stage_color,
};
use mge_physics::{SCREEN, Tool, ToolKind};
use mge_task::{Goal, GoalShape, Region, Task};

/// Fill colours of the scene's tools and of tools placed by the agent.
pub const SCENE_TOOL: Color = LIGHT_GREY;
/// See [`SCENE_TOOL`].
pub const PLACED_TOOL: Color = YELLOW;
/// The ball.
pub const BALL: Color = BLACK;

/// A moving object other than the target ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mover {
    /// Normalised position of its centre.
    pub position: Position,
    /// Radius, or half a side, in units.
    pub radius: f32,
    /// Angle of a box in radians; None for a ball.
    pub angle: Option<f32>,
}

/// A normalised position.
pub type Position = [f32; 2];

/// The part of the plane that a view shows.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// Normalised centre.
    pub center: [f64; 2],
    /// Half the width and height, normalised.
    pub half: f64,
    /// Normalised position that is the origin of the axes.
    pub origin: [f64; 2],
    /// Names of the axes.
    pub names: [&'static str; 2],
    /// Whether the axes are labelled (they always have ticks).
    pub labels: [bool; 2],
}

impl Window {
    /// The whole screen, [-1, 1] in both directions.
    pub const SCREEN: Self = Self {
        center: [0.0, 0.0],
        half: 1.0,
        origin: [0.0, 0.0],
        names: ["x (normalised)", "y (normalised)"],
        labels: [true, true],
    };
}

/// A framed square view of the plane, on which objects are drawn.
pub struct SceneView<'c> {
    canvas: &'c Canvas,
    plot: Plot<'c>,
    origin: [f64; 2],
    per_unit: f64,
}

impl<'c> SceneView<'c> {
    /// Frames `window` in `outer`, with x and y as axes.
    pub fn new(canvas: &'c Canvas, outer: Rect, title: &str, window: Window) -> Self {
        let axis = |n: usize| {
            let center = window.center[n] - window.origin[n];
            Axis::linear(window.names[n], center - window.half, center + window.half, 5).labelled(window.labels[n])
        };
        let frame = Frame { title, grid: false, square: true };
        let plot = Plot::new(canvas, outer, &frame, axis(0), axis(1));
        let per_unit = plot.rect.width() / (window.half * f64::from(SCREEN));
        Self { canvas, plot, origin: window.origin, per_unit }
    }

    /// The inside of the frame.
    pub fn rect(&self) -> Rect {
        self.plot.rect
    }

    /// The point of a normalised position on the page.
    pub fn at(&self, [x, y]: Position) -> Point {
        self.plot.at(f64::from(x) - self.origin[0], f64::from(y) - self.origin[1])
    }

    /// A length in units, on the page.
    pub fn length(&self, units: f32) -> f64 {
        f64::from(units) * self.per_unit
    }

    /// Whether a position is finite and visible.
    pub fn shows(&self, position: Position) -> bool {
        self.plot.rect.contains(self.at(position))
    }

    /// A filled convex polygon with an outline, clipped to the frame.
    pub fn shape(&self, corners: &[Point], fill: Color, pen: Pen) {
        self.canvas.within(&self.plot.rect, corners, |corners| {
            self.canvas.fill(corners, fill);
            self.canvas.outline(corners, pen);
        });
    }

    /// A line through positions, clipped to the frame; non-finite positions leave a gap.
    pub fn path(&self, positions: &[Position], pen: Pen) {
        for part in positions.split(|position| !position.iter().all(|value| value.is_finite())) {
            let points: Vec<Point> = part.iter().map(|position| self.at(*position)).collect();
            self.canvas.within(&self.plot.rect, &points, |points| self.canvas.line(points, pen));
        }
    }

    /// The task at its start, without the agent's tools.
    pub fn task(&self, task: &Task) {
        self.surroundings(task);
        for ball in task.marker.iter().map(|marker| &marker.ball).chain(&task.balls) {
            self.ring(ball.position, ball.radius, GREY);
        }
        self.ball(task.ball.position, task.ball.radius)
    }

    /// The parts of the task that do not move: tools, subgoals, goal.
    pub fn surroundings(&self, task: &Task) {
        let stages = task.stage_count();
        for (n, region) in task.subgoals.iter().enumerate() {
            self.subgoal(region, n, stages);
        }
        self.goal(&task.goal);
        task.tools.iter().for_each(|tool| self.tool(&tool.tool(), SCENE_TOOL));
        self.names(task, faded(WHITE, 0.0))
    }

    /// A tool with its true geometry; a bucket shows its rim.
    pub fn tool(&self, tool: &Tool, fill: Color) {
        let least = (THIN_WIDTH / self.per_unit) as f32;
        let outline: Vec<Point> = tool_outline(tool, least).into_iter().map(|corner| self.at(corner)).collect();
        match (tool.kind, outline[..].first_chunk()) {
            (ToolKind::Bucket, Some([a, b, c, d])) => {
                self.shape(&outline, faded(fill, 0.45), Pen::new(INK, THIN_WIDTH).dashed(&[1.2, 1.2]));
                let rim = Pen::new(INK, 2.4 * THIN_WIDTH);
                self.canvas.within(&self.plot.rect, &[*d, *a, *b, *c], |points| self.canvas.line(points, rim));
            }
            _ => self.shape(&outline, fill, Pen::new(INK, THIN_WIDTH)),
        }
    }

    /// The ball, as a disc of its true size.
    pub fn ball(&self, position: Position, radius: f32) {
        self.disc(position, radius, BALL)
    }

    /// A disc of `radius` units.
    pub fn disc(&self, position: Position, radius: f32, color: Color) {
        let corners = circle(self.at(position), self.length(radius));
        self.canvas.within(&self.plot.rect, &corners, |corners| self.canvas.fill(corners, color));
    }

    /// An empty circle of `radius` units.
    pub fn ring(&self, position: Position, radius: f32, color: Color) {
        self.shape(&circle(self.at(position), self.length(radius)), faded(WHITE, 0.0), Pen::new(color, THIN_WIDTH))
    }

    /// A moving object other than the target ball, empty.
    pub fn mover(&self, mover: &Mover) {
        let Mover { position, radius, angle } = *mover;
        let Some(angle) = angle else { return self.ring(position, radius, GREY) };
        let ([x, y], radius) = (self.at(position), self.length(radius));
        let (sin, cos) = f64::from(angle).sin_cos();
        // On the page, y points down.
        let corner = |[a, b]: [f64; 2]| [x + radius * (a * cos - b * sin), y - radius * (a * sin + b * cos)];
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner);
        self.shape(&corners, faded(WHITE, 0.0), Pen::new(GREY, THIN_WIDTH))
    }

    fn subgoal(&self, region: &Region, index: usize, stages: usize) {
        let color = stage_color(index, stages);
        let corners = circle(self.at(region.position), self.length(region.radius));
        self.shape(&corners, faded(color, 0.12), Pen::new(color, THIN_WIDTH).dashed(&[2.4, 1.6]))
    }

    fn goal(&self, goal: &Goal) {
        let (center, radius) = (self.at(goal.position), self.length(goal.radius));
        let pen = Pen::new(GREEN, 1.5 * THIN_WIDTH);
        let outline = match goal.shape {
            GoalShape::Basket => {
                let [x, y] = center;
                Rect::new(x - radius, y - radius, x + radius, y + radius).corners().to_vec()
            }
            GoalShape::Circle | GoalShape::Star | GoalShape::Ball => circle(center, radius),
        };
        self.shape(&outline, faded(GREEN, 0.25), pen);
        if goal.shape == GoalShape::Star {
            self.shape(&star(center, radius), faded(GREEN, 0.0), Pen::new(GREEN, THIN_WIDTH));
        }
    }

    /// The numbers of the subgoals and the goal's G, on discs of `plate` that keep them legible over other drawings.
    pub fn names(&self, task: &Task, plate: Color) {
        let stages = task.stage_count();
        for (n, region) in task.subgoals.iter().enumerate() {
            self.name(region.position, &(n + 1).to_string(), stage_color(n, stages), plate);
        }
        self.name(task.goal.position, "G", GREEN, plate)
    }

    /// A short name on a disc of `plate`.
    pub fn name(&self, position: Position, name: &str, color: Color, plate: Color) {
        let center = self.at(position);
        if !self.plot.rect.contains(center) {
            return;
        }
        self.canvas.dot(center, 0.62 * SMALL_SIZE, plate);
        self.canvas.text(center, name, TextFormat::SMALL.bold().centered().color(color))
    }
}

/// The outline of a five-pointed star; its inner corners lie on the pentagram.
fn star([x, y]: Point, radius: f64) -> Vec<Point> {
    const INNER: f64 = 0.381_966;
    (0..10)
        .map(|n| {
            let (sin, cos) = (std::f64::consts::PI * (f64::from(n) / 5.0 - 0.5)).sin_cos();
            let r = if n % 2 == 0 { radius } else { INNER * radius };
            [x + r * cos, y + r * sin]
        })
        .collect()
}
