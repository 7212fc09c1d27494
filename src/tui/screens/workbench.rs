//! The Scene screen, where everything is together, and the Edit screen.

use std::sync::Arc;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::pane::{WIDE, pane};
use super::scene::{self, Scene};
use super::{HitRegions, Screens, Ui, status, training};
use crate::run::Metric;
use crate::task::{Region, Task};
use crate::tui::actions::{Action, Context};
use crate::tui::scene::{Content, Object, Objects, draw as draw_scene};
use crate::tui::view::Choice;
use crate::tui::view::playback::Moment;
use crate::tui::widgets::columns::fitting;
use crate::tui::widgets::popup::wrap;

/// Rows of the status pane.
const STATUS: u16 = 12;

/// Draws scene, curves and status side by side.
pub fn draw(ui: &Ui, screens: &Screens, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let (left, right) = split(area);
    scene_pane(ui, &screens.scene, left, buffer, regions);
    let rows = STATUS.min(right.height);
    let above = Rect { height: right.height - rows, ..right };
    let below = Rect { y: above.bottom(), height: rows, ..right };
    let metrics: &[Metric] = if above.height >= 14 { &[Metric::Success, Metric::Return] } else { &[Metric::Success] };
    training::stack(&screens.curves, &screens.runs, ui, metrics, above, buffer, regions);
    status::draw(ui, below, buffer);
}

/// Columns from which on an object's whole name has room beside its numbers.
const NAMED: usize = 36;

/// Draws the scene and the list of its objects.
pub fn draw_edit(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let (left, right) = split(area);
    scene_pane(ui, scene, left, buffer, regions);
    objects(ui, scene, right, buffer, regions);
}

/// A square for the scene at the left, the rest at the right.
fn split(area: Rect) -> (Rect, Rect) {
    let rest = if area.width >= WIDE { 40 } else { 28 };
    let width = (2 * (area.height - 2) + 2).min(area.width.saturating_sub(rest));
    (Rect { width, ..area }, Rect { x: area.x + width, width: area.width - width, ..area })
}

fn scene_pane(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let subject = ui.subject;
    let inside = pane(&scene::title(ui), area, ui.theme, buffer);
    // The past has its own task; what is edited is the session's.
    let (task, proposed) = match subject.choice() {
        Choice::Past(_) => (subject.task().clone(), Vec::new()),
        _ => while_dragging(ui, scene),
    };
    let mut moment = subject.episode().at(scene.player.step());
    if matches!(scene.dragged(), Some((Object::Ball, _))) {
        moment = Moment { ball: task.ball.position, ..Moment::default() };
    }
    let (predicted, truth) = scene.prediction(subject);
    let agent_view = scene.agent_view();
    let content = Content {
        objects: Objects { task: &task, proposed: &proposed },
        moment: &moment,
        overlays: scene.overlays,
        prior: subject.clusters().map(|clusters| (&*clusters.prior, clusters.stale)),
        heat: agent_view.map(|view| &view.heat),
        choice: agent_view.map(|view| view.choice),
        predicted,
        truth: &truth,
        selected: scene.selected(),
        ghost: scene.hand.as_ref().and_then(|hand| hand.ghost.as_ref()),
    };
    regions.set_scene(draw_scene(&content, inside, ui.theme, buffer));
    let missing = scene.missing(subject).into_iter().flat_map(|text| wrap(&text, usize::from(inside.width)));
    for (y, line) in (inside.y..inside.bottom()).zip(missing) {
        buffer.set_stringn(inside.x, y, line, usize::from(inside.width), Style::new().fg(ui.theme.warn));
    }
    caption(ui, scene, &moment, area, buffer);
}

/// The task and what is proposed for it, with the dragged object where the mouse is.
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
    }
    (Arc::new(moved), proposed)
}

/// Action, reward and speed in the lower edge of the pane.
fn caption(ui: &Ui, scene: &Scene, moment: &Moment, area: Rect, buffer: &mut Buffer) {
    let player = &scene.player;
    let state = if player.playing { format!("x{}", player.speed) } else { "stopped".to_owned() };
    let room = usize::from(area.width.saturating_sub(4));
    let parts = [format!("action {}", moment.action), state, format!("reward {:.2}", moment.reward)];
    let mut text = format!(" {} ", fitting(&parts, room.saturating_sub(2)));
    if let Some((_, [x, y])) = scene.dragged() {
        text = format!(" {x:.2} {y:.2} ");
    } else if let Some(hand) = &scene.hand {
        let placement = hand
            .ghost
            .as_ref()
            .map_or(String::new(), |ghost| format!("{:?}", ghost.placement).to_lowercase().replace("placed", "free"));
        text = format!(" {:.2} {:.2} {placement} ", hand.cursor[0], hand.cursor[1]);
        if let Some(end) = ui.view.hand.end() {
            text = format!(" the episode is over: {end} ");
        }
    }
    buffer.set_stringn(area.x + 2, area.bottom() - 1, text, room, ui.theme.faint());
}

fn objects(ui: &Ui, scene: &Scene, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let all = view.objects().all();
    let upper = Rect { height: (all.len() as u16 + 2).min(area.height), ..area };
    let inside = pane("objects · x, y, size", upper, theme, buffer);
    regions.set_rows(inside, 0);
    for (y, object) in (inside.y..inside.bottom()).zip(all) {
        let [px, py] = view.objects().position(object).unwrap_or_default();
        let size = view.objects().size(object).unwrap_or_default();
        let width = usize::from(inside.width);
        let name = view.objects().name(object);
        let text = if width >= NAMED {
            format!("{name:<16} {px:>6.2} {py:>6.2} {size:>5.1}")
        } else {
            // Not even the tool's type has room.
            let name = name.split(" (").next().unwrap_or_default();
            format!("{name:<10} {px:>5.2} {py:>5.2}{size:>4}")
        };
        let style = if scene.selected() == Some(object) { theme.selected() } else { Style::new() };
        buffer.set_stringn(inside.x, y, format!("{text:width$}"), width, style);
    }
    let lower = Rect { y: upper.bottom(), height: area.bottom() - upper.bottom(), ..area };
    if lower.height >= 3 {
        let inside = pane("task", lower, theme, buffer);
        for (y, (text, style)) in (inside.y..inside.bottom()).zip(about(ui, usize::from(inside.width))) {
            buffer.set_stringn(inside.x, y, text, usize::from(inside.width), style);
        }
    }
}

/// What there is to know about the task and its edits, in lines.
fn about(ui: &Ui, width: usize) -> Vec<(String, Style)> {
    let view = ui.view;
    let theme = ui.theme;
    let key = |action, context| ui.key(action, context);
    let mut lines: Vec<(String, Style)> = Vec::new();
    let mut put = |text: &str, style: Style| lines.extend(wrap(text, width).into_iter().map(|line| (line, style)));
    // What is going on comes first: a small terminal shows no more.
    if view.dirty {
        let text = format!("edited, not saved: {} saves", key(Action::Save, Context::Everywhere));
        put(&text, Style::new().fg(theme.warn));
    }
    if let Some(text) = proposals(ui) {
        put(&text, Style::new().fg(theme.warn));
    }
    let (text, colour) = status::clusters(ui);
    put(&format!("clusters {text}"), colour.map_or(Style::new(), |colour| Style::new().fg(colour)));
    put(&format!("\n{}", view.task.description), Style::new());
    let placeable = view.task.placeable;
    let size = placeable.tool([0.0; 2]).size;
    let file = view.file.as_ref().map_or_else(|| "shipped with the program".to_owned(), |f| f.display().to_string());
    put(&format!("the agent places: {} of {size} units\n{file}\n\n", placeable.kind), theme.faint());
    let help = format!(
        "{} selects, arrows or the mouse move, {} types coordinates. {} adds a subgoal, {} a tool, {} deletes; {} lets the model propose subgoals. {} and {} resize, {} and {} reorder. {} undoes, {} does it again.",
        key(Action::NextObject, Context::Scene),
        key(Action::Coordinates, Context::Scene),
        key(Action::AddSubgoal, Context::Scene),
        key(Action::AddTool, Context::Scene),
        key(Action::DeleteObject, Context::Scene),
        key(Action::Propose, Context::Scene),
        key(Action::Shrink, Context::Scene),
        key(Action::Grow, Context::Scene),
        key(Action::Earlier, Context::Scene),
        key(Action::Later, Context::Scene),
        key(Action::Undo, Context::Everywhere),
        key(Action::Redo, Context::Everywhere),
    );
    put(&help, theme.faint());
    lines
}

/// What is proposed, or looked for, and what to press.
fn proposals(ui: &Ui) -> Option<String> {
    let view = ui.view;
    if let Some((found, count)) = view.proposing {
        return Some(format!("looking for subgoal {} of {count}", (found + 1).min(count)));
    }
    let key = |action| ui.key(action, Context::Scene);
    let (accept, reject) = (key(Action::AcceptProposals), key(Action::RejectProposals));
    let count = view.proposed.len();
    (count > 0).then(|| format!("proposed: {count}; {accept} accepts, {reject} rejects the selected one or all"))
}
