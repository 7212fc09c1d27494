//! The subject of the scene as one value: a task, an episode on it, and the run, clusters, networks and
//! model that belong to them. It is assembled in one place, so that an episode is never shown with the
//! parts of another task. A missing part gives the reason.

mod overlays;

pub use overlays::AgentView;

use std::path::PathBuf;
use std::sync::Arc;

use super::playback::{Episode, Origin};
use super::{PastAgent, RunSummary, TaskModel, ViewModel, Watched};
use crate::agent::Ddpg;
use crate::env::Snapshot;
use crate::guidance::{ActionPrior, RolloutModel};
use crate::run::Metric;
use crate::task::Task;
use crate::workbench::{PriorState, SavedAgent};

/// What the user wants the scene to show.
#[derive(Debug, Clone, Default)]
pub enum Choice {
    /// The latest training episode on the edited task or, if the run has several tasks, on any of them; if there is
    /// none, an episode without tools.
    #[default]
    Latest,
    /// An episode without tools, even if the task is being trained on.
    Untouched,
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
    choice: Choice,
    task: Arc<Task>,
    episode: Arc<Episode>,
    run: Option<Arc<RunSummary>>,
    clusters: Option<Clusters>,
    networks: Option<Arc<Ddpg>>,
    /// The agent of a checkpoint, if the networks of the running training are not available.
    agent: Option<PastAgent>,
    /// The threshold epsilon in a past episode.
    epsilon: Option<f32>,
    model: Option<Result<TaskModel, String>>,
    /// State of the episode played by hand.
    hand: Option<Arc<Snapshot>>,
    /// Why the scene does not show what the user may expect.
    note: Option<String>,
    /// The same episode of another run, shown beside a past one.
    beside: Option<Beside>,
}

/// The same episode of another run, for comparison.
#[derive(Debug, Clone)]
pub struct Beside {
    /// Folder of the run.
    pub run: PathBuf,
    /// Number of the episode, counted from 1.
    pub number: u64,
    /// The episode, or why there is none.
    pub episode: Result<Arc<Episode>, String>,
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
        let mut note = None;
        let (task, episode) = match &choice {
            Choice::Past(episode) => (episode.task.clone(), episode.clone()),
            Choice::Hand => (view.hand.task.clone(), by_hand(view, before)),
            Choice::Latest => match live.filter(|live| is_trained(view, &live.episode.task)) {
                Some(live) => {
                    let episode = continued(view, before, next).unwrap_or(&live.episode).clone();
                    let is_edited = is_same_scene(&episode.task, &view.task);
                    (if is_edited { view.task.clone() } else { episode.task.clone() }, episode)
                }
                None => {
                    note = live.map(|live| other_task(&live.episode.task, &view.task));
                    (view.task.clone(), untouched(&view.task, before))
                }
            },
            Choice::Untouched => (view.task.clone(), untouched(&view.task, before)),
        };
        let of_run = view.watched.as_ref().filter(|watched| is_same_scene(&watched.task, &task));
        let own = view.watched.as_ref().filter(|watched| episode.is_of(&watched.run.path));
        let live = live.filter(|_| own.is_some() && !matches!(choice, Choice::Past(_)));
        let live_networks = live.and_then(|live| live.networks.clone());
        let agent = own.filter(|_| live_networks.is_none()).and_then(|watched| watched.agent.clone());
        let agent = agent.filter(|agent| match agent {
            Ok(agent) => agent.is_nearest_to(number_for_agent(&episode)),
            Err(_) => true,
        });
        let of_checkpoint = agent.as_ref().and_then(|agent| agent.as_ref().ok());
        let epsilon = own.and_then(|watched| watched.run.curves.at(Metric::Epsilon, episode.trace.episode));
        let model = before.and_then(|before| before.model.clone());
        let clusters = match &choice {
            Choice::Past(_) => past_clusters(of_checkpoint, &task, of_run),
            _ => clusters(view, &task, of_run),
        };
        let beside = before.and_then(|before| before.beside.clone());
        let subject = Self {
            clusters,
            networks: live_networks.or_else(|| of_checkpoint.and_then(|agent| agent.networks.clone())),
            agent,
            epsilon: epsilon.filter(|_| matches!(choice, Choice::Past(_))),
            model: model.filter(|model| model.as_ref().is_ok_and(|model| Arc::ptr_eq(&model.task, &task))),
            hand: Some(view.hand.snapshot.clone()).filter(|_| matches!(choice, Choice::Hand)),
            run: view.watched.as_ref().map(|watched| watched.run.clone()),
            choice,
            task,
            episode,
            note,
            beside: None,
        };
        let is_same = |beside: &Beside| subject.past_episode() == Some(beside.number);
        Self { beside: beside.filter(is_same), ..subject }
    }

    /// The same episode of another run, if one is being compared.
    pub fn beside(&self) -> Option<&Beside> {
        self.beside.as_ref()
    }

    /// Sets or removes the episode of another run beside a past one. One with a different number counts as none.
    pub fn set_beside(&mut self, beside: Option<Beside>) {
        self.beside = beside.filter(|beside| self.past_episode() == Some(beside.number));
    }

    /// The user's choice.
    pub fn choice(&self) -> &Choice {
        &self.choice
    }

    /// The task.
    pub fn task(&self) -> &Arc<Task> {
        &self.task
    }

    /// The episode on the task.
    pub fn episode(&self) -> &Arc<Episode> {
        &self.episode
    }

    /// The watched run.
    pub fn run(&self) -> Option<&RunSummary> {
        self.run.as_deref()
    }

    /// The clusters of the task, if there are any.
    pub fn clusters(&self) -> Option<&Clusters> {
        self.clusters.as_ref()
    }

    /// Why the scene does not show what the user may expect.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
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
        let of_checkpoint = match &self.agent {
            Some(Ok(agent)) => Some(format!("agent of episode {}", agent.episode)),
            _ => None,
        };
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

    /// The networks of the agent that acts in the episode, if they are available.
    pub fn networks(&self) -> Option<&Arc<Ddpg>> {
        self.networks.as_ref()
    }
}

/// The episode number for which to request an agent; `u64::MAX` for an episode of the greedy policy.
fn number_for_agent(episode: &Episode) -> u64 {
    match episode.trace.episode {
        0 => u64::MAX,
        number => number,
    }
}

/// The training episode shown before, if it may continue.
fn continued<'a>(view: &ViewModel, before: Option<&'a Subject>, next: bool) -> Option<&'a Arc<Episode>> {
    let run = view.watched.as_ref().map(|watched| watched.run.path.as_path())?;
    let before = before.filter(|before| matches!(before.choice, Choice::Latest) && !next)?;
    Some(&before.episode).filter(|episode| episode.is_of(run) && is_trained(view, &episode.task))
}

/// Whether the latest episode is shown if it is on this task: that of the session, or any of the watched run if that of
/// the session is one of several.
fn is_trained(view: &ViewModel, task: &Task) -> bool {
    let is_one_of_several = |watched: &Watched| {
        let config = &watched.run.config;
        !config.further_tasks.is_empty() && config.tasks().any(|task| is_same_scene(task, &view.task))
    };
    is_same_scene(task, &view.task) || view.watched.as_ref().is_some_and(is_one_of_several)
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
        let (title, task, trace) = ("played by hand".to_owned(), view.hand.task.clone(), view.hand.trace.clone());
        Arc::new(Episode { title, task, trace, origin: Origin::Hand })
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

fn other_task(trained: &Task, edited: &Task) -> String {
    if trained.name == edited.name {
        format!("the run trains {} as it was before the edits", trained.name)
    } else {
        format!("the run trains {}", trained.name)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rand::SeedableRng;

    use super::*;
    use crate::agent::DdpgConfig;
    use crate::env::Environment;
    use crate::trainer::{PriorSource, Trace, observed};
    use crate::tui::testing::{empty, run_summary, typical};
    use crate::tui::view::Live;

    fn task(name: &str) -> Arc<Task> {
        Arc::new(crate::task::load(name).unwrap())
    }

    /// An episode of a run on a task.
    fn episode(run: &str, task: &Arc<Task>) -> Arc<Episode> {
        let shown = Episode::untouched(task);
        let trace = Trace { episode: 7, ..Trace::clone(&shown.trace) };
        let origin = Origin::Run(Path::new("runs").join(run));
        Arc::new(Episode { title: format!("episode 7 of {run}"), trace: Arc::new(trace), origin, ..shown })
    }

    fn watched(run: &str, task: &Arc<Task>, live: bool) -> Watched {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
        let observation = Environment::new(task.clone()).observation().len();
        let config = DdpgConfig { hidden: 4, ..DdpgConfig::default() };
        let networks = Arc::new(Ddpg::new(observation, 2, &config, &mut rng).unwrap());
        let live = live.then(|| Live { episode: episode(run, task), networks: Some(networks) });
        Watched { run: Arc::new(run_summary(run)), task: task.clone(), prior: None, live, agent: None, greedy: None }
    }

    fn model(task: &Arc<Task>) -> TaskModel {
        TaskModel::new(&PriorSource::TruePhysics, task).unwrap()
    }

    fn choose(view: &ViewModel, choice: Choice, before: Option<&Subject>) -> Subject {
        Subject::choose(view, &choice, before, false)
    }

    #[test]
    fn an_episode_of_another_task_is_shown_without_parts_of_the_edited_task() {
        let other = task("task4");
        let mut view = typical();
        view.watched = Some(watched("other", &other, false));
        let past = episode("other", &other);
        let mut subject = choose(&view, Choice::Past(past), None);
        assert_eq!(subject.task().name, "task4");
        assert!(subject.clusters().is_none(), "the session's clusters belong to the edited task");
        subject.set_model(Ok(model(&view.task)));
        assert!(subject.predict(0).unwrap_err().contains("another task"));
        subject.set_model(Ok(model(&subject.task().clone())));
        assert!(!subject.predict(0).unwrap().is_empty());
        let edited = choose(&view, Choice::Latest, Some(&subject));
        assert_eq!(edited.task().name, "task1");
        assert!(edited.predict(0).is_err(), "the model is not carried over");
        assert!(edited.clusters().is_some());
    }

    #[test]
    fn a_past_episode_is_left_when_another_run_is_watched() {
        let mut view = empty();
        let edited = view.task.clone();
        view.watched = Some(watched("a", &edited, false));
        let past = choose(&view, Choice::Past(episode("a", &edited)), None);
        assert!(past.is_of_run());
        view.watched = Some(watched("b", &edited, false));
        let after = choose(&view, past.choice().clone(), Some(&past));
        assert!(matches!(after.choice(), Choice::Latest) && !after.is_of_run());
        assert_eq!(after.run().unwrap().name, "b");
    }

    #[test]
    fn a_training_on_another_task_is_named_and_not_shown_in_the_edited_one() {
        let mut view = empty();
        view.watched = Some(watched("other", &task("task4"), true));
        let subject = choose(&view, Choice::Latest, None);
        assert_eq!(
            (subject.episode().origin.clone(), subject.note()),
            (Origin::Untouched, Some("the run trains task4"))
        );
        assert!(subject.agent_view(0).is_err());
        let mut edited = Task::clone(&view.task);
        view.watched = Some(watched("same", &view.task, true));
        assert!(choose(&view, Choice::Latest, None).agent_view(0).is_ok());
        edited.goal.position[0] += 0.1;
        view.task = Arc::new(edited);
        let subject = choose(&view, Choice::Latest, None);
        assert_eq!(subject.note(), Some("the run trains task1 as it was before the edits"));
        let renamed = Task { name: "mine".to_owned(), ..task("task1").as_ref().clone() };
        view.task = Arc::new(renamed);
        assert!(choose(&view, Choice::Latest, None).is_of_run(), "another name does not make another scene");
    }

    #[test]
    fn a_training_on_several_tasks_shows_each_of_them() {
        let mut view = empty();
        let mut watched = watched("several", &task("task4"), true);
        let run = Arc::make_mut(&mut watched.run);
        let config = Arc::make_mut(&mut run.config);
        config.further_tasks = vec![task("task4")];
        watched.task = view.task.clone();
        watched.prior = Some(Arc::new(ActionPrior::uniform(&view.task, 0)));
        view.prior = watched.prior.clone();
        view.watched = Some(watched);
        let subject = choose(&view, Choice::Latest, None);
        assert_eq!((subject.task().name.as_str(), subject.note()), ("task4", None));
        assert!(subject.is_of_run() && subject.clusters().is_none());
        let watched = view.watched.as_mut().unwrap();
        watched.live.as_mut().unwrap().episode = episode("several", &view.task.clone());
        let same = choose(&view, Choice::Latest, Some(&subject));
        assert!(Arc::ptr_eq(subject.episode(), same.episode()), "it is played to its end before the next");
        let next = Subject::choose(&view, &Choice::Latest, Some(&same), true);
        assert_eq!(next.task().name, view.task.name);
        // A task that is not trained is shown itself.
        view.task = task("task5");
        assert_eq!(choose(&view, Choice::Latest, None).task().name, "task5");
    }

    #[test]
    fn a_training_episode_is_played_to_its_end_before_the_next() {
        let mut view = empty();
        view.watched = Some(watched("a", &view.task.clone(), true));
        let first = choose(&view, Choice::Latest, None);
        view.watched = Some(watched("a", &view.task.clone(), true));
        let same = choose(&view, Choice::Latest, Some(&first));
        assert!(Arc::ptr_eq(first.episode(), same.episode()));
        let next = Subject::choose(&view, &Choice::Latest, Some(&same), true);
        assert!(!Arc::ptr_eq(same.episode(), next.episode()));
    }

    #[test]
    fn the_heat_map_starts_at_the_upper_left() {
        let mut view = empty();
        let watched = watched("a", &view.task.clone(), true);
        let networks = watched.live.as_ref().unwrap().networks.clone().unwrap();
        view.watched = Some(watched);
        let heat = choose(&view, Choice::Latest, None).agent_view(0).unwrap().heat;
        let env = Environment::new(view.task.clone());
        let edge = 1.0 - 1.0 / heat.side as f32;
        let corners = networks.q_values(&observed(&networks, &env), &[-edge, edge, edge, -edge]);
        let [first, last] = [heat.values[0], heat.values[heat.values.len() - 1]];
        let near = (corners[0] - corners[1]).abs() / 1000.0;
        assert!((first - corners[0]).abs() < near && (last - corners[1]).abs() < near, "{first} {last} {corners:?}");
    }

    #[test]
    fn a_prediction_starts_at_its_action_and_needs_the_tasks_own_tool() {
        let mut view = empty();
        view.watched = Some(watched("a", &view.task.clone(), false));
        let past = episode("a", &view.task);
        let mut subject = choose(&view, Choice::Past(past.clone()), None);
        subject.set_model(Ok(model(&view.task)));
        assert_eq!(subject.truth(1)[0], past.trace.steps[1].path[0]);
        let is_near =
            |predicted: [f32; 2], seen: [f32; 2]| (0..2).all(|axis| (predicted[axis] - seen[axis]).abs() < 0.1);
        assert!(is_near(subject.predict(1).unwrap()[0], past.trace.steps[1].path[0]));
        let mut held = Episode::clone(&past);
        Arc::make_mut(&mut held.trace).tools = vec![371];
        let mut subject = choose(&view, Choice::Past(Arc::new(held)), None);
        subject.set_model(Ok(model(&view.task)));
        assert!(subject.predict(0).unwrap_err().contains("only the task's own tool"));
        let mut by_hand = choose(&view, Choice::Hand, None);
        by_hand.set_model(Ok(model(&view.task)));
        let predicted = |number| by_hand.ghost([0.9, -0.9], number).unwrap().predicted;
        assert!(!predicted(None).is_empty() && predicted(Some(371)).is_empty());
        let blocked = by_hand.ghost(view.task.ball.position, None).unwrap();
        assert!(blocked.refusal.is_some() && blocked.predicted.is_empty());
        let same = choose(&view, Choice::Hand, Some(&by_hand));
        assert!(Arc::ptr_eq(same.episode(), by_hand.episode()), "nothing has been placed since");
        view.hand.trace = Arc::new(Trace::clone(&past.trace));
        let next = choose(&view, Choice::Hand, Some(&by_hand));
        assert!(Arc::ptr_eq(&next.episode().trace, &view.hand.trace), "the episode has changed");
    }

    #[test]
    fn only_the_episodes_of_a_run_have_its_networks() {
        let mut view = empty();
        view.watched = Some(watched("a", &view.task.clone(), true));
        let latest = choose(&view, Choice::Latest, None);
        assert!(latest.networks().is_some() && latest.needed_agent().is_none());
        let untouched = choose(&view, Choice::Untouched, None);
        assert_eq!(untouched.agent_view(0), Err("no agent acts in this episode".to_owned()));
        assert!(untouched.networks().is_none() && untouched.needed_agent().is_none());
        let past = choose(&view, Choice::Past(episode("a", &view.task)), None);
        assert!(past.networks().is_none(), "those of the training are later ones");
        assert_eq!(past.needed_agent(), Some(7));
    }

    #[test]
    fn a_past_episode_has_the_clusters_of_the_run_and_keeps_the_one_beside_it() {
        let mut view = typical();
        let watched = view.watched.as_mut().unwrap();
        watched.prior = view.prior.clone();
        let past = Choice::Past(episode("task1-ddpg-mge-seed0", &view.task));
        let mut first = choose(&view, past.clone(), None);
        assert!(first.clusters().unwrap().of_run);
        let beside = Beside { run: "runs/old".into(), number: 7, episode: Err("none".to_owned()) };
        first.set_beside(Some(beside));
        let again = choose(&view, past, Some(&first));
        assert!(again.beside().is_some());
        let latest = choose(&view, Choice::Latest, Some(&again));
        assert!(latest.beside().is_none() && !latest.clusters().unwrap().of_run);
    }

    #[test]
    fn a_model_is_that_of_the_subjects_task() {
        let view = empty();
        let mut subject = choose(&view, Choice::Latest, None);
        assert!(subject.model().is_none());
        subject.set_model(Ok(model(&view.task)));
        assert!(choose(&view, Choice::Latest, Some(&subject)).model().is_some());
    }

    #[test]
    fn the_threshold_is_stated_only_for_past_episodes() {
        let mut view = typical();
        let past = episode("task1-ddpg-mge-seed0", &view.task);
        view.watched.as_mut().unwrap().live = Some(Live { episode: past.clone(), networks: None });
        assert!(choose(&view, Choice::Latest, None).facts().is_empty());
        assert_eq!(choose(&view, Choice::Past(past), None).facts(), ["epsilon 0.80"]);
    }
}
