//! The scene at one moment of an episode.

use super::Figure;
use super::canvas::Canvas;
use super::layout::note;
use super::scene::{Mover, PLACED_TOOL, Position, SceneView, Window};
use super::style::{MARGIN, SINGLE_COLUMN};
use super::table::Table;
use super::tasks::heading;
use mge_physics::Tool;
use mge_task::Task;

/// The scene at one moment of an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The task.
    pub task: Task,
    /// Time in seconds.
    pub time: f32,
    /// Normalised position of the ball.
    pub ball: Position,
    /// The marker, other balls and boxes.
    pub movers: Vec<Mover>,
    /// Tools placed so far.
    pub placed: Vec<Tool>,
    /// Stages (subgoals in order, then the goal) reached so far.
    pub reached: usize,
}

impl Figure for Moment {
    fn size(&self) -> [f64; 2] {
        [SINGLE_COLUMN, 1.05 * SINGLE_COLUMN]
    }

    fn draw(&self, canvas: &Canvas) {
        let stages = self.task.stage_count();
        let reached = if self.reached >= stages {
            "goal reached".to_owned()
        } else {
            format!("subgoals reached: {} of {}", self.reached, stages - 1)
        };
        let text = format!("t = {:.2} s, tools placed: {}, {reached}", self.time, self.placed.len());
        let rect = note(canvas, canvas.page().inset(MARGIN), &text);
        let view = SceneView::new(canvas, rect, &heading(&self.task.name), Window::SCREEN);
        view.surroundings(&self.task);
        self.placed.iter().for_each(|tool| view.tool(tool, PLACED_TOOL));
        self.movers.iter().for_each(|mover| view.mover(mover));
        view.ball(self.ball, self.task.ball.radius)
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["time_s", "ball_x", "ball_y", "tools_placed", "stages_reached"]);
        table.push(&[&self.time, &self.ball[0], &self.ball[1], &self.placed.len(), &self.reached]);
        table
    }
}
