//! Figure 3: the tasks.

use super::Figure;
use super::canvas::Canvas;
use super::geometry::Rect;
use super::layout::{Panel, note, note_height, panels, squares_height};
use super::scene::{SceneView, Window};
use super::style::{DOUBLE_COLUMN, MARGIN, SINGLE_COLUMN};
use super::table::Table;
use mge_task::Task;

/// Tasks side by side, three in a row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TaskGrid {
    /// The tasks in order.
    pub tasks: Vec<Task>,
}

/// The note that explains the shapes.
const LEGEND_NOTE: &str = "Black disc: ball at its start. Grey: tools of the scene (a thick rim marks a bucket). Dashed: subgoals in \
                           order of reach. G: goal.";

/// Columns of a grid of scenes.
pub(super) const COLUMNS: usize = 3;

/// Size of a page of `count` scenes, with space for `legend` and a note.
pub(super) fn page_size(count: usize, legend: f64, note: &str) -> [f64; 2] {
    let width = if count == 1 { SINGLE_COLUMN } else { DOUBLE_COLUMN };
    let columns = COLUMNS.min(count).max(1);
    [width, squares_height(width, count, columns, legend + note_height(width, note))]
}

/// Cells of a grid of `count` scenes, and the window of each.
pub(super) fn cells(rect: Rect, count: usize) -> Vec<(Rect, Window)> {
    let window = |panel: &Panel| Window { labels: [panel.x_label, panel.y_label], ..Window::SCREEN };
    panels(rect, count, COLUMNS.min(count)).into_iter().map(|panel| (panel.cell, window(&panel))).collect()
}

/// A task's display name: "Task 1" for `task1`.
pub(super) fn heading(name: &str) -> String {
    match name.strip_prefix("task") {
        Some(number) if !number.is_empty() && number.bytes().all(|digit| digit.is_ascii_digit()) => {
            format!("Task {number}")
        }
        _ => name.to_owned(),
    }
}

impl Figure for TaskGrid {
    fn size(&self) -> [f64; 2] {
        page_size(self.tasks.len(), 0.0, LEGEND_NOTE)
    }

    fn draw(&self, canvas: &Canvas) {
        let page = canvas.page().inset(MARGIN);
        if self.tasks.is_empty() {
            return canvas.placeholder(page, "no tasks");
        }
        let rect = note(canvas, page, LEGEND_NOTE);
        for (task, (cell, window)) in self.tasks.iter().zip(cells(rect, self.tasks.len())) {
            let title = format!("{}: place a {}", heading(&task.name), task.placeable.kind);
            SceneView::new(canvas, cell, &title, window).task(task);
        }
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["task", "object", "type", "order", "x", "y", "size_units"]);
        for task in &self.tasks {
            let mut row = |object: &str, kind: &str, order: Option<usize>, [x, y]: [f32; 2], size: f32| {
                table.push(&[&task.name, &object, &kind, &order, &x, &y, &size]);
            };
            row("ball", "", None, task.ball.position, task.ball.radius);
            if let Some(marker) = &task.marker {
                row("marker", "", None, marker.ball.position, marker.ball.radius);
            }
            for ball in &task.balls {
                row("other ball", "", None, ball.position, ball.radius);
            }
            for tool in &task.tools {
                row("tool", tool.kind.name(), None, tool.position, tool.tool().size as f32);
            }
            for (n, region) in task.subgoals.iter().enumerate() {
                row("subgoal", "", Some(n + 1), region.position, region.radius);
            }
            row("goal", "", Some(task.stage_count()), task.goal.position, task.goal.radius);
        }
        table
    }
}
