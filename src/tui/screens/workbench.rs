//! The Scene screen, where everything is together, and the Edit screen.

use std::sync::Arc;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::frame::{WIDE, fitting, pane};
use super::{Hits, status, training};
use crate::task::{Region, Task};
use crate::tui::app::App;
use crate::tui::metric::Metric;
use crate::tui::playback::Moment;
use crate::tui::scene::{Content, Object, Objects, draw as draw_scene};
use crate::workbench::PriorState;

/// Rows of the status pane.
const STATUS: u16 = 12;

/// Draws scene, curves and status side by side.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let (left, right) = split(area);
    scene_pane(app, left, buffer, hits);
    let rows = STATUS.min(right.height);
    let above = Rect { height: right.height - rows, ..right };
    let below = Rect { y: above.bottom(), height: rows, ..right };
    let metrics: &[Metric] = if above.height >= 14 { &[Metric::Success, Metric::Return] } else { &[Metric::Success] };
    training::stack(app, metrics, above, buffer, hits);
    status::draw(app, below, buffer);
}

/// Columns from which on an object's whole name has room beside its numbers.
const NAMED: usize = 36;

/// Draws the scene and the list of its objects.
pub fn draw_edit(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let (left, right) = split(area);
    scene_pane(app, left, buffer, hits);
    objects(app, right, buffer, hits);
}

/// A square for the scene at the left, the rest at the right.
fn split(area: Rect) -> (Rect, Rect) {
    let rest = if area.width >= WIDE { 40 } else { 28 };
    let width = (2 * (area.height - 2) + 2).min(area.width.saturating_sub(rest));
    (Rect { width, ..area }, Rect { x: area.x + width, width: area.width - width, ..area })
}

fn scene_pane(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let scene = &app.scene;
    let inside = pane(&title(app), area, &app.theme, buffer);
    let (task, proposed) = scene.replayed().map_or_else(|| while_dragging(app), |e| (e.task.clone(), Vec::new()));
    let ball = task.ball.position;
    let moment =
        scene.episode().map_or_else(|| Moment { ball, ..Moment::default() }, |episode| episode.at(scene.player.step()));
    let truth = scene.truth();
    let stale = !matches!(facts.prior_state, PriorState::Fresh) && !prior_is_of_run(app);
    let content = Content {
        objects: Objects { task: &task, proposed: &proposed },
        moment: &moment,
        overlays: scene.overlays,
        prior: facts.prior.as_deref().map(|prior| (prior, stale)),
        heat: scene.mind().map(|mind| &mind.heat),
        choice: scene.mind().map(|mind| mind.choice),
        predicted: scene.predicted(),
        truth: &truth,
        selected: scene.drag.map(|(object, _)| object).or(scene.selected),
        ghost: scene.hand.as_ref().and_then(|hand| hand.ghost.as_ref()),
    };
    hits.scene = Some(draw_scene(&content, inside, &app.theme, buffer));
    caption(app, &moment, area, buffer);
}

/// Whether the clusters shown are those of the run that is watched, on this very task.
fn prior_is_of_run(app: &App) -> bool {
    let facts = app.desk.facts();
    facts.prior_state == PriorState::Absent && facts.live.as_ref().is_some_and(|live| *live.task == *facts.task)
}

/// The task and what is proposed for it, with the dragged object where the mouse is.
fn while_dragging(app: &App) -> (Arc<Task>, Vec<Region>) {
    let facts = app.desk.facts();
    let mut proposed = facts.proposed.clone();
    let Some((object, to)) = app.scene.drag else { return (facts.task.clone(), proposed) };
    let mut moved = Task::clone(&facts.task);
    match object {
        Object::Ball => moved.ball.position = to,
        Object::Goal => moved.goal.position = to,
        Object::Subgoal(index) => moved.subgoals.get_mut(index).into_iter().for_each(|s| s.position = to),
        Object::Proposal(index) => proposed.get_mut(index).into_iter().for_each(|p| p.position = to),
        Object::Tool(index) => moved.tools.get_mut(index).into_iter().for_each(|t| t.position = to),
    }
    (Arc::new(moved), proposed)
}

fn title(app: &App) -> String {
    let episode = app.scene.episode().map_or("", |episode| episode.title.as_str());
    format!("{} · {episode}", app.desk.facts().task.name)
}

/// Action, reward and speed in the lower edge of the pane.
fn caption(app: &App, moment: &Moment, area: Rect, buffer: &mut Buffer) {
    let player = &app.scene.player;
    let state = if player.playing { format!("x{}", player.speed) } else { "stopped".to_owned() };
    let room = usize::from(area.width.saturating_sub(4));
    let parts = [format!("action {}", moment.action), state, format!("reward {:.2}", moment.reward)];
    let mut text = format!(" {} ", fitting(&parts, room.saturating_sub(2)));
    if let Some((_, [x, y])) = app.scene.drag {
        text = format!(" {x:.2} {y:.2} ");
    } else if let Some(hand) = &app.scene.hand {
        let placement = hand
            .ghost
            .as_ref()
            .map_or(String::new(), |ghost| format!("{:?}", ghost.placement).to_lowercase().replace("placed", "free"));
        text = format!(" {:.2} {:.2} {placement} ", hand.cursor[0], hand.cursor[1]);
        if let Some(end) = app.desk.facts().played_end {
            text = format!(" the episode is over: {end} ");
        }
    }
    buffer.set_stringn(area.x + 2, area.bottom() - 1, text, room, app.theme.faint());
}

fn objects(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let all = facts.objects().all();
    let upper = Rect { height: (all.len() as u16 + 2).min(area.height), ..area };
    let inside = pane("objects · x, y, size", upper, theme, buffer);
    hits.rows = Some((inside, 0));
    for (y, object) in (inside.y..inside.bottom()).zip(all) {
        let [px, py] = facts.objects().position(object).unwrap_or_default();
        let size = facts.objects().size(object).unwrap_or_default();
        let width = usize::from(inside.width);
        let name = facts.objects().name(object);
        let text = if width >= NAMED {
            format!("{name:<16} {px:>6.2} {py:>6.2} {size:>5.1}")
        } else {
            // Not even the tool's type has room.
            let name = name.split(" (").next().unwrap_or_default();
            format!("{name:<10} {px:>5.2} {py:>5.2}{size:>4}")
        };
        let style = if app.scene.selected == Some(object) { theme.selected() } else { Style::new() };
        buffer.set_stringn(inside.x, y, format!("{text:width$}"), width, style);
    }
    let lower = Rect { y: upper.bottom(), height: area.bottom() - upper.bottom(), ..area };
    if lower.height >= 3 {
        let inside = pane("task", lower, theme, buffer);
        for (y, (text, style)) in (inside.y..inside.bottom()).zip(about(app, usize::from(inside.width))) {
            buffer.set_stringn(inside.x, y, text, usize::from(inside.width), style);
        }
    }
}

/// What there is to know about the task and its edits, in lines.
fn about(app: &App, width: usize) -> Vec<(String, Style)> {
    use crate::tui::actions::{Action, Context};
    let facts = app.desk.facts();
    let theme = &app.theme;
    let key = |action, context| app.keymap.key_for(action, context);
    let wrap = |text: &str| crate::tui::layers::wrap(text, width);
    let mut lines: Vec<(String, Style)> = Vec::new();
    let mut put = |text: &str, style: Style| lines.extend(wrap(text).into_iter().map(|line| (line, style)));
    // What is going on comes first: a small terminal shows no more.
    if facts.dirty {
        let text = format!("edited, not saved: {} saves", key(Action::Save, Context::Everywhere));
        put(&text, Style::new().fg(theme.warn));
    }
    if let Some(text) = proposals(app) {
        put(&text, Style::new().fg(theme.warn));
    }
    let (text, colour) = status::clusters(app);
    put(&format!("clusters {text}"), colour.map_or(Style::new(), |colour| Style::new().fg(colour)));
    put(&format!("\n{}", facts.task.description), Style::new());
    let placeable = facts.task.placeable;
    let size = placeable.tool([0.0; 2]).size;
    let file = facts.file.as_ref().map_or_else(|| "shipped with the program".to_owned(), |f| f.display().to_string());
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
fn proposals(app: &App) -> Option<String> {
    use crate::tui::actions::{Action, Context};
    let facts = app.desk.facts();
    if let Some((found, count)) = facts.proposing {
        return Some(format!("looking for subgoal {} of {count}", (found + 1).min(count)));
    }
    let key = |action| app.keymap.key_for(action, Context::Scene);
    let (accept, reject) = (key(Action::AcceptProposals), key(Action::RejectProposals));
    let count = facts.proposed.len();
    (count > 0).then(|| format!("proposed: {count}; {accept} accepts, {reject} rejects the selected one or all"))
}
