//! What the scene shows, for each choice and state of the session.

use std::path::Path;

use rand::SeedableRng;

use super::*;
use crate::tui::testing::{empty, run_summary, typical};
use crate::tui::view::Live;
use mge_agent::DdpgConfig;
use mge_env::Environment;
use mge_trainer::{PriorSource, RunConfig, Trace};

fn task(name: &str) -> Arc<Task> {
    Arc::new(mge_task::load(name).unwrap())
}

/// An episode of a run on a task.
fn episode(run: &str, task: &Arc<Task>) -> Arc<Episode> {
    let shown = Episode::untouched(task);
    let trace = Trace { episode: 7, ..Trace::clone(&shown.trace) };
    let origin = Origin::Run(Path::new("runs").join(run));
    Arc::new(Episode { trace: Arc::new(trace), origin, ..shown })
}

fn watched(run: &str, task: &Arc<Task>, live: bool) -> Watched {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    let observation = Environment::new(task.clone()).observation().len();
    let config = DdpgConfig { hidden: 4, ..DdpgConfig::default() };
    let networks = Arc::new(Ddpg::new(observation, 2, &config, &mut rng).unwrap());
    let live = live.then(|| Live { episode: episode(run, task), networks: Some(networks) });
    let config = Arc::new(RunConfig::new(task.clone()));
    let run = Arc::new(RunSummary { config, ..run_summary(run) });
    Watched { run, prior: None, live, agent: None, greedy: None }
}

fn model(task: &Arc<Task>) -> TaskModel {
    TaskModel::new(&RunConfig { prior: PriorSource::TruePhysics, ..RunConfig::new(task.clone()) }).unwrap()
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
    assert_eq!(subject.task.name, "task4");
    assert!(subject.clusters.is_none(), "the session's clusters belong to the edited task");
    subject.set_model(Ok(model(&view.task)));
    assert!(subject.predict(0).unwrap_err().contains("another task"));
    subject.set_model(Ok(model(&subject.task.clone())));
    assert!(!subject.predict(0).unwrap().is_empty());
    let edited = choose(&view, Choice::Latest, Some(&subject));
    assert_eq!(edited.task.name, "task1");
    assert!(edited.predict(0).is_err(), "the model is not carried over");
    assert!(edited.clusters.is_some());
}

#[test]
fn a_past_episode_is_left_when_another_run_is_watched() {
    let mut view = empty();
    let edited = view.task.clone();
    view.watched = Some(watched("a", &edited, false));
    let past = choose(&view, Choice::Past(episode("a", &edited)), None);
    assert!(past.is_of_run());
    view.watched = Some(watched("b", &edited, false));
    let after = choose(&view, past.choice.clone(), Some(&past));
    assert!(matches!(after.choice, Choice::Latest) && !after.is_of_run());
    assert_eq!(after.run().unwrap().name, "b");
}

#[test]
fn a_training_on_another_task_is_named_and_not_shown_in_the_edited_one() {
    let mut view = empty();
    view.watched = Some(watched("other", &task("task4"), true));
    let subject = choose(&view, Choice::Latest, None);
    assert_eq!(
        (subject.episode.origin.clone(), subject.note.as_deref()),
        (Origin::Untouched, Some("the run trains task4, not the open task1"))
    );
    assert!(subject.agent_view(0).is_err());
    let mut edited = Task::clone(&view.task);
    view.watched = Some(watched("same", &view.task, true));
    assert!(choose(&view, Choice::Latest, None).agent_view(0).is_ok());
    edited.goal.position[0] += 0.1;
    view.task = Arc::new(edited);
    for (dirty, note) in
        [(true, "the run trains task1, not the edited task1"), (false, "the run trains task1, not the open task1")]
    {
        view.dirty = dirty;
        assert_eq!(choose(&view, Choice::Latest, None).note.as_deref(), Some(note));
    }
    let renamed = Task { name: "mine".to_owned(), ..task("task1").as_ref().clone() };
    view.task = Arc::new(renamed);
    assert!(choose(&view, Choice::Latest, None).is_of_run(), "another name does not make another scene");
}

#[test]
fn a_training_episode_is_played_to_its_end_before_the_next() {
    let mut view = empty();
    view.watched = Some(watched("a", &view.task.clone(), true));
    let first = choose(&view, Choice::Latest, None);
    view.watched = Some(watched("a", &view.task.clone(), true));
    let same = choose(&view, Choice::Latest, Some(&first));
    assert!(Arc::ptr_eq(&first.episode, &same.episode));
    let next = Subject::choose(&view, &Choice::Latest, Some(&same), true);
    assert!(!Arc::ptr_eq(&same.episode, &next.episode));
}

#[test]
fn the_heat_map_starts_at_the_upper_left() {
    let mut view = empty();
    let watched = watched("a", &view.task.clone(), true);
    let networks = watched.live.as_ref().unwrap().networks.clone().unwrap();
    view.watched = Some(watched);
    let heat = choose(&view, Choice::Latest, None).agent_view(0).unwrap().heat;
    let env = Environment::new(view.task.clone());
    let edge = 1.0 - 1.0 / heat.width() as f32;
    let corners = networks.q_values(&env.observation(), &[-edge, edge, edge, -edge]);
    let [first, last] = [heat[(0, 0)].0[0], heat[(heat.width() - 1, heat.height() - 1)].0[0]];
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
    let is_near = |predicted: [f32; 2], seen: [f32; 2]| (0..2).all(|axis| (predicted[axis] - seen[axis]).abs() < 0.1);
    assert!(is_near(subject.predict(1).unwrap()[0], past.trace.steps[1].path[0]));
    let mut held = Episode::clone(&past);
    Arc::make_mut(&mut held.trace).start.tools = vec![371];
    let mut subject = choose(&view, Choice::Past(Arc::new(held)), None);
    subject.set_model(Ok(model(&view.task)));
    assert!(subject.predict(0).unwrap_err().contains("only the task's own tool"));
    let mut by_hand = choose(&view, Choice::Hand, None);
    by_hand.set_model(Ok(model(&view.task)));
    assert!(!by_hand.ghost([0.9, -0.9]).unwrap().predicted.is_empty());
    let blocked = by_hand.ghost(view.task.ball.position).unwrap();
    assert!(blocked.refusal.is_some() && blocked.predicted.is_empty());
    let same = choose(&view, Choice::Hand, Some(&by_hand));
    assert!(Arc::ptr_eq(&same.episode, &by_hand.episode), "nothing has been placed since");
    view.hand.trace = Arc::new(Trace::clone(&past.trace));
    let next = choose(&view, Choice::Hand, Some(&by_hand));
    assert!(Arc::ptr_eq(&next.episode.trace, &view.hand.trace), "the episode has changed");
}

#[test]
fn only_the_episodes_of_a_run_have_its_networks() {
    let mut view = empty();
    view.watched = Some(watched("a", &view.task.clone(), true));
    let latest = choose(&view, Choice::Latest, None);
    assert!(latest.networks.is_some() && latest.needed_agent().is_none());
    let untouched = choose(&empty(), Choice::Latest, None);
    assert_eq!(untouched.agent_view(0), Err("no agent acts in this episode".to_owned()));
    assert!(untouched.networks.is_none() && untouched.needed_agent().is_none());
    let past = choose(&view, Choice::Past(episode("a", &view.task)), None);
    assert!(past.networks.is_none(), "those of the training are later ones");
    assert_eq!(past.needed_agent(), Some(7));
}

#[test]
fn a_past_episode_has_the_clusters_of_the_run() {
    let mut view = typical();
    let watched = view.watched.as_mut().unwrap();
    watched.prior = view.prior.clone();
    let past = Choice::Past(episode("task1-ddpg-mge-seed0", &view.task));
    let first = choose(&view, past, None);
    assert!(first.clusters.as_ref().unwrap().of_run);
    assert!(!choose(&view, Choice::Latest, Some(&first)).clusters.unwrap().of_run);
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
