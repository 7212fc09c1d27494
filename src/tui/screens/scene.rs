//! What the Scene and the Edit screen remember, and what their actions do.

use std::sync::Arc;
use std::time::Duration;

use super::edit::{direction, edit, moved};
use crate::env::Action as Place;
use crate::trainer::Trace;
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::desk::{Desk, LOOK_AHEAD, Mind};
use crate::tui::facts::{Facts, Level};
use crate::tui::playback::{Episode, Player};
use crate::tui::scene::{Ghost, Object, Overlays};

/// State of the scene.
#[derive(Default)]
pub struct Scene {
    /// Time in the episode being shown.
    pub player: Player,
    /// Show the scene untouched even if there are training episodes.
    pub untouched: bool,
    /// What lies over the scene.
    pub overlays: Overlays,
    /// The selected object.
    pub selected: Option<Object>,
    /// The object being dragged, and where to.
    pub drag: Option<(Object, [f32; 2])>,
    /// The person's hand, while they play.
    pub hand: Option<Hand>,
    /// An episode of the watched run's past that is played again.
    past: Option<Arc<Episode>>,
    shown: Option<Arc<Episode>>,
    mind: Option<(usize, usize, Mind)>,
    foreseen: Option<(usize, usize, Vec<[f32; 2]>)>,
}

/// A tool in a person's hand.
pub struct Hand {
    /// Where it is held, normalised.
    pub cursor: Place,
    /// What would become of it.
    pub ghost: Option<Ghost>,
    played: usize,
}

impl Scene {
    /// The episode being shown.
    pub fn episode(&self) -> Option<&Arc<Episode>> {
        self.shown.as_ref()
    }

    /// The episode of a run's past that is being shown, if it is one.
    pub fn replayed(&self) -> Option<&Arc<Episode>> {
        self.past.as_ref()
    }

    /// Shows an episode of a run's past from its start.
    fn show_past(&mut self, episode: Arc<Episode>) {
        self.selected = None;
        self.hand = None;
        self.past = Some(Arc::clone(&episode));
        self.shown = Some(episode);
        self.player.restart();
    }

    /// Leaves the past for what is shown without it; false if that is shown.
    pub fn leave_past(&mut self) -> bool {
        let left = self.past.take().is_some();
        if left {
            self.shown = None;
        }
        left
    }

    /// What the agent thinks, if that is being shown.
    pub fn mind(&self) -> Option<&Mind> {
        self.mind.as_ref().map(|(.., mind)| mind)
    }

    /// What the model predicts from the present action on, if that is being shown.
    pub fn predicted(&self) -> &[[f32; 2]] {
        self.foreseen.as_ref().map_or(&[], |(.., path)| path)
    }

    /// What really happened in the time the model's prediction is for.
    pub fn truth(&self) -> Vec<[f32; 2]> {
        let Some((.., action, path)) = &self.foreseen else { return Vec::new() };
        let Some(shown) = self.shown.as_ref().filter(|_| !path.is_empty()) else { return Vec::new() };
        let steps = shown.trace.steps.iter().skip(*action).take(LOOK_AHEAD);
        steps.flat_map(|step| step.path.iter().copied()).collect()
    }

    /// Whether the picture changes by itself.
    pub fn is_animated(&self) -> bool {
        self.player.playing
    }

    /// Takes in what is new and lets time pass; true if the picture changed.
    pub fn update(&mut self, desk: &mut dyn Desk, elapsed: Duration) -> bool {
        let mut changed = self.choose_episode(desk);
        let step = self.player.step();
        let steps = self.shown.as_ref().map_or(0, |episode| episode.steps());
        let over = self.player.advance(elapsed, steps);
        if over && self.hand.is_some() {
            self.player.playing = false;
        } else if over {
            self.next_episode(desk);
            changed = true;
        }
        changed |= step.min(steps) != self.player.step().min(steps);
        changed |= self.think(desk);
        changed |= self.foresee(desk);
        changed | self.hold(desk)
    }

    fn choose_episode(&mut self, desk: &dyn Desk) -> bool {
        let facts = desk.facts();
        if self.hand.is_some() {
            return self.choose_played(facts);
        }
        if self.past.is_some() {
            return false;
        }
        let live = facts.live.as_ref().filter(|live| !self.untouched && live.task.name == facts.task.name);
        let shown = self.shown.as_ref();
        let showing_live = shown.is_some_and(|shown| shown.trace.episode > 0 && shown.task.name == facts.task.name);
        if live.is_some() && !showing_live {
            self.next_episode(desk);
            return true;
        }
        if live.is_none() {
            if facts.active_runs().next().is_some() {
                desk.request_live();
            }
            if shown.is_none_or(|shown| shown.trace.episode > 0 || *shown.task != *facts.task) {
                self.shown = Some(Arc::new(Episode::untouched(&facts.task)));
                self.player.restart();
                return true;
            }
        }
        false
    }

    fn choose_played(&mut self, facts: &Facts) -> bool {
        let Some(hand) = &mut self.hand else { return false };
        let actions = facts.played.steps.len();
        if hand.played == actions && self.shown.as_ref().is_some_and(|shown| Arc::ptr_eq(&shown.trace, &facts.played)) {
            return false;
        }
        let before: usize = facts.played.steps.iter().take(actions.saturating_sub(1)).map(|step| step.path.len()).sum();
        hand.played = actions;
        hand.ghost = None;
        let title = "played by hand".to_owned();
        self.shown = Some(Arc::new(Episode { title, task: facts.task.clone(), trace: facts.played.clone() }));
        self.player.go_to(before);
        self.player.playing = true;
        true
    }

    /// From the start: the latest training episode if there is one, else the same again.
    fn next_episode(&mut self, desk: &dyn Desk) {
        let facts = desk.facts();
        if self.past.is_none()
            && let Some(live) = facts.live.as_ref().filter(|live| !self.untouched && live.task.name == facts.task.name)
        {
            self.shown = Some(live.clone());
            desk.request_live();
        }
        self.player.restart();
    }

    /// The episode being shown and the action in it that goes on, both as numbers.
    fn place_in_episode(&self, shown: &Episode) -> (usize, usize) {
        let action = shown.at(self.player.step()).action.saturating_sub(1);
        (Arc::as_ptr(&shown.trace).cast::<Trace>() as usize, action)
    }

    /// Asks what the model predicts, when that is shown and the moment is another.
    fn foresee(&mut self, desk: &mut dyn Desk) -> bool {
        let wanted = self.overlays.model;
        let Some(shown) = self.shown.clone().filter(|shown| wanted && shown.trace.episode > 0) else {
            return self.foreseen.take().is_some();
        };
        let (trace, action) = self.place_in_episode(&shown);
        if self.foreseen.as_ref().is_some_and(|(known, at, _)| (*known, *at) == (trace, action)) {
            return false;
        }
        self.foreseen = Some((trace, action, desk.foresee(&shown, action)));
        true
    }

    /// Asks what the agent thinks, when that is shown and the moment is another.
    fn think(&mut self, desk: &dyn Desk) -> bool {
        let wanted = self.overlays.critic || self.overlays.actor;
        let Some(shown) = self.shown.as_ref().filter(|shown| wanted && shown.trace.episode > 0) else {
            return self.mind.take().is_some();
        };
        let (trace, action) = self.place_in_episode(shown);
        if self.mind.as_ref().is_some_and(|(known, at, _)| (*known, *at) == (trace, action)) {
            return false;
        }
        self.mind = desk.mind(shown, action).map(|mind| (trace, action, mind));
        true
    }

    /// Asks what would become of the tool in hand, when it was moved.
    fn hold(&mut self, desk: &mut dyn Desk) -> bool {
        let Some(hand) = &mut self.hand else { return false };
        if hand.ghost.as_ref().is_some_and(|ghost| ghost.action == hand.cursor) {
            return false;
        }
        hand.ghost = Some(desk.ghost(hand.cursor));
        true
    }

    /// Begins hand play, in the middle of the scene or where the ball is.
    fn take_tool(&mut self, facts: &Facts) {
        let [x, y] = facts.task.ball.position;
        self.leave_past();
        self.hand = Some(Hand { cursor: [x, (y - 0.4).max(-0.9)], ghost: None, played: usize::MAX });
        self.selected = None;
    }
}

/// What an action does on the Scene and the Edit screen.
pub fn perform(app: &mut App, action: Action) {
    if app.scene.hand.is_some() && play_by_hand(app, action) {
        return;
    }
    if watch(app, action) || edit(app, action) {
        return;
    }
    match action {
        Action::HandPlay => {
            app.scene.take_tool(app.desk.facts());
            let key = app.keymap.key_for(Action::Confirm, Context::Hand);
            app.say(Level::Info, format!("hand play: move the tool, {key} or a click places it, esc ends"));
        }
        Action::NextObject | Action::PreviousObject => select(app, action == Action::NextObject),
        _ => {}
    }
}

/// Playback and overlays; false if it is none of these.
fn watch(app: &mut App, action: Action) -> bool {
    let scene = &mut app.scene;
    let steps = scene.shown.as_ref().map_or(0, |episode| episode.steps());
    match action {
        Action::PlayPause => scene.player.playing = !scene.player.playing,
        Action::StepOn => scene.player.nudge(1, steps),
        Action::StepBack => scene.player.nudge(-1, steps),
        Action::Faster => scene.player.change_speed(true),
        Action::Slower => scene.player.change_speed(false),
        Action::Restart => scene.player.restart(),
        Action::PreviousEpisode | Action::NextEpisode | Action::First | Action::Last => {
            replay(app, action);
            return true;
        }
        Action::Source if scene.leave_past() => {}
        Action::Source => {
            scene.untouched = !scene.untouched;
            scene.shown = None;
        }
        Action::ShowClusters => scene.overlays.clusters = !scene.overlays.clusters,
        Action::ShowSamples => scene.overlays.samples = !scene.overlays.samples,
        Action::ShowCritic => scene.overlays.critic = !scene.overlays.critic,
        Action::ShowActor => scene.overlays.actor = !scene.overlays.actor,
        Action::ShowModel => scene.overlays.model = !scene.overlays.model,
        Action::ShowStage => {
            let stages = app.desk.facts().task.stage_count();
            let next = scene.overlays.stage.map_or(0, |stage| stage + 1);
            scene.overlays.stage = Some(next).filter(|stage| *stage < stages);
        }
        _ => return false,
    }
    explain_overlay(app, action);
    true
}

/// Plays another episode of the watched run's past again.
fn replay(app: &mut App, action: Action) {
    let Some(run) = app.desk.facts().current_run().filter(|run| run.done > 0) else {
        return app.say(Level::Info, "no run with episodes is being watched: the Runs screen (5) has them");
    };
    let last = run.done;
    let now = app.scene.past.as_ref().map(|episode| episode.trace.episode);
    let episode = match action {
        Action::First => 1,
        Action::Last => last,
        Action::PreviousEpisode => now.map_or(last, |now| now.saturating_sub(1)),
        _ => now.map_or(1, |now| now + 1),
    };
    match app.desk.past_episode(episode.clamp(1, last)) {
        Ok(episode) => {
            let goal = if episode.trace.reached_goal() { ", which reached the goal" } else { "" };
            let key = app.keymap.key_for(Action::Source, Context::Scene);
            let text = format!("episode {} of {last}{goal}; {key} leaves the past", episode.trace.episode);
            app.scene.show_past(episode);
            app.say(Level::Info, text);
        }
        Err(error) => app.say(Level::Error, error),
    }
}

/// Says why an overlay that was switched on shows nothing.
fn explain_overlay(app: &mut App, action: Action) {
    let overlays = app.scene.overlays;
    let facts = app.desk.facts();
    let text = match action {
        Action::ShowClusters | Action::ShowSamples if facts.prior.is_none() => {
            format!(
                "no action clusters yet: {} computes them",
                app.keymap.key_for(Action::Clusters, Context::Everywhere)
            )
        }
        Action::ShowCritic | Action::ShowActor | Action::ShowModel if facts.live.is_none() => {
            format!(
                "there is no training episode yet: {} trains one",
                app.keymap.key_for(Action::Train, Context::Everywhere)
            )
        }
        Action::ShowStage => match overlays.stage {
            None => "clusters of all stages".to_owned(),
            Some(stage) if stage == facts.task.subgoals.len() => "clusters of the goal".to_owned(),
            Some(stage) => format!("clusters of subgoal {}", stage + 1),
        },
        _ => return,
    };
    app.say(Level::Info, text);
}

fn select(app: &mut App, next: bool) {
    app.scene.leave_past();
    let objects = app.desk.facts().objects().all();
    let now = app.scene.selected.and_then(|selected| objects.iter().position(|object| *object == selected));
    let index = match (now, next) {
        (None, true) => 0,
        (None, false) => objects.len() - 1,
        (Some(now), true) => (now + 1) % objects.len(),
        (Some(now), false) => (now + objects.len() - 1) % objects.len(),
    };
    app.scene.selected = Some(objects[index]);
}

/// Actions of hand play; false if it is none of these.
fn play_by_hand(app: &mut App, action: Action) -> bool {
    let Some(hand) = &mut app.scene.hand else { return false };
    if let Some(by) = direction(action, 0.02, 0.1) {
        hand.cursor = moved(hand.cursor, by);
        return true;
    }
    match action {
        Action::Confirm => place(app),
        Action::Restart => app.line("reset"),
        Action::HandPlay => back(app),
        _ => return false,
    }
    true
}

/// Places the tool where it is held.
pub fn place(app: &mut App) {
    let Some(hand) = &app.scene.hand else { return };
    let [x, y] = hand.cursor;
    app.line(&format!("place {x} {y}"));
}

/// Leaves hand play, or lets go of the selected object.
pub fn back(app: &mut App) {
    let scene = &mut app.scene;
    if scene.drag.take().is_some() {
        return;
    }
    if scene.hand.take().is_some() {
        scene.shown = None;
        scene.player = Player::default();
    } else if scene.leave_past() {
        // That was the layer to be left.
    } else if scene.selected.take().is_none() {
        app.show(super::Tab::Scene);
    }
}
