//! Updates the view model from the session.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::super::playback::Episode;
use super::super::{Level, Live, ViewModel, Watched};
use super::{SessionWorkspace, Workspace, episode_of};
use mge_task::Task;
use mge_workbench::listing::Listing;
use mge_workbench::{Command, Session};

impl SessionWorkspace {
    /// Updates the view from the session and from what was read.
    pub(super) fn refresh(&mut self) {
        (self.refreshed, self.is_stale) = (Instant::now(), false);
        self.listing.refresh(&self.session);
        let known = std::mem::replace(&mut self.view, view_of(&self.session, &self.listing));
        let view = &mut self.view;
        view.prior_failure = known.prior_failure.filter(|_| known.task == view.task);
        (view.figures, view.log, view.log_total) = (known.figures, known.log, known.log_total);
        if let Some((_, Ok(models))) = self.models.latest(|_| true) {
            view.models.clone_from(models);
        }
        if let Some((_, Ok(tasks))) = self.tasks.latest(|_| true) {
            view.tasks.clone_from(tasks);
        }
        // It may just have been written.
        if let Some(file) = view.file.as_ref().map(|file| file.display().to_string())
            && view.tasks.iter().all(|(name, _)| *name != file)
        {
            view.tasks.push((file, Task::clone(&view.task)));
        }
        let before = known.watched.map(|watched| (watched.run.path.clone(), watched.live, watched.greedy));
        let (path, live, greedy) = before.unwrap_or_default();
        let is_same = self.session.run().is_some_and(|run| run.directory().path() == path);
        self.refresh_watched(live.filter(|_| is_same), greedy.filter(|_| is_same));
        let damaged: Vec<String> = self.view.damaged.iter().filter(|it| !known.damaged.contains(it)).cloned().collect();
        damaged.into_iter().for_each(|reason| self.log(Level::Warning, reason));
    }

    /// Updates the watched run; the latest and the greedy episode shown before are kept if they have not changed.
    fn refresh_watched(&mut self, shown: Option<Live>, greedy: Option<Arc<Episode>>) {
        let Some(run) = self.session.run() else { return };
        let path = run.directory().path().to_owned();
        let Some(summary) = self.view.runs.iter().rev().find(|known| known.path == path).cloned() else { return };
        let live = run.live.as_ref().map(|live| Live {
            episode: Arc::new(episode_of(&path, run.config().task_of(live.trace.episode), live.trace.clone())),
            networks: Some(live.ddpg.clone()),
        });
        let greedy = run.greedy.as_ref().map(|trace| match greedy.filter(|known| Arc::ptr_eq(&known.trace, trace)) {
            Some(known) => known,
            None => Arc::new(episode_of(&path, &run.config().task, trace.clone())),
        });
        let agent = self.agents.latest(|(of, ..)| *of == path).map(|(_, agent)| agent.clone());
        let (prior, is_active, last) = (run.prior(), run.is_active(), run.episodes());
        let live = if is_active { live } else { self.last_episode(&path, last, shown).or(live) };
        self.view.watched = Some(Watched { run: summary, prior, live, agent, greedy });
    }

    /// The last episode of a run that this program does not train, or an earlier one while it is being read.
    fn last_episode(&mut self, run: &Path, last: u64, shown: Option<Live>) -> Option<Live> {
        let shown = shown.filter(|live| live.networks.is_none());
        if last == 0 || shown.as_ref().is_some_and(|live| live.episode.trace.episode == last) {
            return shown;
        }
        // An episode that was not recorded cannot be shown.
        let read = self.past_episode(run, last).and_then(Result::ok);
        read.map(|episode| Live { episode, networks: None }).or(shown)
    }
}

/// What a session and the listing of its runs tell at once, without models, the watched run and the log.
pub(super) fn view_of(session: &Session, listing: &Listing) -> ViewModel {
    ViewModel {
        task: session.config().task.clone(),
        file: session.file().map(Path::to_owned),
        dirty: session.is_dirty(),
        proposed: session.proposed().to_vec(),
        proposing: session.job(Command::is_propose).map(|(_, progress)| (progress.done, progress.total)),
        settings: session.config().clone(),
        extends_to: session.extends_to(),
        folder: session.folder().to_owned(),
        prior: session.prior().cloned(),
        prior_state: session.prior_state(),
        prior_failure: None,
        models: Vec::new(),
        tasks: Vec::new(),
        runs: listing.runs.clone(),
        groups: listing.groups().clone(),
        runs_unread: listing.unread(session),
        damaged: listing.damaged(session),
        watched: None,
        hand: session.hand_play.clone(),
        model_work: session.model_work().map(|(name, progress)| (name, progress.share())),
        forking: session.job(Command::is_fork).map(|(command, progress)| (command.to_string(), progress.share())),
        figures: Vec::new(),
        log: Vec::new(),
        log_total: 0,
    }
}
