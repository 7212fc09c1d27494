//! Actions of the Scene and Edit screens.

use super::edit::edit;
use super::scene::{Scene, moved};
use super::{Ui, tools};
use crate::tui::actions::UiAction;
use crate::tui::effect::Effect;
use crate::tui::view::{Choice, Subject, ViewModel};
use mge_workbench::command;

/// What an action does on the Scene and the Edit screen.
pub fn perform(scene: &mut Scene, ui: &Ui, action: UiAction) -> Vec<Effect> {
    if let Some(effects) = play_by_hand(scene, action, ui) {
        return effects;
    }
    if let Some(effects) = watch(scene, ui, action).or_else(|| edit(scene, ui, action)) {
        return effects;
    }
    match action {
        UiAction::HandPlay => {
            let text = ui.text("hand play: move the tool, {hand-place} or a click places it, esc ends");
            vec![scene.take_tool(ui.view), Effect::info(text)]
        }
        UiAction::NextObject | UiAction::PreviousObject => {
            select_neighbour(scene, ui.view, action == UiAction::NextObject);
            leave_past(ui.subject)
        }
        _ => Vec::new(),
    }
}

/// Leaves a past episode, to show the task that is edited.
fn leave_past(subject: &Subject) -> Vec<Effect> {
    let is_past = matches!(subject.choice(), Choice::Past(_));
    is_past.then_some(Effect::Show(Choice::Latest)).into_iter().collect()
}

/// Handles playback and overlays; None for any other action.
fn watch(scene: &mut Scene, ui: &Ui, action: UiAction) -> Option<Vec<Effect>> {
    let steps = ui.subject.episode().steps();
    match action {
        UiAction::PlayPause => scene.player.toggle(),
        UiAction::StepForward => scene.player.nudge(1, steps),
        UiAction::StepBack => scene.player.nudge(-1, steps),
        UiAction::Faster => scene.player.change_speed(true),
        UiAction::Slower => scene.player.change_speed(false),
        UiAction::Restart => scene.player.restart(),
        UiAction::PreviousEpisode | UiAction::NextEpisode | UiAction::First | UiAction::Last => {
            return Some(vec![replay(scene, ui, action)]);
        }
        UiAction::Source => {
            let effect = match ui.subject.choice() {
                // The scene is untouched already, and the next training's episodes are to appear in it.
                Choice::Latest if !ui.subject.is_of_run() => Effect::info(no_episode(ui)),
                Choice::Latest => Effect::Show(Choice::Untouched),
                _ => Effect::Show(Choice::Latest),
            };
            return Some(vec![effect]);
        }
        UiAction::ShowClusters => scene.chosen.clusters = !scene.chosen.clusters,
        UiAction::ShowSamples => scene.chosen.samples = !scene.chosen.samples,
        UiAction::ShowCritic => scene.chosen.critic = !scene.chosen.critic,
        UiAction::ShowActor => scene.chosen.actor = !scene.chosen.actor,
        UiAction::ShowModel => scene.chosen.model = !scene.chosen.model,
        UiAction::ShowLegend => scene.chosen.legend = !scene.chosen.legend,
        UiAction::ShowStage => {
            let next = scene.chosen.stage.map_or(0, |stage| stage + 1);
            scene.chosen.stage = Some(next).filter(|stage| *stage < ui.subject.task().stage_count());
        }
        _ => return None,
    }
    Some(explain(scene, ui, action).into_iter().collect())
}

/// Whether an action controls playback; these also work where the scene is beside the curves.
pub fn is_playback(action: UiAction) -> bool {
    use UiAction::{NextEpisode, PlayPause, PreviousEpisode, StepBack, StepForward};
    matches!(action, PlayPause | StepForward | StepBack | PreviousEpisode | NextEpisode)
}

/// Replays another past episode of the watched run.
fn replay(scene: &mut Scene, ui: &Ui, action: UiAction) -> Effect {
    let Some(run) = ui.subject.run().filter(|run| run.done > 0) else {
        return Effect::info("no run with episodes is being watched: the Runs screen has them");
    };
    scene.select(None);
    let last = run.done;
    let now = match ui.subject.choice() {
        Choice::Past(episode) => Some(episode.trace.episode),
        _ => None,
    };
    let episode = match action {
        UiAction::First => 1,
        UiAction::Last => last,
        UiAction::PreviousEpisode => now.map_or(last, |now| now.saturating_sub(1)),
        _ => now.map_or(1, |now| now + 1),
    };
    Effect::Replay(episode.clamp(1, last))
}

/// Why no training episode is shown.
fn no_episode(ui: &Ui) -> String {
    match ui.subject.note() {
        Some(note) => note.to_owned(),
        None => ui.text("there is no training episode yet: {train} trains one"),
    }
}

/// Says what an action changed that the scene does not show.
fn explain(scene: &Scene, ui: &Ui, action: UiAction) -> Option<Effect> {
    let subject = ui.subject;
    let text = match action {
        UiAction::ShowClusters | UiAction::ShowSamples if subject.clusters().is_none() => {
            ui.text("no action clusters yet: {clusters} computes them")
        }
        UiAction::ShowCritic | UiAction::ShowActor | UiAction::ShowModel if !subject.is_of_run() => no_episode(ui),
        UiAction::Faster | UiAction::Slower if !scene.player.is_moving() => format!("speed x{}", scene.player.speed),
        UiAction::ShowStage => match scene.chosen.stage {
            None => "clusters of all stages".to_owned(),
            Some(stage) if stage == subject.task().subgoals.len() => "clusters of the goal".to_owned(),
            Some(stage) => format!("clusters of subgoal {}", stage + 1),
        },
        _ => return None,
    };
    Some(Effect::info(text))
}

fn select_neighbour(scene: &mut Scene, view: &ViewModel, next: bool) {
    let objects = view.objects().all();
    let now = scene.selected().and_then(|selected| objects.iter().position(|object| *object == selected));
    let index = match (now, next) {
        (None, true) => 0,
        (None, false) => objects.len() - 1,
        (Some(now), true) => (now + 1) % objects.len(),
        (Some(now), false) => (now + objects.len() - 1) % objects.len(),
    };
    scene.select(Some(objects[index]));
}

/// Handles actions of hand play; None outside hand play and for any other action.
fn play_by_hand(scene: &mut Scene, action: UiAction, ui: &Ui) -> Option<Vec<Effect>> {
    let hand = scene.hand.as_mut()?;
    if let Some(by) = action.direction(0.02, 0.1) {
        hand.cursor = moved(hand.cursor, by);
        return Some(Vec::new());
    }
    Some(match action {
        UiAction::Confirm => vec![Effect::apply(command::Place(hand.cursor, hand.tool))],
        UiAction::HandTool => vec![tools::choose_in_hand(ui.subject.task())],
        UiAction::Restart => vec![Effect::apply(command::Reset)],
        UiAction::HandPlay => scene.back(ui.subject),
        _ => return None,
    })
}

/// Handles a mouse press in the scene: places the held tool, or selects an object.
pub fn press(scene: &mut Scene, ui: &Ui, position: [f32; 2], reach: f32) -> Vec<Effect> {
    if let Some(hand) = &mut scene.hand {
        hand.hold(position);
        return vec![Effect::apply(command::Place(hand.cursor, hand.tool))];
    }
    let objects = ui.view.objects();
    let object = objects.at(position, reach);
    scene.select(object);
    let text = match object {
        Some(object) => format!("{}: drag it, or move it with the arrow keys", objects.name(object)),
        None => format!("{:.2} {:.2}", position[0], position[1]),
    };
    let mut effects = leave_past(ui.subject);
    effects.push(Effect::info(text));
    effects
}
