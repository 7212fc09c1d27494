//! The pane of a scene: its task, episode and overlays, and a caption in its lower border.

use std::sync::Arc;

use ratatui::prelude::*;

use super::pane::pane;
use super::scene::Scene;
use super::{HitRegion, HitRegions, Ui};
use crate::tui::scene::{Content, Objects, draw as draw_scene, legend};
use crate::tui::view::Choice;
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::widgets::columns::{fitting, shortened, width};
use mge_task::{Object, Part, Region, Task};

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
