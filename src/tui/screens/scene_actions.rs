//! Actions of the Scene and Edit screens, other than edits of the task.

use super::Ui;
use super::edit::on_selected;
use super::scene::{Scene, moved};
use crate::tui::effect::Effect;
use crate::tui::view::{Choice, Subject};
use mge_task::Edit;
use mge_workbench::command;

/// Moves the tool in hand, or else the selected object.
pub fn move_by(scene: &mut Scene, ui: &Ui, direction: [f32; 2], far: bool) -> Vec<Effect> {
    let Some(hand) = &mut scene.hand else {
        let by = direction.map(|axis| axis * if far { 0.1 } else { 0.01 });
        return on_selected(scene, ui, |object, from| Effect::apply(Edit::Move { object, position: moved(from, by) }));
    };
    hand.cursor = moved(hand.cursor, direction.map(|axis| axis * if far { 0.1 } else { 0.02 }));
    Vec::new()
}

/// Leaves a past episode, to show the task that is edited.
fn leave_past(subject: &Subject) -> Vec<Effect> {
    let is_past = matches!(subject.choice, Choice::Past(_));
    is_past.then(|| Effect::show(Choice::Latest)).into_iter().collect()
}

/// Selects the object that is `by` after the selected one.
pub fn select_neighbour(scene: &mut Scene, ui: &Ui, by: isize) -> Vec<Effect> {
    let objects = ui.view.objects().all();
    let now = scene.selected().and_then(|selected| objects.iter().position(|object| *object == selected));
    let before_first = if by > 0 { objects.len() - 1 } else { 0 };
    let next = (now.unwrap_or(before_first) + objects.len()).wrapping_add_signed(by) % objects.len();
    scene.select(Some(objects[next]));
    leave_past(ui.subject)
}

/// Replays the past episode of the watched run that `choose` returns for the one shown, if one is, and the last one.
pub fn replay(scene: &mut Scene, ui: &Ui, choose: fn(Option<u64>, u64) -> u64) -> Vec<Effect> {
    let Some(run) = ui.subject.run().filter(|run| run.done > 0) else {
        return vec![Effect::info("no run with episodes is being watched: the Runs screen has them")];
    };
    scene.select(None);
    let now = match &ui.subject.choice {
        Choice::Past(episode) => Some(episode.trace.episode),
        _ => None,
    };
    let episode = choose(now, run.done).clamp(1, run.done);
    vec![Effect::new(move |app| app.await_episode(episode, false))]
}

/// Shows or hides an overlay of the clusters; says why nothing is to be seen.
pub fn show_clusters(ui: &Ui, overlay: &mut bool) -> Vec<Effect> {
    *overlay = !*overlay;
    let (shown, edited) = (&ui.subject.task, &ui.view.task);
    let missing = || match shown.name == edited.name {
        true => Effect::info(ui.text("no action clusters yet: {clusters} computes them")),
        false => {
            let text = format!(
                "no action clusters of {} are known: {{clusters}} computes those of {}",
                shown.name, edited.name
            );
            Effect::info(ui.text(&text))
        }
    };
    ui.subject.clusters.is_none().then(missing).into_iter().collect()
}

/// Begins or ends hand play.
pub fn play_by_hand(scene: &mut Scene, ui: &Ui) -> Vec<Effect> {
    if scene.hand.is_some() {
        return vec![Effect::show(scene.put_tool_down())];
    }
    let text = ui.text("hand play: move the tool, {hand-place} or a click places it, esc ends");
    vec![Effect::show(scene.take_tool(ui.view)), Effect::info(text)]
}

/// Places the tool in hand.
pub fn place(scene: &Scene) -> Vec<Effect> {
    scene.hand.iter().map(|hand| Effect::apply(command::Place(hand.cursor))).collect()
}

/// Handles a mouse press in the scene: places the held tool, or selects an object.
pub fn press(scene: &mut Scene, ui: &Ui, position: [f32; 2], reach: f32) -> Vec<Effect> {
    if let Some(hand) = &mut scene.hand {
        hand.hold(position);
        return place(scene);
    }
    let objects = ui.view.objects();
    let object = objects.at(position, reach);
    scene.select(object);
    let mut effects = leave_past(ui.subject);
    // What is selected has its own line.
    if object.is_none() {
        effects.push(Effect::info(format!("x {:.2}, y {:.2}", position[0], position[1])));
    }
    effects
}
