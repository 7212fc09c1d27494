//! The subject of the scene as one value: a task, an episode on it, and the run, clusters, networks and
//! model that belong to them. It is assembled in one place, so that an episode is never shown with the
//! parts of another task. A missing part gives the reason.

mod overlays;
#[cfg(test)]
mod tests;

pub use overlays::{AgentView, TaskModel};

use std::sync::Arc;

use super::playback::{Episode, Origin};
use super::{Live, PastAgent, RunSummary, ViewModel, Watched};
use mge_agent::Ddpg;
use mge_env::Snapshot;
use mge_guidance::{ActionPrior, RolloutModel};
use mge_run::Metric;
use mge_task::Task;
use mge_workbench::{PriorState, SavedAgent};

/// What the user wants the scene to show.
#[derive(Debug, Clone, Default)]
pub enum Choice {
    /// The latest training episode on the edited task; if there is none, an episode without tools.
    #[default]
    Latest,
    /// A past episode of the watched run, or an episode of its greedy policy.
    Past(Arc<Episode>),
    /// The episode played by hand.
    Hand,
}

/// The action clusters of a subject.
#[derive(Debug, Clone)]
pub struct Clusters {
    /// The clusters.
    pub prior: Arc<ActionPrior>,
    /// Task or settings have changed since they were computed.
    pub stale: bool,
    /// They belong to the run, not to the session.
    pub of_run: bool,
}

/// The subject of the scene. All its parts belong to one task.
#[derive(Debug, Clone)]
pub struct Subject {
    /// What the user wants to see.
    pub choice: Choice,
    /// The task.
    pub task: Arc<Task>,
    /// The episode on the task.
    pub episode: Arc<Episode>,
    run: Option<Arc<RunSummary>>,
    /// The clusters of the task, if there are any.
    pub clusters: Option<Clusters>,
    /// The networks of the agent that acts in the episode, if they are available.
    pub networks: Option<Arc<Ddpg>>,
    /// The agent of a checkpoint, if the networks of the running training are not available.
    agent: Option<PastAgent>,
    /// The threshold epsilon in a past episode.
    epsilon: Option<f32>,
    model: Option<Result<TaskModel, String>>,
    /// State of the episode played by hand.
    hand: Option<Snapshot>,
    /// Why the scene does not show what the user may expect.
    pub note: Option<String>,
}

impl Subject {
    /// Assembles the subject from the view model. The episode shown `before` continues if it is still valid, unless
    /// the `next` one is due.
    pub fn choose(view: &ViewModel, choice: &Choice, before: Option<&Self>, next: bool) -> Self {
        let choice = match choice {
            // Past episodes belong to the watched run; another run is being watched now.
            Choice::Past(episode) if view.watched.as_ref().is_none_or(|watched| !episode.is_of(&watched.run.path)) => {
                Choice::Latest
            }
            choice => choice.clone(),
        };
        let live = view.watched.as_ref().and_then(|watched| watched.live.as_ref());
        let (task, episode, note) = chosen(view, &choice, before, next);
        let of_run = view.watched.as_ref().filter(|watched| is_same_scene(&watched.run.config.task, &task));
        let own = view.watched.as_ref().filter(|watched| episode.is_of(&watched.run.path));
        let live = live.filter(|_| own.is_some() && !matches!(choice, Choice::Past(_)));
        let live_networks = live.and_then(|live| live.networks.clone());
        let agent = own.filter(|_| live_networks.is_none()).and_then(|watched| watched.agent.clone());
        let is_near = |agent: &Arc<SavedAgent>| agent.is_nearest_to(number_for_agent(&episode));
        let agent = agent.filter(|agent| agent.as_ref().map_or(true, is_near));
        let of_checkpoint = agent.as_ref().and_then(|agent| agent.as_ref().ok());
        let epsilon = own.and_then(|watched| watched.run.curves.at(Metric::Epsilon, episode.trace.episode));
        let model = before.and_then(|before| before.model.clone());
        let clusters = match &choice {
            Choice::Past(_) => past_clusters(of_checkpoint, &task, of_run),
            _ => clusters(view, &task, of_run),
        };
        Self {
            clusters,
            networks: live_networks.or_else(|| of_checkpoint.and_then(|agent| agent.networks.clone())),
            agent,
            epsilon: epsilon.filter(|_| matches!(&choice, Choice::Past(past) if past.trace.episode > 0)),
            model: model.filter(|model| model.as_ref().is_ok_and(|model| Arc::ptr_eq(&model.task, &task))),
            hand: matches!(choice, Choice::Hand).then(|| view.hand.env.snapshot().clone()),
            run: view.watched.as_ref().map(|watched| watched.run.clone()),
            choice,
            task,
            episode,
            note,
        }
    }

    /// The watched run.
    pub fn run(&self) -> Option<&RunSummary> {
        self.run.as_deref()
    }

    /// Whether the episode belongs to a run, so that an agent acts in it.
    pub fn is_of_run(&self) -> bool {
        matches!(self.episode.origin, Origin::Run(_))
    }

    /// The number of the episode whose agent has to be read from a checkpoint, `u64::MAX` for the newest
    /// checkpoint. None if the networks of the running training are shown, or no agent acts.
    pub fn needed_agent(&self) -> Option<u64> {
        let is_past = self.is_of_run() && (self.networks.is_none() || self.agent.is_some());
        is_past.then(|| number_for_agent(&self.episode))
    }

    /// The number of the past episode shown, counted from 1.
    pub fn past_episode(&self) -> Option<u64> {
        match &self.choice {
            Choice::Past(episode) => Some(episode.trace.episode).filter(|number| *number > 0),
            _ => None,
        }
    }

    /// Short phrases about the episode: the threshold epsilon, and the checkpoint of the critic and actor shown.
    pub fn facts(&self) -> Vec<String> {
        let epsilon = self.epsilon.map(|epsilon| format!("epsilon {epsilon:.2}"));
        let agent = self.agent.as_ref().and_then(|agent| agent.as_ref().ok());
        let of_checkpoint = agent.map(|agent| format!("agent of episode {}", agent.episode));
        epsilon.into_iter().chain(of_checkpoint).collect()
    }

    /// Sets the model of the task, or the reason why there is none. A model of another task becomes an error.
    pub fn set_model(&mut self, model: Result<TaskModel, String>) {
        self.model = Some(match model {
            Ok(model) if !Arc::ptr_eq(&model.task, &self.task) => Err("the model belongs to another task".to_owned()),
            model => model,
        });
    }

    /// The model of the task, if there is one.
    pub fn model(&self) -> Option<&Arc<dyn RolloutModel>> {
        Some(&self.model.as_ref()?.as_ref().ok()?.model)
    }
}

/// The episode number for which to request an agent; `u64::MAX` for an episode of the greedy policy.
fn number_for_agent(episode: &Episode) -> u64 {
    Some(episode.trace.episode).filter(|number| *number > 0).unwrap_or(u64::MAX)
}

/// The task and the episode of a choice, and why the scene does not show what the user may expect.
fn chosen(
    view: &ViewModel,
    choice: &Choice,
    before: Option<&Subject>,
    next: bool,
) -> (Arc<Task>, Arc<Episode>, Option<String>) {
    match choice {
        Choice::Past(episode) => (episode.task.clone(), episode.clone(), None),
        Choice::Hand => (view.hand.env.task().clone(), by_hand(view, before), None),
        Choice::Latest => {
            let trained = view.watched.as_ref().and_then(|watched| watched.live.as_ref());
            match trained {
                Some(live) if is_same_scene(&live.episode.task, &view.task) => {
                    (view.task.clone(), continued(view, before, next).unwrap_or(&live.episode).clone(), None)
                }
                _ => {
                    let shown = if view.dirty { "edited" } else { "open" };
                    let note = |live: &Live| {
                        format!("the run trains {}, not the {shown} {}", live.episode.task.name, view.task.name)
                    };
                    let note = trained.map(note);
                    (view.task.clone(), untouched(&view.task, before), note)
                }
            }
        }
    }
}

/// The training episode shown before, if it may continue.
fn continued<'a>(view: &ViewModel, before: Option<&'a Subject>, next: bool) -> Option<&'a Arc<Episode>> {
    let run = view.watched.as_ref().map(|watched| watched.run.path.as_path())?;
    let before = before.filter(|before| matches!(before.choice, Choice::Latest) && !next)?;
    Some(&before.episode).filter(|episode| episode.is_of(run) && is_same_scene(&episode.task, &view.task))
}

/// The episode without tools; the same value as before if the task has not changed.
fn untouched(task: &Arc<Task>, before: Option<&Subject>) -> Arc<Episode> {
    let known = before.map(|before| &before.episode);
    let same = known.filter(|known| known.origin == Origin::Untouched && known.task == *task);
    same.cloned().unwrap_or_else(|| Arc::new(Episode::untouched(task)))
}

/// The episode played by hand; the same value as before if nothing has been placed since.
fn by_hand(view: &ViewModel, before: Option<&Subject>) -> Arc<Episode> {
    let known = before.map(|before| &before.episode);
    let same = known.filter(|known| known.origin == Origin::Hand && Arc::ptr_eq(&known.trace, &view.hand.trace));
    same.cloned().unwrap_or_else(|| {
        let (task, trace) = (view.hand.env.task().clone(), view.hand.trace.clone());
        Arc::new(Episode { task, trace, origin: Origin::Hand })
    })
}

/// The session's clusters, if they belong to this task, or else the clusters of the run on it.
fn clusters(view: &ViewModel, task: &Task, of_run: Option<&Watched>) -> Option<Clusters> {
    let stale = view.prior_state != PriorState::Fresh;
    let own = view.prior.clone().filter(|_| is_same_scene(&view.task, task));
    let own = own.map(|prior| Clusters { prior, stale, of_run: false });
    own.or_else(|| Some(Clusters { prior: of_run?.prior.clone()?, stale: false, of_run: true }))
}

/// The clusters for a past episode: those of its checkpoint, or else the latest of the run.
fn past_clusters(agent: Option<&Arc<SavedAgent>>, task: &Task, of_run: Option<&Watched>) -> Option<Clusters> {
    let of_checkpoint = agent.and_then(|agent| agent.prior_of(task).cloned());
    let prior = of_checkpoint.or_else(|| of_run?.prior.clone())?;
    Some(Clusters { prior, stale: false, of_run: true })
}

/// Whether two tasks are equal except for name and description.
fn is_same_scene(a: &Task, b: &Task) -> bool {
    std::ptr::eq(a, b) || Task { name: b.name.clone(), description: b.description.clone(), ..a.clone() } == *b
}
