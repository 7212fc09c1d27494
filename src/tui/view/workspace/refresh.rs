//! Updates the view model from the session.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::super::past::episode_of;
use super::super::playback::Episode;
use super::super::{Curves, HandEpisode, Live, RunSummary, Watched, marks};
use super::{SessionWorkspace, preparing};
use mge_run::RunState;
use mge_task::Task;
use mge_workbench::{RunView, Session};

impl SessionWorkspace {
    /// Updates the view from the session.
    pub(super) fn refresh(&mut self) {
        (self.refreshed, self.is_stale) = (Instant::now(), false);
        let session = &self.session;
        let view = &mut self.view;
        if *view.task != *session.task() {
            view.task = Arc::new(session.task().clone());
            view.models = self.models.summaries(session.task());
        }
        view.file = session.file().map(Path::to_owned);
        view.dirty = session.is_dirty();
        view.proposed = session.proposed().to_vec();
        view.proposing = session.proposing().map(|progress| (progress.done, progress.total));
        view.settings = session.config().clone();
        view.extends_to = session.extends_to();
        view.folder = session.folder().to_owned();
        view.prior_state = session.prior_state();
        view.prior = session.prior().cloned();
        let hand = session.hand_play();
        let actions = hand.trace().steps.len();
        if actions == 0 || view.hand.trace.steps.len() != actions || *view.hand.task != **hand.task() {
            view.hand = hand_episode(session, &view.task, Some(&view.hand));
        }
        let work = session.model_work().map(|(name, progress)| (name, progress.share()));
        let name = |work: &Option<(String, _)>| work.as_ref().map(|(name, _)| name.clone());
        if work.is_some() && name(&work) != name(&view.model_work) {
            view.model_losses = Arc::default();
            view.model_outcome = None;
        }
        let losses = session.model_losses(view.model_losses.len());
        if !losses.is_empty() {
            Arc::make_mut(&mut view.model_losses).extend(losses);
        }
        view.model_work = work;
        // Drop the watched run's summary first: while it shares the curves, extending them would copy them.
        let greedy = self.view.watched.take().and_then(|watched| watched.greedy);
        self.refresh_runs();
        self.refresh_watched(greedy);
    }

    /// Updates the list of runs from the folder and the session.
    fn refresh_runs(&mut self) {
        let old = std::mem::take(&mut self.view.runs).into_iter().filter(|run| run.opened);
        let mut old: HashMap<PathBuf, Arc<RunSummary>> = old.map(|run| (run.path.clone(), run)).collect();
        let now = Instant::now();
        let opened = self.session.runs().iter().map(|run| {
            let path = run.directory().path();
            let rate = self.rates.entry(path.to_owned()).or_default();
            if run.state() == RunState::Running {
                rate.note(now, run.episodes());
            } else {
                rate.forget();
            }
            let indexed = self.index.runs().iter().find(|known| known.path == path);
            if let Some(known) = indexed.filter(|_| run.is_unread()) {
                // Until its log is read, use the summary from the index.
                return (path.to_owned(), Arc::new(RunSummary { opened: true, ..RunSummary::clone(known) }));
            }
            let known = old.remove(path).map(|run| run.curves.clone()).unwrap_or_default();
            let summary = summary_of(run, known, rate.per_second());
            let (tags, note) = indexed.map(|known| (known.tags.clone(), known.note.clone())).unwrap_or_default();
            (path.to_owned(), Arc::new(RunSummary { tags, note, ..summary }))
        });
        let opened: HashMap<PathBuf, Arc<RunSummary>> = opened.collect();
        // A run keeps its place in the list.
        let is_on_disk = |path: &Path| self.index.runs().iter().any(|run| run.path == path);
        self.begun.extend(opened.keys().filter(|path| !is_on_disk(path)).cloned());
        let on_disk = self.index.runs().iter().filter(|run| !self.begun.contains(&run.path));
        let with_history = |run: &Arc<RunSummary>| match self.histories.of(&run.path) {
            Some(history) => Arc::new(RunSummary {
                curves: history.curves.clone(),
                evaluations: history.evaluations.clone(),
                marks: marks(&run.config, &history.interventions),
                practised: history.practised.clone(),
                needs: history.needs.clone(),
                ..RunSummary::clone(run)
            }),
            None => run.clone(),
        };
        let found = |run: &Arc<RunSummary>| opened.get(&run.path).cloned().unwrap_or_else(|| with_history(run));
        self.view.runs = on_disk.map(found).collect();
        let paths = self.session.runs().iter().map(|run| run.directory().path());
        let begun = paths.filter(|path| self.begun.contains(*path)).filter_map(|path| opened.get(path));
        self.view.runs.extend(begun.cloned());
        self.view.details = self.details.known().cloned();
        self.view.groups = self.grouper.known().clone();
        self.grouper.note_change();
        self.view.runs_unread = self.index.unread();
        self.view.runs_damaged = self.index.damaged().len();
        self.view.system = self.meter.known();
    }

    /// Updates the watched run. The `known` greedy episode is reused if it is still the same.
    fn refresh_watched(&mut self, known: Option<Arc<Episode>>) {
        let watched = self.session.run().and_then(|run| {
            let path = run.directory().path();
            let summary = self.view.runs.iter().rev().find(|known| known.path == path)?.clone();
            let task = run.config().task.clone();
            let live = run.live().map(|live| Live {
                episode: Arc::new(episode_of(path, run.config().task_of(live.trace.episode), live.trace.clone())),
                networks: Some(live.ddpg.clone()),
            });
            // The live episode of a training that has ended need not be its last one.
            let last = self.last.of(run).map(|episode| Live { episode, networks: None });
            let live = if run.is_active() { live } else { last.or(live) };
            let greedy = run.greedy().map(|trace| match known.filter(|known| Arc::ptr_eq(&known.trace, trace)) {
                Some(known) => known,
                None => Arc::new(episode_of(path, &task, trace.clone())),
            });
            let agent = self.agents.of(path);
            Some(Watched { run: summary, task, prior: run.prior(), live, agent, greedy })
        });
        self.view.watched = watched;
    }
}

/// The episode played by hand. It shares `task` if the tasks are equal, and the trace of `known` if that is
/// unchanged.
pub(super) fn hand_episode(session: &Session, task: &Arc<Task>, known: Option<&HandEpisode>) -> HandEpisode {
    let hand = session.hand_play();
    let known = known.filter(|known| *known.trace == *hand.trace() && *known.task == **hand.task());
    HandEpisode {
        task: if **hand.task() == **task { task.clone() } else { hand.task().clone() },
        trace: known.map_or_else(|| Arc::new(hand.trace().clone()), |known| known.trace.clone()),
        snapshot: Arc::new(hand.snapshot().clone()),
    }
}

fn summary_of(run: &RunView, mut curves: Arc<Curves>, rate: Option<f64>) -> RunSummary {
    let records = run.records();
    if !curves.is_of(records) {
        Arc::make_mut(&mut curves).follow(records);
    }
    RunSummary {
        name: run.name(),
        opened: true,
        active: run.is_active(),
        queued: run.is_queued(),
        preparing: preparing(run),
        done: run.episodes(),
        success: records.last().map(|record| record.rolling_success as f32),
        curves,
        evaluations: run.evaluations().iter().map(|e| (e.episode, e.success as f32)).collect(),
        marks: marks(run.config(), run.interventions()),
        practised: run.practised().cloned(),
        needs: run.needs().to_vec(),
        rate,
        ..RunSummary::new(run.directory().path(), run.config().clone(), run.state())
    }
}
