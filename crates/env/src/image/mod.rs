//! Images like CREATE's observations: 84 x 84 pixels of 3 bytes, drawn without a display, row 0 at the top, mirrored
//! left to right.
//!
//! Balls, polygons, segments and planks are drawn as in CREATE. Objects for which CREATE uses pictures, such as
//! ladders and belts, are drawn as plain shapes in similar colours.

mod canvas;
#[cfg(test)]
mod tests;

use super::episode::{Snapshot, goal_object};
use canvas::{Canvas, Colour, Pixel};
use mge_physics::{Motion, ObjectId, SCREEN, Tool, ToolKind, World, exact, to_units};
use mge_task::{GoalShape, Part, Region, Task};

pub use canvas::{IMAGE_LEN, IMAGE_SIDE};

const TARGET: Colour = [244, 91, 105];
const MARKER: Colour = [121, 173, 220];
const GOAL: Colour = [124, 253, 46];
const SUBGOAL: Colour = [211, 254, 185];
const BALL: Colour = [0, 0, 0];
const BASKETBALL: Colour = [248, 133, 0];
const MOVING_BOX: Colour = [140, 124, 103];
/// `FIXED` is for solid tools of low elasticity, `BOUNCY` for those that keep most of the energy or add some.
const FIXED: Colour = [250, 133, 53];
const BOUNCY: Colour = [8, 103, 136];
const PLANK: Colour = [250, 145, 73];
const WALL: Colour = [70, 130, 180];
const EDGE: Colour = [176, 196, 222];

/// Balls with this radius are CREATE's basketballs.
const BASKETBALL_RADIUS: f32 = 3.5;
/// Tools at least as elastic as this are drawn as bouncy ones.
const BOUNCY_FROM: f64 = 0.65;
/// Segments at least this long are walls at the edge of the screen.
const EDGE_LENGTH: f64 = 84.0;

/// Draws the scene.
pub(super) fn draw(now: &Snapshot, pixels: &mut [u8; IMAGE_LEN]) {
    let (task, world) = (now.task(), now.world());
    let mut image = Image { canvas: Canvas::new(pixels), task, now };
    image.part(Part::Target);
    image.part(Part::Goal);
    let tools = world.tools().collect::<Vec<_>>();
    for (index, tool) in tools.iter().enumerate().skip(task.tools.len()) {
        image.tool(tool, index, true);
    }
    for part in task.parts() {
        match part {
            Part::Target | Part::Goal => {}
            Part::Tool(index) => image.tool(tools[index], index, false),
            part => image.part(part),
        }
    }
}

struct Image<'a> {
    canvas: Canvas<'a>,
    task: &'a Task,
    now: &'a Snapshot,
}

/// The pixel of a point in units: the origin is the upper left corner, coordinates are truncated.
fn pixel([x, y]: [f64; 2]) -> Pixel {
    [x as i32, (f64::from(SCREEN) - y) as i32]
}

impl Image<'_> {
    fn world(&self) -> &World {
        self.now.world()
    }

    /// Draws anything except tools.
    fn part(&mut self, part: Part) {
        let Self { task, now, .. } = *self;
        let marker = usize::from(task.marker.is_some());
        let others = 1 + marker + usize::from(task.goal.shape == GoalShape::Ball);
        match part {
            Part::Target => self.ball(0, TARGET),
            Part::Marker => self.ball(1, MARKER),
            Part::Goal => self.goal(),
            Part::Ball(index) => self.ball(others + index, BALL),
            Part::Box(index) => self.moving_box(others + task.balls.len() + index),
            Part::Subgoal(index) if !now.reached()[index] => self.subgoal(&task.subgoals[index]),
            Part::MarkerSubgoal(index) if !now.reached_by_marker()[index] => {
                task.marker.iter().for_each(|marker| self.subgoal(&marker.subgoals[index]));
            }
            Part::Subgoal(_) | Part::MarkerSubgoal(_) | Part::Tool(_) => {}
        }
    }

    fn subgoal(&mut self, region: &Region) {
        self.disc(to_units(region.position.map(exact)), region.radius, SUBGOAL);
    }

    fn disc(&mut self, centre: [f64; 2], radius: f32, colour: Colour) {
        self.canvas.disc(pixel(centre), radius as i32, colour);
    }

    fn ball(&mut self, index: usize, colour: Colour) {
        let (motion, radius) = (self.world().motion(index), self.world().ball_material(index).radius);
        self.disc(motion.position, radius, if radius == BASKETBALL_RADIUS { BASKETBALL } else { colour });
    }

    fn moving_box(&mut self, index: usize) {
        let Some(moving) = self.world().moving_box(index) else { return };
        let Motion { position, angle, .. } = self.world().motion(index);
        let tool = Tool { size: exact(moving.size), angle, ..Tool::new(ToolKind::Box, position) };
        self.polygon(&tool, MOVING_BOX);
    }

    fn goal(&mut self) {
        let goal = &self.task.goal;
        let ([x, y], radius) = (to_units(goal.position.map(exact)), exact(goal.radius));
        match (goal.shape, goal_object(self.task)) {
            (_, ObjectId::Ball(index)) => self.ball(index, GOAL),
            (GoalShape::Star, _) => {
                let corner = |index: usize| {
                    let reach = if index.is_multiple_of(2) { radius } else { radius / 2.0 };
                    let (sin, cos) = pxfm::f_sincos(std::f64::consts::PI * (0.5 + index as f64 / 5.0));
                    pixel([x + reach * cos, y + reach * sin])
                };
                let corners: [Pixel; 10] = std::array::from_fn(corner);
                self.canvas.polygon(&corners, GOAL);
            }
            (GoalShape::Basket, _) => {
                let tool = Tool { size: 2.0 * radius, ..Tool::new(ToolKind::Box, [x, y]) };
                self.polygon(&tool, GOAL);
            }
            _ => self.disc([x, y], goal.radius, GOAL),
        }
    }

    fn tool(&mut self, tool: &Tool, index: usize, is_placed: bool) {
        use ToolKind::{Box, Circle};
        let colour = colour(tool, is_placed);
        match tool.kind {
            Circle => self.disc(tool.position, tool.size as f32, colour),
            Box if tool.angle == 0.0 => {
                let [x, y] = tool.position;
                let corner = [x - tool.size / 2.0, f64::from(SCREEN) - y - tool.size / 2.0].map(|p| p as i32);
                self.canvas.rectangle(corner, [tool.size as i32; 2], colour);
            }
            kind if kind.is_hinged() => self.plank(tool, index),
            kind if kind.is_segment() => self.segment(tool, colour),
            _ => self.polygon(tool, colour),
        }
    }

    fn polygon(&mut self, tool: &Tool, colour: Colour) {
        let corners: Vec<Pixel> = tool.corner_points().into_iter().map(pixel).collect();
        self.canvas.polygon(&corners, colour);
    }

    fn segment(&mut self, tool: &Tool, colour: Colour) {
        if let [a, b] = tool.corner_points()[..] {
            self.canvas.line(pixel(a), pixel(b), tool.radius >= 1.0, colour);
        }
    }

    /// A plank, the triangle under its centre, and the weight of a see-saw.
    fn plank(&mut self, tool: &Tool, index: usize) {
        let (Some(Motion { position: [x, y], angle, .. }), weight) = self.world().plank(index) else { return };
        let (sin, cos) = pxfm::f_sincos(angle + tool.tilt());
        let [along_x, along_y] = [cos, sin].map(|part| part * tool.size / 2.0);
        let ends = [[x - along_x, y - along_y], [x + along_x, y + along_y]].map(pixel);
        self.canvas.line(ends[0], ends[1], false, PLANK);
        let [[left, bottom], right] = [[x - 2.0, y - 2.0], [x + 2.0, y - 2.0]].map(pixel);
        self.canvas.polygon(&[pixel([x, y]), [left - 1, bottom], right], PLANK);
        if let Some(weight) = weight {
            self.canvas.disc(pixel(weight.position), 1, PLANK);
        }
    }
}

fn colour(tool: &Tool, is_placed: bool) -> Colour {
    use ToolKind::{Belt, Bucket, Cannon, Fan, Floor, Funnel, Ladder, Ramp, Wall};
    match tool.kind {
        Wall | Floor | Ramp if tool.size >= EDGE_LENGTH => EDGE,
        Wall | Floor | Ramp if !is_placed => WALL,
        Cannon => [218, 37, 29],
        Fan | Belt => [91, 123, 152],
        Funnel => [146, 146, 146],
        Bucket => [152, 74, 0],
        Ladder => [205, 177, 126],
        _ if tool.elasticity >= BOUNCY_FROM => BOUNCY,
        _ => FIXED,
    }
}
