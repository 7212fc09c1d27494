//! What happens as time passes: polls of the session, playback, and requests for what is visible.

use std::sync::Arc;
use std::time::Duration;

use super::{App, QuitState, TerminalRequest};
use crate::tui::actions::Tab;
use crate::tui::chart::Range;
use crate::tui::screens::{runs, training};
use crate::tui::view::{Choice, Level, LogLine, Subject, comparable};
use mge_run::RunState;
use mge_trainer::Method;

/// How long a message other than an error is shown.
const MESSAGE: Duration = Duration::from_secs(6);
/// Interval between requests for curves while nothing else happens; other processes may be training the runs.
const REQUEST_EVERY: Duration = Duration::from_secs(2);
/// Minimum time between two pictures that only show changes of the session, such as training progress.
const MIN_REDRAW_INTERVAL: Duration = Duration::from_millis(240);
/// Maximum that one tick adds to the time for which a message has been shown.
const MAX_SHOWN_PER_TICK: Duration = Duration::from_millis(100);

impl App {
    /// Advances time and polls the session.
    pub fn tick(&mut self, elapsed: Duration) {
        let lines = self.workspace.view().log_total;
        let is_changed = self.workspace.poll();
        self.announce_ends();
        self.show_news(is_changed, elapsed);
        let view = self.workspace.view();
        let fresh = &view.log[view.log.len() - view.log_total.saturating_sub(lines).min(view.log.len())..];
        let warnings = fresh.iter().filter(|line| line.level == Level::Warning);
        let warnings: String = warnings.map(|line| format!("; ! {}", line.text)).collect();
        if let Some(LogLine { level, text, .. }) = fresh.iter().rev().find(|line| line.level != Level::Info).cloned() {
            // Warnings about what was just done come after its report: it is not refused.
            let is_of_it = |(of, _, shown): &(Level, String, Duration)| *of == Level::Good && shown.is_zero();
            match self.message.take_if(|message| !warnings.is_empty() && level != Level::Error && is_of_it(message)) {
                Some(_) if level == Level::Good => self.show_message(Level::Info, text + &warnings),
                Some((_, done, _)) => self.show_message(Level::Info, done + &warnings),
                None => self.show_message(level, text),
            }
        }
        self.age_message(elapsed);
        let is_asking = self.layers.iter().any(|layer| layer.is_warning());
        if self.leaving == QuitState::WhenIdle && !is_asking && self.workspace.view().training_runs().next().is_none() {
            self.leaving = QuitState::No;
            self.quit();
        }
        if is_changed {
            self.choose_subject(None, false);
            self.show_greedy();
        }
        if let Err(reason) = self.show_awaited() {
            self.show_message(Level::Error, reason);
        }
        // Beside the curves there is one for a past episode.
        let is_past = matches!(self.subject.choice, Choice::Past(_));
        if matches!(self.tab, Tab::Scene | Tab::Edit) || (self.tab == Tab::Training && is_past) {
            self.tick_scene(elapsed);
        }
        if self.are_curves_due(elapsed) {
            self.request_curves();
        }
        if self.tab == Tab::Figures {
            self.update_preview();
        }
    }

    /// Requests a redraw for changes of the session, at most once per `MIN_REDRAW_INTERVAL`.
    pub(super) fn show_news(&mut self, is_changed: bool, elapsed: Duration) {
        self.news |= is_changed;
        self.since_news += elapsed;
        if self.news && self.since_news >= MIN_REDRAW_INTERVAL {
            (self.news, self.since_news) = (false, Duration::ZERO);
            self.changed = true;
        }
    }

    /// Announces runs of this session that were finished or have failed.
    fn announce_ends(&mut self) {
        let view = self.workspace.view();
        let now = view.active_runs().map(|run| run.path.clone()).collect();
        let before = std::mem::replace(&mut self.training, now);
        let ended = before.iter().filter_map(|path| view.run(path)).filter(|run| !self.training.contains(&run.path));
        let news = ended.filter_map(|run| match &run.state {
            RunState::Finished => Some(format!("{} is finished", run.name)),
            RunState::Failed(reason) => Some(format!("{} has failed: {reason}", run.name)),
            _ => None,
        });
        let news: Vec<String> = news.collect();
        if !news.is_empty() {
            self.request = Some(TerminalRequest::Notify(news.join(", ")));
        }
    }

    /// Whether to request the visible curves again. This is not done at every tick: finding out which they are
    /// takes milliseconds with thousands of runs.
    pub(super) fn are_curves_due(&mut self, elapsed: Duration) -> bool {
        self.since_request += elapsed;
        let is_due = self.changed || self.since_request >= REQUEST_EVERY;
        if is_due {
            self.since_request = Duration::ZERO;
        }
        is_due
    }

    /// Requests the curves of the visible runs.
    fn request_curves(&mut self) {
        let ui = self.ui();
        let mut wanted = match self.tab {
            Tab::Scene => training::wanted(&self.screens.beside, &self.screens.runs, &ui),
            Tab::Training => training::wanted(&self.screens.curves, &self.screens.runs, &ui),
            Tab::Runs => runs::wanted(&self.screens.runs, &ui),
            _ => return,
        };
        // They tell what further runs will cost.
        for method in Method::ALL {
            let runs = comparable(&ui.view.runs, &ui.view.task.name, method, ui.view.settings.episodes.into());
            let others: Vec<_> = runs.iter().map(|run| &run.path).filter(|it| !wanted.contains(it)).cloned().collect();
            wanted.extend(others);
        }
        self.workspace.request_curves(wanted);
    }

    /// Shows a requested greedy episode once it is available.
    pub(super) fn show_greedy(&mut self) {
        let Some(greedy) = self.workspace.view().watched.as_ref().and_then(|watched| watched.greedy.clone()) else {
            return;
        };
        if self.greedy.as_ref().is_none_or(|known| !Arc::ptr_eq(known, &greedy)) {
            self.greedy = Some(greedy.clone());
            self.choose_subject(Some(Choice::Past(greedy)), false);
        }
    }

    fn tick_scene(&mut self, elapsed: Duration) {
        self.screens.scene.all = self.tab == Tab::Training;
        if let Some(episode) = self.subject.needed_agent() {
            self.workspace.request_agent(episode);
        }
        if self.screens.scene.needs_model(&self.subject) {
            let had_model = self.subject.model().is_some();
            if let Some(model) = self.workspace.model_for(&self.subject.task.clone()) {
                self.subject.set_model(model);
            }
            if self.subject.model().is_some() != had_model {
                self.screens.scene.renew_ghost();
            }
        }
        let (moved, effects) = self.screens.scene.update(&self.subject, elapsed);
        self.changed |= moved;
        self.carry_out(effects);
        // Request a training episode until there is one to show.
        let watched = self.workspace.view().watched.as_ref();
        if watched.is_some_and(|watched| watched.run.active && watched.live.is_none()) {
            self.workspace.request_live();
        }
    }

    /// Updates what the scene shows from the current view.
    pub fn choose_subject(&mut self, choice: Option<Choice>, next: bool) {
        let choice = choice.unwrap_or_else(|| self.subject.choice.clone());
        // A player that has stopped repeating its episode moves on as soon as there is another.
        let next = next || self.screens.scene.player.is_resting();
        let subject = Subject::choose(self.workspace.view(), &choice, Some(&self.subject), next);
        let is_other = !Arc::ptr_eq(&subject.episode, &self.subject.episode);
        let is_other_run = subject.run().map(|run| &run.path) != self.subject.run().map(|run| &run.path);
        for tab in [Tab::Scene, Tab::Training] {
            let curves = self.screens.curves_on(tab).0;
            if is_other_run {
                // The window of one run does not suit another.
                (curves.range, curves.crosshair, curves.hovered) = (Range::Whole, None, None);
            }
            curves.follow(self.subject.past_episode(), subject.past_episode(), tab == self.tab);
        }
        self.subject = subject;
        if is_other || next {
            self.screens.scene.begin(&self.subject, is_other);
            self.changed = true;
            if self.subject.is_of_run() {
                // Request the following episode in advance.
                self.workspace.request_live();
            }
        }
    }

    fn age_message(&mut self, elapsed: Duration) {
        let Some((level, _, shown)) = &mut self.message else { return };
        // Work that blocks the screen must not use up the display time of its own message.
        *shown += elapsed.min(MAX_SHOWN_PER_TICK);
        if *level != Level::Error && *shown > MESSAGE {
            self.message = None;
            self.changed = true;
        }
    }
}
