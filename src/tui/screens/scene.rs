//! State of the Scene and Edit screens.

use std::sync::Arc;
use std::time::Duration;

use crate::tui::effect::Effect;
use crate::tui::scene::{Ghost, Overlays};
use crate::tui::view::playback::Player;
use crate::tui::view::{AgentView, Choice, Subject, ViewModel};
use mge_agent::Ddpg;
use mge_env::Action;
use mge_guidance::RolloutModel;
use mge_task::{Edit, Object};
use mge_trainer::Trace;

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
