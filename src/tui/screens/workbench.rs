//! The Scene screen, with curves and status beside the scene, and the Edit screen; the pane of a scene: its task, episode
//! and overlays, and a caption in its lower border.

use std::sync::Arc;

use ratatui::prelude::*;
use ratatui::widgets::{Paragraph, Row, Wrap};

use super::edit::tool_text;
use super::pane::{fitted, lines, pane};
use super::scene::Scene;
use super::{HitRegion, HitRegions, Screens, Ui, row_regions, status, training};
use crate::tui::scene::{Content, Objects, draw as draw_scene, legend};
use crate::tui::view::Choice;
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::widgets::columns::{fitting, shortened, width};
use crate::tui::widgets::layout::split;
use crate::tui::widgets::list;
use mge_base::text::printable;
use mge_run::Metric;
use mge_task::{Object, Part, Region, Task, shipped_name};

/// Rows of the status pane.
const STATUS: u16 = 13;

/// Draws scene, curves and status side by side.
pub fn draw(ui: &Ui, screens: &Screens, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let [left, right] = split(area);
    let legend = scene_pane(ui, &screens.scene, left, buffer, regions);
    if let Some(legend) = legend {
        return legend_pane(ui, legend, right, buffer);
    }
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Length(STATUS)]).areas(right);
    let metrics: &[Metric] = if above.height >= 14 { &[Metric::Success, Metric::Return] } else { &[Metric::Success] };
    training::stack(&screens.beside, &screens.runs, ui, metrics, above, buffer, regions);
    status::draw(ui, below, buffer);
}

/// Rows reserved for the task pane when there are many objects.
const TASK: u16 = 5;

/// Draws the scene and the list of its objects.
pub fn draw_edit(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let [left, right] = split(area);
    let Some(legend) = scene_pane(ui, scene, left, buffer, regions) else {
        return objects(ui, scene, right, buffer, regions);
    };
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Fill(1)]).areas(right);
    objects(ui, scene, above, buffer, regions);
    legend_pane(ui, legend, below, buffer);
}

/// Draws the legend of the scene beside it.
fn legend_pane(ui: &Ui, legend: Vec<Line<'static>>, area: Rect, buffer: &mut Buffer) {
    let title = ui.text("legend · {show-legend} hides it");
    let inside = pane(&title, area, ui.theme, buffer);
    Paragraph::new(legend).wrap(Wrap { trim: false }).render(inside, buffer);
}

fn objects(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let Ui { view, theme, .. } = *ui;
    let all = view.objects().all();
    let height = (all.len() as u16 + 2).min(area.height.saturating_sub(TASK));
    let [upper, lower] = Layout::vertical([Constraint::Length(height), Constraint::Fill(1)]).areas(area);
    let inside = pane("objects · x, y, size", upper, theme, buffer);
    let row = |index: usize| {
        let object: Object = all[index];
        let [px, py] = view.objects().position(object).unwrap_or_default();
        let size = view.objects().size(object).unwrap_or_default();
        let of = |text: String| Text::from(text).right_aligned();
        let [px, py, size] = [format!("{px:.2}"), format!("{py:.2}"), format!("{size:.1}")].map(of);
        Row::new([Text::from(view.objects().name(object)), px, py, size])
    };
    let widths = [Constraint::Max(16), Constraint::Length(6), Constraint::Length(6), Constraint::Length(5)];
    let selected = scene.selected().and_then(|object| all.iter().position(|known| *known == object));
    regions.extend(row_regions(list::draw(all.len(), selected, row, &widths, inside, theme, buffer)));
    if lower.height >= 3 {
        let inside = pane("task", lower, theme, buffer);
        Text::from(fitted(ui, about(ui, inside.width), inside.height, ": {help} has the keys")).render(inside, buffer);
    }
}

/// Lines about the task and its edits.
fn about(ui: &Ui, width: u16) -> Vec<Line<'static>> {
    let Ui { view, theme, .. } = *ui;
    let mut text: Vec<Line> = Vec::new();
    let mut put = |paragraph: &str, style: Style| text.extend(lines(paragraph, width, style));
    // The present state comes first: a small terminal shows nothing else.
    if view.dirty {
        put(&ui.text("edited, not saved: {save} saves"), Style::new().fg(theme.warn));
    }
    if let Some(proposals) = proposals(ui) {
        put(&proposals, Style::new().fg(theme.warn));
    }
    let (clusters, style) = status::clusters(ui);
    put(&format!("clusters {clusters}"), style);
    put(&format!("\n{}", printable(&view.task.description)), Style::new());
    let placeable = view.task.placeable;
    let file = match &view.file {
        Some(file) => file.display().to_string(),
        None if shipped_name(&view.task.name).is_some() => "shipped with the program".to_owned(),
        None => ui.text("kept with its run; {save-as} saves it as a file"),
    };
    let tool = tool_text(&placeable.tool([0.0; 2]), true);
    put(&ui.text(&format!("the agent places: {tool}; {{agent-tool}} chooses another")), theme.faint());
    put(&format!("{file}\n\n"), theme.faint());
    let help = "{next-object} selects, arrows or the mouse move, {coordinates} types coordinates. {add-subgoal} adds a subgoal, {add-tool} a tool, {delete} deletes; {propose-subgoals} lets the model propose subgoals. {shrink} and {grow} resize, {earlier} and {later} reorder; {properties} types the properties of a tool, the wheel turns it. {undo} undoes, {redo} does it again.";
    put(&ui.text(help), theme.faint());
    text
}

/// The proposed subgoals or the search for them, with the keys to answer.
fn proposals(ui: &Ui) -> Option<String> {
    let view = ui.view;
    if let Some((tried, count)) = view.proposing {
        // The number is unknown before the first report.
        let of = if count > 0 { format!(", proposal {} of {count}", (tried + 1).min(count)) } else { String::new() };
        return Some(format!("looking for subgoals{of}"));
    }
    let count = view.proposed.len();
    let answers = ui.text("{accept-proposals} accepts all in place of the task's own, {reject-proposals} rejects all; {add-subgoal} adds the selected one to the task's own, {delete} rejects it");
    (count > 0).then(|| format!("proposed: {count}; {answers}"))
}

/// Draws the scene. Returns its legend, if that is to be shown.
pub fn scene_pane(
    ui: &Ui,
    scene: &Scene,
    area: Rect,
    buffer: &mut Buffer,
    regions: &mut HitRegions,
) -> Option<Vec<Line<'static>>> {
    let subject = ui.subject;
    let others = width(&format!("{} · {}", subject.task.name, subject.episode.title("")));
    // With the beginning of what is missing.
    let room = usize::from(area.width).saturating_sub(others + 7);
    let run = subject.run().map_or_else(String::new, |run| shortened(&run.name, room, true));
    let title =
        [vec![subject.task.name.clone(), subject.episode.title(&run)], scene.missing(subject)].concat().join(" · ");
    let inside = pane(&title, area, ui.theme, buffer);
    // A past episode has its own task; edits apply to the session's.
    let (task, proposed) = match subject.choice {
        Choice::Past(_) => (subject.task.clone(), Vec::new()),
        _ => while_dragging(ui, scene),
    };
    let mut frame = subject.episode.at(scene.player.step());
    if matches!(scene.dragged(), Some((Object::Part(Part::Target), _))) {
        frame = PlaybackFrame { ball: task.ball.position, ..PlaybackFrame::default() };
    }
    let (predicted, truth) = scene.prediction(subject);
    let agent_view = scene.agent_view();
    let content = Content {
        objects: Objects { task: &task, proposed: &proposed },
        frame: &frame,
        overlays: scene.overlays(),
        prior: subject.clusters.as_ref().map(|clusters| (&*clusters.prior, clusters.stale)),
        heat: agent_view.map(|view| &view.heat),
        choice: agent_view.map(|view| view.choice),
        predicted,
        truth: &truth,
        selected: scene.selected(),
        ghost: scene.hand.as_ref().and_then(|hand| hand.ghost.as_ref()),
    };
    let view = draw_scene(&content, inside, ui.theme, buffer);
    regions.push((view.area, HitRegion::Scene(view)));
    caption(ui, scene, &frame, area, buffer);
    content.overlays.legend.then(|| legend(&content, ui.theme))
}

/// The task and the proposed subgoals, with the dragged object at the mouse.
fn while_dragging(ui: &Ui, scene: &Scene) -> (Arc<Task>, Vec<Region>) {
    let view = ui.view;
    let mut proposed = view.proposed.clone();
    let Some((object, to)) = scene.dragged() else { return (view.task.clone(), proposed) };
    let mut moved = Task::clone(&view.task);
    match object {
        Object::Proposal(index) => proposed.get_mut(index).into_iter().for_each(|p| p.position = to),
        Object::Part(part) => moved.position_mut(part).into_iter().for_each(|position| *position = to),
    }
    (Arc::new(moved), proposed)
}

/// Draws action, speed and reward in the lower border of the pane; during hand play, the held tool.
fn caption(ui: &Ui, scene: &Scene, frame: &PlaybackFrame, area: Rect, buffer: &mut Buffer) {
    let player = &scene.player;
    let speed = || format!("speed x{}", player.speed);
    let state = if player.is_moving() { speed() } else { "stopped".to_owned() };
    let room = usize::from(area.width.saturating_sub(4));
    let mut parts = vec![format!("action {}", frame.action), state, format!("reward {:.2}", frame.reward)];
    parts.extend(ui.subject.facts());
    if !player.is_moving() {
        parts.push(speed());
    }
    let mut text = format!(" {} ", fitting(&parts, room.saturating_sub(2)));
    let mut style = ui.theme.faint();
    if let Some((_, [x, y])) = scene.dragged() {
        text = format!(" x {x:.2}, y {y:.2} ");
    } else if let Some(hand) = &scene.hand {
        let refusal = hand.ghost.as_ref().and_then(|ghost| ghost.refusal.as_deref());
        if refusal.is_some() {
            style = Style::new().fg(ui.theme.bad);
        }
        let [x, y] = hand.cursor;
        text = format!(" x {x:.2}, y {y:.2} {} ", refusal.unwrap_or(if hand.ghost.is_some() { "free" } else { "" }));
        if let Some(end) = ui.view.hand.env.snapshot().end() {
            text = format!(" the episode is over: {end} ");
        }
    }
    buffer.set_stringn(area.x + 2, area.bottom() - 1, shortened(&text, room, false), room, style);
}
