//! Draws the scene, from back to front.

use image::Luma;
use image::imageops::sample_bilinear;
use ratatui::prelude::*;
use ratatui::widgets::canvas::Context;

use super::content::{Content, Heat, range};
use super::legend;
use super::picture::draw_tool;
use super::view::{BOUNDS, View};
use crate::tui::widgets::canvas::{self, ellipse};
use crate::tui::widgets::theme::{ASCII, Depth, Theme};
use mge_physics::{SCREEN, Tool, ToolKind, to_units};
use mge_trainer::Source;

/// Draws the scene into the largest square of `area` and returns that square.
pub fn draw(content: &Content, area: Rect, theme: &Theme, buffer: &mut Buffer) -> View {
    let view = View::fit(area);
    canvas::draw(view.area, theme.marker, BOUNDS, buffer, |context| {
        let mut painter = Painter { context, theme };
        painter.trail(content);
        painter.clusters(content);
        painter.tools(content);
        painter.regions(content);
        painter.ghost(content);
        // The ball has its cells to itself, so that nothing behind it changes its shape or colour.
        painter.context.layer();
        painter.ball(content);
    });
    if let Some(heat) = content.heat.filter(|_| content.overlays.critic) {
        shade(heat, view, theme, buffer);
    }
    Labels { view, theme, buffer }.all(content);
    if let Some(scale) = legend::scale(content, theme) {
        let row = Rect { y: view.area.bottom().saturating_sub(1), height: 1, ..view.area }.intersection(view.area);
        scale.render(row, buffer);
    }
    view
}

struct Painter<'a, 'b> {
    context: &'a mut Context<'b>,
    theme: &'a Theme,
}

impl Painter<'_, '_> {
    fn dots(&mut self, path: &[[f32; 2]], colour: Color, every: usize) {
        canvas::dots(self.context, path.iter().step_by(every).copied(), colour);
    }

    /// A predicted path of the ball: a line with the ball at its end.
    fn predicted(&mut self, path: &[[f32; 2]], radius: f32) {
        canvas::path(self.context, path, self.theme.accent);
        if let Some(end) = path.last() {
            self.circle(*end, radius, self.theme.accent);
        }
    }

    fn trail(&mut self, content: &Content) {
        self.dots(&content.frame.trail, self.theme.trail, 2);
        if content.overlays.model {
            self.dots(content.truth, self.theme.good, 4);
            self.predicted(content.predicted, content.objects.task.ball.radius);
        }
    }

    fn clusters(&mut self, content: &Content) {
        for (colour, stage) in content.stages(self.theme) {
            if content.overlays.samples {
                self.dots(&stage.actions, colour, 1);
            }
            for cluster in stage.clusters.iter().filter(|_| content.overlays.clusters) {
                for sigmas in [1.0, 2.0] {
                    let corners = ellipse(cluster.mean, cluster.std.map(|std| sigmas * std));
                    canvas::outline(self.context, &corners, colour);
                }
            }
        }
    }

    fn tool(&mut self, tool: &Tool, colour: Color, filled: bool) {
        draw_tool(self.context, tool, 1.0, colour, filled);
    }

    fn tools(&mut self, content: &Content) {
        for tool in &content.objects.task.tools {
            self.tool(&tool.tool(), self.theme.tool, true);
        }
        for (tool, source) in &content.frame.placed {
            let colour = if *source == Source::Clusters { self.theme.stage(0) } else { self.theme.placed };
            self.tool(tool, colour, true);
        }
        if let Some(tool) = &content.frame.blocked {
            self.tool(tool, self.theme.bad, false);
        }
    }

    fn circle(&mut self, position: [f32; 2], radius: f32, colour: Color) {
        canvas::outline(self.context, &circle(position, radius), colour);
    }

    fn regions(&mut self, content: &Content) {
        for subgoal in content.objects.task.marker.iter().flat_map(|marker| &marker.subgoals) {
            self.circle(subgoal.position, subgoal.radius, self.theme.dim);
        }
        for (index, subgoal) in content.objects.task.subgoals.iter().enumerate() {
            let reached = content.frame.reached.contains(&index);
            let colour = if reached { self.theme.dim } else { self.theme.stage(index) };
            self.circle(subgoal.position, subgoal.radius, colour);
        }
        for proposal in content.objects.proposed {
            let corners = circle(proposal.position, proposal.radius);
            canvas::dots(self.context, corners.into_iter().step_by(2), self.theme.warn);
        }
        let goal = content.objects.task.goal;
        self.circle(goal.position, goal.radius, self.theme.goal);
        self.circle(goal.position, goal.radius * 0.75, self.theme.goal);
    }

    fn ball(&mut self, content: &Content) {
        let task = content.objects.task;
        let others = task.marker.iter().map(|marker| &marker.ball).chain(&task.balls);
        for ball in others {
            self.circle(ball.position, ball.radius, self.theme.ball);
        }
        for moving in &task.boxes {
            let shape = Tool::new(ToolKind::Box, to_units(moving.position.map(f64::from)));
            self.tool(&shape.with_size(moving.size.into()), self.theme.ball, false);
        }
        canvas::fill(self.context, &circle(content.frame.ball, task.ball.radius), self.theme.ball);
    }

    fn ghost(&mut self, content: &Content) {
        if let Some(choice) = content.choice.as_ref().filter(|_| content.overlays.actor) {
            self.tool(choice, self.theme.warn, false);
        }
        let Some(ghost) = content.ghost else { return };
        self.predicted(&ghost.predicted, content.objects.task.ball.radius);
        let colour = if ghost.refusal.is_none() { self.theme.good } else { self.theme.bad };
        self.tool(&ghost.tool, colour, false);
    }
}

/// The corners of a circle with a radius in units.
fn circle(position: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
    ellipse(position, [2.0 * radius / SCREEN; 2])
}

/// Colours the background of every cell by the value of placing the tool there.
fn shade(heat: &Heat, view: View, theme: &Theme, buffer: &mut Buffer) {
    let Some([low, high]) = range(heat) else { return };
    let share = |value: f32| (value - low) / (high - low).max(f32::EPSILON);
    for row in 0..view.area.height {
        for column in 0..view.area.width {
            let place = |at: u16, length: u16| (f32::from(at) + 0.5) / f32::from(length);
            let at = (place(column, view.area.width), place(row, view.area.height));
            let value = sample_bilinear(heat, at.0, at.1).map_or(f32::NAN, |Luma([value])| value);
            let Some(cell) = buffer.cell_mut((view.area.x + column, view.area.y + row)) else { continue };
            if theme.depth == Depth::None || theme.marker == ASCII {
                if cell.symbol() == " " {
                    cell.set_char([' ', '.', ':', '+', '#'][(share(value) * 4.0).clamp(0.0, 4.0) as usize]);
                }
            } else {
                cell.set_bg(theme.heat(share(value)));
            }
        }
    }
}

struct Labels<'a> {
    view: View,
    theme: &'a Theme,
    buffer: &'a mut Buffer,
}

impl Labels<'_> {
    fn put(&mut self, position: [f32; 2], text: &str, style: Style) {
        if let Some((x, y)) = self.view.cell(position) {
            let room = usize::from(self.view.area.right() - x);
            self.buffer.set_stringn(x, y, text, room, style);
        }
    }

    fn all(&mut self, content: &Content) {
        let bold = |colour: Color| Style::new().fg(colour).add_modifier(Modifier::BOLD);
        for (index, subgoal) in content.objects.task.subgoals.iter().enumerate() {
            let reached = content.frame.reached.contains(&index);
            let text = if reached { "✓".to_owned() } else { (index + 1).to_string() };
            let colour = if reached { self.theme.good } else { self.theme.stage(index) };
            self.put(subgoal.position, &text, bold(colour));
        }
        for (index, proposal) in content.objects.proposed.iter().enumerate() {
            self.put(proposal.position, &format!("{}?", index + 1), bold(self.theme.warn));
        }
        let goal = if content.frame.goal { "★" } else { "G" };
        self.put(content.objects.task.goal.position, goal, bold(self.theme.goal));
        if content.overlays.clusters {
            for (colour, stage) in content.stages(self.theme) {
                stage.clusters.iter().for_each(|cluster| self.put(cluster.mean, "+", Style::new().fg(colour)));
            }
        }
        if self.theme.marker == ASCII || self.view.area.height < 12 {
            self.put(content.frame.ball, "●", bold(self.theme.ball));
        }
        self.selection(content);
    }

    /// Brackets around the selected object, and its name.
    fn selection(&mut self, content: &Content) {
        let Some(object) = content.selected else { return };
        let Some((x, y)) = content.objects.position(object).and_then(|position| self.view.cell(position)) else {
            return;
        };
        let style = self.theme.strong().add_modifier(Modifier::REVERSED);
        let area = self.view.area;
        let name = content.objects.name(object);
        let reach = 1 + (content.objects.size(object).unwrap_or(0.0) / 42.0 * f32::from(area.height)) as u16;
        if x >= area.x + reach {
            self.buffer.set_string(x - reach, y, "[", style);
        }
        if x + reach < area.right() {
            self.buffer.set_string(x + reach, y, "]", style);
        }
        let below = y + reach / 2 + 1;
        let row = if below < area.bottom() { below } else { y.saturating_sub(reach / 2 + 1).max(area.y) };
        let start = (x + 1).saturating_sub(name.len() as u16 / 2).max(area.x);
        self.buffer.set_stringn(start, row, &name, usize::from(area.right() - start), style);
    }
}
