//! Figure 1: launches of the ball at single tools.

use super::Figure;
use super::axes::number;
use super::canvas::{Canvas, Pen};
use super::layout::{LEGEND, Mark, NOTE, around_panels, panels, squares_height};
use super::scene::{Position, SCENE_TOOL, SceneView, Window};
use super::style::{BLUE, DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, VERMILLION, faded};
use super::table::Table;
use mge_physics::to_units;
use mge_task::ToolSpec;

/// The tools, with a sample of the launches at each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Launches {
    /// One panel per tool.
    pub tools: Vec<ToolLaunches>,
}

/// A tool and trajectories of the ball around it.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolLaunches {
    /// The tool in its position.
    pub tool: ToolSpec,
    /// Radius of the ball in units.
    pub ball_radius: f32,
    /// Trajectories of the launches to show: normalised positions of the ball, step by step.
    pub trajectories: Vec<Vec<Position>>,
    /// Number of one-step observations of this tool in the whole data set.
    pub observations: usize,
}

/// Surface distance, in units, below which ball and tool are in contact: about what the ball travels in a step.
const CONTACT_MARGIN: f32 = 1.0;

impl ToolLaunches {
    /// Index of the first position in contact with the tool; the trajectory's length if there is none.
    fn contact(&self, trajectory: &[Position]) -> usize {
        let tool = self.tool.tool();
        let touches = |position: &Position| {
            position.iter().all(|p| p.is_finite())
                && tool.surface(to_units(*position)).0 <= self.ball_radius + CONTACT_MARGIN
        };
        trajectory.iter().position(touches).unwrap_or(trajectory.len())
    }

    fn draw(&self, view: &SceneView<'_>, canvas: &Canvas) {
        for trajectory in &self.trajectories {
            let contact = self.contact(trajectory);
            view.path(&trajectory[..trajectory.len().min(contact + 1)], Pen::new(faded(BLUE, 0.55), 0.6));
            view.path(&trajectory[contact.min(trajectory.len())..], Pen::new(faded(VERMILLION, 0.55), 0.6));
        }
        for start in self.trajectories.iter().filter_map(|trajectory| trajectory.first()) {
            if view.shows(*start) {
                canvas.dot(view.at(*start), 1.0, BLUE);
            }
        }
        view.tool(&self.tool.tool(), SCENE_TOOL);
        // The ball of the first launch, to scale.
        if let Some(start) = self.trajectories.first().and_then(|trajectory| trajectory.first()) {
            view.ring(*start, self.ball_radius, GREY);
        }
    }
}

impl Launches {
    /// Half the width of a panel, large enough for every start.
    fn reach(&self) -> f64 {
        let distance = |tool: &ToolLaunches, start: &Position| {
            f32::max((start[0] - tool.tool.position[0]).abs(), (start[1] - tool.tool.position[1]).abs())
        };
        let starts = self.tools.iter().flat_map(|tool| {
            tool.trajectories.iter().filter_map(|trajectory| trajectory.first()).map(move |start| distance(tool, start))
        });
        f64::from(starts.filter(|reach| reach.is_finite()).fold(0.4, f32::max) + 0.12).min(1.0)
    }
}

impl Figure for Launches {
    fn size(&self) -> [f64; 2] {
        let panels = self.tools.len().clamp(3, 5);
        [DOUBLE_COLUMN, squares_height(DOUBLE_COLUMN, panels, panels, LEGEND + 2.0 * NOTE)]
    }

    fn draw(&self, canvas: &Canvas) {
        let shown: usize = self.tools.iter().map(|tool| tool.trajectories.len()).sum();
        let counts: Vec<String> = self
            .tools
            .iter()
            .map(|tool| format!("{} {}", tool.tool.kind, number(tool.observations as f64, 0)))
            .collect();
        let text = format!(
            "Normalised positions relative to the tool (1 = 42 units = half the screen). {shown} launches are shown; one-step \
             observations in the data: {}. Grey ring: a ball to scale.",
            counts.join(", ")
        );
        let marks = [
            (Mark::Dot(BLUE), "launch".to_owned()),
            (Mark::Line(Pen::new(BLUE, 1.4 * LINE_WIDTH)), "until the ball meets the tool".to_owned()),
            (Mark::Line(Pen::new(VERMILLION, 1.4 * LINE_WIDTH)), "afterwards".to_owned()),
        ];
        let empty = self.tools.is_empty().then_some("no launches");
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, &text, &marks) else { return };
        let half = self.reach();
        for (tool, place) in self.tools.iter().zip(panels(rect, self.tools.len(), self.tools.len())) {
            let origin = tool.tool.position.map(f64::from);
            let names = ["\u{394}x to the tool", "\u{394}y to the tool"];
            let window = Window { center: origin, half, origin, names, labels: [place.x_label, place.y_label] };
            let view = SceneView::new(canvas, place.cell, tool.tool.kind.name(), window);
            tool.draw(&view, canvas);
        }
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["tool", "observations", "launch", "step", "x", "y", "after_contact"]);
        for tool in &self.tools {
            for (launch, trajectory) in tool.trajectories.iter().enumerate() {
                let contact = tool.contact(trajectory);
                for (step, [x, y]) in trajectory.iter().enumerate() {
                    table.push(&[&tool.tool.kind.name(), &tool.observations, &launch, &step, x, y, &(step >= contact)]);
                }
            }
        }
        table
    }
}
