//! The Scene screen, with curves and status beside the scene, and the Edit screen.

use std::sync::Arc;

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Text};
use ratatui::widgets::{Row, Widget};

use super::pane::{WIDE, hint, lines, pane};
use super::scene::{self, Scene};
use super::{HitRegion, HitRegions, Screens, Ui, status, tools, training};
use crate::physics::catalogue_tool;
use crate::run::Metric;
use crate::task::{Region, Task};
use crate::tui::layers::tool_in_words;
use crate::tui::scene::{Content, Object, Objects, Overlays, draw as draw_scene};
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::view::{Beside, Choice};
use crate::tui::widgets::columns::{fitting, shortened};
use crate::tui::widgets::list;

/// Rows of the status pane, without the row of practice.
const STATUS: u16 = 13;
/// Screen height from which the row of practice fits, too.
const ROOMY: u16 = 30;

/// Draws scene, curves and status side by side.
pub fn draw(ui: &Ui, screens: &Screens, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let [left, right] = split(area);
    scene_pane(ui, &screens.scene, left, buffer, regions);
    let practised = ui.subject.run().is_some_and(|run| run.practised.is_some());
    let rows = STATUS + u16::from(practised && area.height >= ROOMY);
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Length(rows)]).areas(right);
    let metrics: &[Metric] = if above.height >= 14 { &[Metric::Success, Metric::Return] } else { &[Metric::Success] };
    training::stack(&screens.curves, &screens.runs, ui, metrics, above, buffer, regions);
    status::draw(ui, below, buffer);
}

/// Width from which an object's whole name fits beside its numbers.
const NAMED: u16 = 36;

/// Rows reserved for the task pane when there are many objects.
const TASK: u16 = 5;

/// Draws the scene and the list of its objects.
pub fn draw_edit(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let [left, right] = split(area);
    scene_pane(ui, scene, left, buffer, regions);
    objects(ui, scene, right, buffer, regions);
}

/// A square for the scene at the left, the rest at the right.
pub(super) fn split(area: Rect) -> [Rect; 2] {
    let rest = if area.width >= WIDE { 40 } else { 28 };
    let width = (2 * (area.height - 2) + 2).min(area.width.saturating_sub(rest));
    Layout::horizontal([Constraint::Length(width), Constraint::Fill(1)]).areas(area)
}

pub(super) fn scene_pane(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let subject = ui.subject;
    let inside = pane(&scene::title(ui), area, ui.theme, buffer);
    // A past episode has its own task; edits apply to the session's.
    let (task, proposed) = match subject.choice() {
        Choice::Past(_) => (subject.task().clone(), Vec::new()),
        _ => while_dragging(ui, scene),
    };
    let mut frame = subject.episode().at(scene.player.step());
    if matches!(scene.dragged(), Some((Object::Ball, _))) {
        frame = PlaybackFrame { ball: task.ball.position, ..PlaybackFrame::default() };
    }
    let (predicted, truth) = scene.prediction(subject);
    let agent_view = scene.agent_view();
    let content = Content {
        objects: Objects { task: &task, proposed: &proposed },
        frame: &frame,
        overlays: scene.overlays(),
        prior: subject.clusters().map(|clusters| (&*clusters.prior, clusters.stale)),
        heat: agent_view.map(|view| &view.heat),
        choice: agent_view.and_then(|view| view.choice),
        predicted,
        truth: &truth,
        selected: scene.selected(),
        ghost: scene.hand.as_ref().and_then(|hand| hand.ghost.as_ref()),
    };
    let view = draw_scene(&content, inside, ui.theme, buffer);
    regions.add(view.area, HitRegion::Scene(view));
    let missing = scene.missing(subject).join("\n");
    Text::from_iter(lines(&missing, inside.width, Style::new().fg(ui.theme.warn))).render(inside, buffer);
    caption(ui, scene, &frame, area, buffer);
}

/// Draws the same episode of another run, at the same step.
pub(super) fn beside_pane(ui: &Ui, scene: &Scene, beside: &Beside, area: Rect, buffer: &mut Buffer) {
    let episode = match &beside.episode {
        Ok(episode) => episode,
        Err(reason) => {
            let name = beside.run.file_name().unwrap_or_default().to_string_lossy();
            let inside = pane(&name, area, ui.theme, buffer);
            return hint(reason, inside, ui.theme, buffer);
        }
    };
    let inside = pane(&format!("{} · {}", episode.task.name, episode.title), area, ui.theme, buffer);
    let frame = episode.at(scene.player.step());
    let content = Content {
        objects: Objects { task: &episode.task, proposed: &[] },
        frame: &frame,
        overlays: Overlays { legend: false, ..scene.overlays() },
        prior: None,
        heat: None,
        choice: None,
        predicted: &[],
        truth: &[],
        selected: None,
        ghost: None,
    };
    draw_scene(&content, inside, ui.theme, buffer);
    let text = format!(" action {} · reward {:.2} ", frame.action, frame.reward);
    let room = usize::from(area.width.saturating_sub(4));
    buffer.set_stringn(area.x + 2, area.bottom() - 1, text, room, ui.theme.faint());
}

/// The task and the proposed subgoals, with the dragged object at the mouse.
fn while_dragging(ui: &Ui, scene: &Scene) -> (Arc<Task>, Vec<Region>) {
    let view = ui.view;
    let mut proposed = view.proposed.clone();
    let Some((object, to)) = scene.dragged() else { return (view.task.clone(), proposed) };
    let mut moved = Task::clone(&view.task);
    match object {
        Object::Ball => moved.ball.position = to,
        Object::Goal => moved.goal.position = to,
        Object::Subgoal(index) => moved.subgoals.get_mut(index).into_iter().for_each(|s| s.position = to),
        Object::Proposal(index) => proposed.get_mut(index).into_iter().for_each(|p| p.position = to),
        Object::Tool(index) => moved.tools.get_mut(index).into_iter().for_each(|t| t.position = to),
        Object::Part(part) => moved.position_mut(part).into_iter().for_each(|position| *position = to),
    }
    (Arc::new(moved), proposed)
}

/// Draws action, speed and reward in the lower border of the pane; during hand play, the held tool.
fn caption(ui: &Ui, scene: &Scene, frame: &PlaybackFrame, area: Rect, buffer: &mut Buffer) {
    let player = &scene.player;
    let state = if player.is_moving() { format!("x{}", player.speed) } else { "stopped".to_owned() };
    let room = usize::from(area.width.saturating_sub(4));
    let mut parts = vec![format!("action {}", frame.action), state, format!("reward {:.2}", frame.reward)];
    parts.extend(ui.subject.facts());
    if !player.is_moving() {
        parts.push(format!("x{}", player.speed));
    }
    let mut text = format!(" {} ", fitting(&parts, room.saturating_sub(2)));
    let mut style = ui.theme.faint();
    if let Some((_, [x, y])) = scene.dragged() {
        text = format!(" {x:.2} {y:.2} ");
    } else if let Some(hand) = &scene.hand {
        let refusal = hand.ghost.as_ref().and_then(|ghost| ghost.refusal.as_deref());
        if refusal.is_some() {
            style = Style::new().fg(ui.theme.bad);
        }
        let [x, y] = hand.cursor;
        text = format!(" {x:.2} {y:.2} {} ", refusal.unwrap_or(if hand.ghost.is_some() { "free" } else { "" }));
        if let Some(tool) = hand.tool.and_then(catalogue_tool) {
            text += &format!("· {} ", tool_in_words(tool, true));
        }
        if let Some(end) = ui.view.hand.end() {
            text = format!(" the episode is over: {end} ");
        }
    }
    buffer.set_stringn(area.x + 2, area.bottom() - 1, shortened(&text, room, false), room, style);
}

fn objects(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let all = view.objects().all();
    let properties = tools::rows(scene, &view.task);
    let height = (all.len() as u16 + 2).min(area.height.saturating_sub(properties + TASK));
    let heights = [Constraint::Length(height), Constraint::Length(properties), Constraint::Fill(1)];
    let [upper, middle, lower] = Layout::vertical(heights).areas(area);
    tools::draw(ui, scene, middle, buffer, regions);
    let inside = pane("objects · x, y, size", upper, theme, buffer);
    let roomy = inside.width >= NAMED;
    let row = |index: usize| {
        let object: Object = all[index];
        let [px, py] = view.objects().position(object).unwrap_or_default();
        let size = view.objects().size(object).unwrap_or_default();
        let name = view.objects().name(object);
        // In a narrow pane the tool's type is left out.
        let name = if roomy { name.as_str() } else { name.split(" (").next().unwrap_or_default() };
        let number = |text: String| Text::from(text).right_aligned();
        let [px, py, size] = [format!("{px:.2}"), format!("{py:.2}"), format!("{size:.1}")].map(number);
        Row::new([Text::from(name.to_owned()), px, py, size])
    };
    let widths = if roomy { [16, 6, 6, 5] } else { [10, 5, 5, 4] }.map(Constraint::Length);
    let selected = scene.selected().and_then(|object| all.iter().position(|known| *known == object));
    regions.add_rows(list::draw(all.len(), selected, row, &widths, inside, theme, buffer));
    if lower.height >= 3 {
        let inside = pane("task", lower, theme, buffer);
        Text::from(fitted(about(ui, inside.width), inside)).render(inside, buffer);
    }
}

/// The lines that fit into an area; `..` at the end marks an omission.
fn fitted(mut text: Vec<Line<'static>>, area: Rect) -> Vec<Line<'static>> {
    let height = usize::from(area.height);
    if text.len() > height {
        text.truncate(height);
        if let Some(last) = text.last_mut() {
            let cut = format!("{last} ..");
            *last = Line::styled(shortened(cut.trim_start(), usize::from(area.width), false), last.style);
        }
    }
    text
}

/// Lines about the task and its edits.
fn about(ui: &Ui, width: u16) -> Vec<Line<'static>> {
    let view = ui.view;
    let theme = ui.theme;
    let mut text: Vec<Line> = Vec::new();
    let mut put = |paragraph: &str, style: Style| text.extend(lines(paragraph, width, style));
    // The present state comes first: a small terminal shows nothing else.
    if view.dirty {
        put(&ui.text("edited, not saved: {save} saves"), Style::new().fg(theme.warn));
    }
    if let Some(proposals) = proposals(ui) {
        put(&proposals, Style::new().fg(theme.warn));
    }
    let (clusters, colour) = status::clusters(ui);
    put(&format!("clusters {clusters}"), colour.map_or(Style::new(), |colour| Style::new().fg(colour)));
    put(&format!("\n{}", view.task.description), Style::new());
    let placeable = view.task.placeable;
    let file = view.file.as_ref().map_or_else(|| "shipped with the program".to_owned(), |f| f.display().to_string());
    let tool = tool_in_words(&placeable.tool([0.0; 2]), true);
    put(&ui.text(&format!("the agent places: {tool}; {{agent-tool}} chooses another")), theme.faint());
    put(&format!("{file}\n\n"), theme.faint());
    let help = "{next-object} selects, arrows or the mouse move, {coordinates} types coordinates. {add-subgoal} adds a subgoal, {add-tool} a tool, {delete} deletes; {propose-subgoals} lets the model propose subgoals. {shrink} and {grow} resize, {earlier} and {later} reorder; of a tool, {earlier} and {later} choose a property, {shrink} and {grow} or the wheel over it change it, {properties} types it; the wheel over the scene turns the tool. {undo} undoes, {redo} does it again.";
    put(&ui.text(help), theme.faint());
    text
}

/// The proposed subgoals or the search for them, with the keys to answer.
fn proposals(ui: &Ui) -> Option<String> {
    let view = ui.view;
    if let Some((tried, count)) = view.proposing {
        // The number is unknown before the first report.
        let number =
            if count > 0 { format!(", proposal {} of {count}", (tried + 1).min(count)) } else { String::new() };
        return Some(format!("looking for subgoals{number}"));
    }
    let count = view.proposed.len();
    let answers = ui.text("{accept-proposals} accepts, {reject-proposals} rejects the selected one or all");
    (count > 0).then(|| format!("proposed: {count}; {answers}"))
}
