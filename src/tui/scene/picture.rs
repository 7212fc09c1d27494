//! Draws tools to scale in a scene, and small pictures of tools and tasks.

use ratatui::prelude::*;
use ratatui::widgets::canvas::Context;

use super::content::{Content, Overlays};
use super::object::Objects;
use super::view::{BOUNDS, View};
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::widgets::canvas;
use crate::tui::widgets::theme::Theme;
use mge_figures::tool_outline;
use mge_guidance::ActionPrior;
use mge_physics::{SCREEN, Tool, ToolKind, to_normalised};
use mge_task::Task;

/// How far, in units, the line for a tool's drive extends beyond half the tool's size.
const DRIVE: f64 = 5.0;
/// How far the rim of a bucket extends beyond its sides, as a share of its width: it has the shape of a box.
const RIM: f32 = 0.25;
/// Width and height, in units, of a picture of a small tool.
const WINDOW: f32 = 24.0;

/// Draws a tool on a canvas of the whole scene, magnified `zoom` times about the middle. If it drives bodies, a line
/// from its centre shows the direction.
pub(super) fn draw_tool(context: &mut Context, tool: &Tool, zoom: f32, colour: Color, filled: bool) {
    let zoomed = |position: [f32; 2]| position.map(|value| zoom * value);
    let corners: Vec<_> = tool_outline(tool, 0.0).into_iter().map(zoomed).collect();
    if filled {
        canvas::fill(context, &corners, colour);
    } else {
        canvas::outline(context, &corners, colour);
    }
    if tool.kind == ToolKind::Bucket {
        let mut upper = corners;
        upper.sort_by(|a, b| b[1].total_cmp(&a[1]));
        let beyond = |[x, y]: [f32; 2], from: [f32; 2]| [x + RIM * (x - from[0]), y + RIM * (y - from[1])];
        canvas::path(context, &[beyond(upper[0], upper[1]), beyond(upper[1], upper[0])], colour);
    }
    if let Some(drive) = tool.drive() {
        let length = tool.size / 2.0 + DRIVE;
        let tip = [0, 1].map(|axis| (tool.position[axis] + length * drive[axis]) as f32);
        canvas::path(context, &[zoomed(to_normalised(tool.centre())), zoomed(to_normalised(tip))], colour);
    }
}

/// Draws a small picture of a tool.
pub fn picture(tool: &Tool, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let tool = tool.at([f64::from(SCREEN) / 2.0; 2]);
    let widest = tool.half_extents().into_iter().fold(0.0, f32::max);
    let zoom = SCREEN / WINDOW.max(2.7 * widest);
    canvas::draw(View::fit(area).area, theme.marker, BOUNDS, buffer, |context| {
        draw_tool(context, &tool, zoom, theme.tool, true);
    });
}

/// Draws a picture of a task, with the clusters given.
pub fn task_picture(task: &Task, prior: Option<&ActionPrior>, area: Rect, theme: &Theme, buffer: &mut Buffer) {
    let content = Content {
        objects: Objects { task, proposed: &[] },
        frame: &PlaybackFrame { ball: task.ball.position, ..PlaybackFrame::default() },
        overlays: Overlays { samples: true, ..Overlays::default() },
        prior: prior.map(|prior| (prior, false)),
        heat: None,
        choice: None,
        predicted: &[],
        truth: &[],
        selected: None,
        ghost: None,
    };
    super::draw(&content, area, theme, buffer);
}
