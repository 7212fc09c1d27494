//! State of the Scene and Edit screens, and their actions, other than edits of the task.

use std::sync::Arc;
use std::time::Duration;

use super::Ui;
use super::edit::on_selected;
use crate::tui::effect::Effect;
use crate::tui::scene::{Ghost, Overlays};
use crate::tui::view::playback::Player;
use crate::tui::view::{AgentView, Choice, Subject, ViewModel};
use mge_agent::Ddpg;
use mge_env::Action;
use mge_guidance::RolloutModel;
use mge_task::{Edit, Object};
use mge_trainer::Trace;
use mge_workbench::command;

/// Greatest distance, in units, at which the mouse hits an object.
pub const REACH: f32 = 2.0;

/// State of the scene.
#[derive(Default)]
pub struct Scene {
    /// Playback of the episode being shown.
    pub player: Player,
    /// The held tool, during hand play.
    pub hand: Option<Hand>,
    /// The chosen overlays.
    pub chosen: Overlays,
    /// Whether agent and prediction are shown regardless of `chosen`, as beside the curves.
    pub all: bool,
    selected: Option<Object>,
    /// Where the selected object is being dragged to.
    dragged_to: Option<[f32; 2]>,
    agent_view: Option<Derived<AgentView, Ddpg>>,
    prediction: Option<Derived<Vec<[f32; 2]>, dyn RolloutModel>>,
}

/// A tool held for hand play.
pub struct Hand {
    /// Where it is held, normalised.
    pub(super) cursor: Action,
    /// Whether it can be placed there, and the predicted path of the ball.
    pub(super) ghost: Option<Ghost>,
}

impl Hand {
    /// Holds it at a position.
    pub fn hold(&mut self, position: [f32; 2]) {
        self.cursor = moved(position, [0.0; 2]);
    }
}

/// A position moved, clamped to the scene and rounded to three decimals.
pub(super) fn moved(position: [f32; 2], by: [f32; 2]) -> [f32; 2] {
    std::array::from_fn(|axis| ((position[axis] + by[axis]).clamp(-1.0, 1.0) * 1000.0).round() / 1000.0)
}

/// A value that `P`, the networks or a model, gives for an action of an episode, cached until its key changes.
type Derived<T, P> = (DerivedKey<P>, Result<T, String>);

/// The episode, the index of an action in it, and the networks or the model.
type DerivedKey<P> = (Arc<Trace>, usize, Option<Arc<P>>);

/// Whether two keys are of the same values.
fn is_same<P: ?Sized>(a: &DerivedKey<P>, b: &DerivedKey<P>) -> bool {
    let part = |key: &DerivedKey<P>| key.2.as_ref().map(|part| Arc::as_ptr(part).cast::<()>());
    Arc::ptr_eq(&a.0, &b.0) && a.1 == b.1 && part(a) == part(b)
}

/// The key for an action of the episode; None unless an agent acts in it.
fn key<P: ?Sized>(subject: &Subject, action: usize, part: Option<&Arc<P>>) -> Option<DerivedKey<P>> {
    subject.is_of_run().then(|| (subject.episode.trace.clone(), action, part.cloned()))
}

/// Derives a value again if its key has changed, or drops it without a key; true if it changed. Without networks or a
/// model the value is the reason why there is none, which can change with the same key.
fn renew<T, P: ?Sized>(
    cached: &mut Option<Derived<T, P>>,
    key: Option<DerivedKey<P>>,
    derive: impl FnOnce(usize) -> Result<T, String>,
) -> bool {
    let Some(key) = key else { return cached.take().is_some() };
    let known = cached.as_ref().filter(|(known, _)| is_same(known, &key));
    if known.is_some() && key.2.is_some() {
        return false;
    }
    let value = derive(key.1);
    let is_new = known.is_none_or(|(_, before)| before.as_ref().err() != value.as_ref().err());
    *cached = Some((key, value));
    is_new
}

/// Why there is no value.
fn problem<T, P: ?Sized>(cached: &Option<Derived<T, P>>) -> Option<&String> {
    cached.as_ref()?.1.as_ref().err()
}

impl Scene {
    /// The overlays shown over the scene.
    pub(super) fn overlays(&self) -> Overlays {
        let all = self.all;
        let Overlays { critic, actor, model, .. } = self.chosen;
        Overlays { critic: critic || all, actor: actor || all, model: model || all, ..self.chosen }
    }

    /// The selected object.
    pub fn selected(&self) -> Option<Object> {
        self.selected
    }

    /// Selects an object, or none.
    pub fn select(&mut self, object: Option<Object>) {
        self.selected = object;
        self.dragged_to = None;
    }

    /// Drags the selected object to a position.
    pub fn drag_selected(&mut self, to: [f32; 2]) {
        self.dragged_to = Some(to).filter(|_| self.selected.is_some());
    }

    /// The dragged object, and where it is.
    pub(super) fn dragged(&self) -> Option<(Object, [f32; 2])> {
        self.selected.zip(self.dragged_to)
    }

    /// Ends a drag; returns the edit that moves the object to where it was dropped.
    pub fn drop_dragged(&mut self) -> Option<Edit> {
        let dropped = self.selected.zip(self.dragged_to.take());
        dropped.map(|(object, to)| Edit::Move { object, position: moved(to, [0.0; 2]) })
    }

    /// Critic and actor at the present action, if they are shown.
    pub(super) fn agent_view(&self) -> Option<&AgentView> {
        self.agent_view.as_ref()?.1.as_ref().ok()
    }

    /// The path predicted from the present action on, and the true path.
    pub(super) fn prediction(&self, subject: &Subject) -> (&[[f32; 2]], Vec<[f32; 2]>) {
        match &self.prediction {
            Some(((_, action, _), Ok(path))) if !path.is_empty() => (path, subject.truth(*action)),
            _ => (&[], Vec::new()),
        }
    }

    /// What cannot be shown, and why.
    pub(super) fn missing(&self, subject: &Subject) -> Vec<String> {
        let overlays = self.overlays();
        let mut missing: Vec<String> = subject.note.clone().into_iter().collect();
        if subject.is_of_run() {
            missing.extend(problem(&self.agent_view).map(|reason| format!("no critic or actor: {reason}")));
            missing.extend(problem(&self.prediction).map(|reason| format!("no prediction: {reason}")));
        } else if (overlays.critic || overlays.actor || overlays.model) && self.hand.is_none() {
            missing.push("no agent acts here: critic, actor and prediction need an episode of a run".to_owned());
        }
        missing
    }

    /// Whether a prediction is shown.
    pub fn needs_model(&self, subject: &Subject) -> bool {
        self.hand.is_some() || (self.overlays().model && subject.is_of_run())
    }

    /// Predicts the path of the ball with the held tool anew.
    pub fn renew_ghost(&mut self) {
        if let Some(hand) = &mut self.hand {
            hand.ghost = None;
        }
    }

    /// Starts to play another episode, or the same one again.
    pub fn begin(&mut self, subject: &Subject, is_other: bool) {
        if matches!(subject.choice, Choice::Hand) {
            // Play only the latest action; those before it have been seen.
            let steps = &subject.episode.trace.steps;
            let before = steps.iter().take(steps.len().saturating_sub(1)).map(|step| step.path.len()).sum();
            self.player.play_from(before);
        } else {
            self.hand = None;
            if is_other { self.player.restart() } else { self.player.repeat() }
        }
        self.renew_ghost();
    }

    /// Advances playback; returns whether the picture changed, and effects.
    pub fn update(&mut self, subject: &Subject, elapsed: Duration) -> (bool, Vec<Effect>) {
        let steps = subject.episode.steps();
        let step = self.player.step();
        let over = self.player.advance(elapsed, steps);
        let mut effects = Vec::new();
        if over && self.hand.is_some() {
            self.player.playing = false;
        } else if over {
            effects.push(Effect::call(|app| app.choose_subject(None, true)));
        }
        let mut changed = step.min(steps) != self.player.step().min(steps);
        let action = subject.episode.at(self.player.step()).action.saturating_sub(1);
        let overlays = self.overlays();
        let networks = key(subject, action, subject.networks.as_ref()).filter(|_| overlays.critic || overlays.actor);
        changed |= renew(&mut self.agent_view, networks, |action| subject.agent_view(action));
        let model = key(subject, action, subject.model()).filter(|_| overlays.model);
        changed |= renew(&mut self.prediction, model, |action| subject.predict(action));
        if let Some(hand) = &mut self.hand
            && hand.ghost.as_ref().is_none_or(|ghost| ghost.action != hand.cursor)
        {
            hand.ghost = subject.ghost(hand.cursor);
            changed = true;
        }
        (changed, effects)
    }

    /// Begins hand play, with the tool below the ball; returns what is shown then.
    pub fn take_tool(&mut self, view: &ViewModel) -> Choice {
        let [x, y] = view.task.ball.position;
        self.hand = Some(Hand { cursor: [x, (y - 0.4).max(-0.9)], ghost: None });
        self.select(None);
        Choice::Hand
    }

    /// Ends hand play; returns what is shown then.
    pub fn put_tool_down(&mut self) -> Choice {
        (self.hand, self.player) = (None, Player::default());
        Choice::Latest
    }
}

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
