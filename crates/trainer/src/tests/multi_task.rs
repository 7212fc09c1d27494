//! Runs on several tasks.

use super::*;

/// A short training on three tasks with different numbers of stages.
fn several(method: Method, episodes: u32) -> RunConfig {
    let config = config(method, episodes).with_setting("more_tasks", "task2, task5").unwrap();
    assert_eq!(config.tasks().map(|task| &*task.name).collect::<Vec<_>>(), ["task1", "task2", "task5"]);
    config
}

/// The configuration with a last task whose ball falls into the goal by itself.
fn with_easy_task(mut config: RunConfig) -> RunConfig {
    let easy = Arc::make_mut(config.further_tasks.last_mut().unwrap());
    easy.subgoals.clear();
    easy.tools.clear();
    let [x, y] = easy.ball.position;
    easy.goal.position = [x, y - 0.3];
    config
}

#[test]
fn a_resumed_run_on_several_tasks_equals_an_uninterrupted_one() {
    let mut config = several(Method::DdpgMgeAdaptive, 14);
    // Mostly greedy, so that every task has attempts.
    config.epsilon = "need:0.1:0.1:20".parse().unwrap();
    config.evaluation = Evaluation { every: 2, episodes: 2, tools: None };
    config.refinement = Refinement { every: 2, least: 1, most: 5 };
    config.practice = Practice { rollouts: 30, enough: 2 };
    let whole = check_resumed(&config, 7);
    let progress: serde_json::Value = serde_json::from_slice(&whole["checkpoint/last/progress.json"]).unwrap();
    for further in 0..2 {
        let state = &progress["further"][further];
        assert_eq!(state["prior"]["task"], ["task2", "task5"][further]);
        assert!(!state["attempts"].as_array().unwrap().is_empty(), "task {further} was attempted");
    }
    assert_ne!(progress["further"][0]["prior"], progress["further"][1]["prior"]);
}

#[test]
fn tasks_are_played_in_turn_with_their_own_clusters_and_every_episode_can_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = several(Method::DdpgMge, 7);
    config.epsilon = "1".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let names = ["task1", "task2", "task5"];
    for record in RunHistory::read(&run).unwrap().records.iter() {
        let task = config.task_of(record.episode);
        assert_eq!(task.name, names[(record.episode as usize - 1) % 3]);
        assert_eq!(record.subgoals_total as usize, task.subgoals.len());
        let played = mge_run::read_episode(&run.episodes_path(), record.episode).unwrap();
        let trace = Trace::replay(task, &played);
        assert_eq!((trace.total_reward(), trace.steps.len() as u64), (record.return_, record.steps));
        assert!(trace.steps.iter().all(|step| step.source == Source::Clusters), "{}", task.name);
    }
    let priors = priors_at(&run.checkpoints().load(CheckpointName::Last).unwrap()).unwrap();
    assert_eq!(priors.iter().map(|prior| &*prior.task).collect::<Vec<_>>(), names);
}

#[test]
fn every_task_is_practised_and_evaluated() {
    let mut config = several(Method::DdpgMge, 30);
    config.practice = Practice { rollouts: 3, enough: 1 };
    config.evaluation = Evaluation { every: 1, episodes: 2, tools: None };
    let config = with_easy_task(config);
    let prior = |task: &Arc<Task>| Arc::new(ActionPrior::uniform(task, &GuidanceConfig::default(), 0));
    let mut training = Training::with_priors(config.clone(), config.tasks().map(prior).collect()).unwrap();
    let practised = training.practise().unwrap().unwrap();
    let least = config.tasks().count();
    assert!(practised.rollouts.len() >= least && practised.reached.last() > Some(&0), "{practised:?}");
    let mut found = Vec::new();
    for _ in 0..3 {
        training.run_episode().unwrap();
        let Event::Evaluated { success, .. } = training.evaluate(2).unwrap() else { panic!("an evaluation") };
        found.push(success);
    }
    // Tasks 2 and 0, then 1 and 2, then 0 and 1.
    assert_eq!(found, [0.5, 0.5, 0.0]);
}

#[test]
fn clusters_of_a_further_task_follow_its_own_actions() {
    let mut config = with_easy_task(several(Method::DdpgUniform, 30));
    config.epsilon = "1".parse().unwrap();
    config.refinement = Refinement { every: 1, least: 1, most: 5 };
    // No tool is needed in the easy task.
    config = config.with_setting("guidance.rewarding", "all").unwrap();
    let prior = |task: &Arc<Task>| Arc::new(ActionPrior::uniform(task, &GuidanceConfig::default(), 0));
    let mut training = Training::with_priors(config.clone(), config.tasks().map(prior).collect()).unwrap();
    for _ in 0..12 {
        training.run_episode().unwrap();
        let refined = training.refine().unwrap();
        // Only the clusters of the first task are shown.
        assert!(refined.is_none_or(|prior| prior.task == "task1"));
    }
    let priors = priors_at(&training.checkpoint().unwrap()).unwrap();
    assert!(!priors[2].stages[0].clusters.is_empty(), "the goal of the easy task was reached");
}

#[test]
fn every_task_is_refined_after_its_own_episodes() {
    let mut config = several(Method::DdpgMge, 300);
    config.refinement.every = 50;
    let refined =
        |config: &RunConfig| (0..=300).filter(|episode| config.is_refined_after(*episode)).collect::<Vec<_>>();
    assert_eq!(refined(&config), [0, 148, 298]);
    assert_eq!(refined(&config.on(&config.task)), [0, 50, 100, 150, 200, 250, 300]);
    config.refinement.every = 0;
    assert!(refined(&config).is_empty());
}

#[test]
fn a_new_training_adopts_the_networks_of_another() {
    let config = config(Method::Ddpg, 10).with_setting("observation", "rays").unwrap();
    let mut teacher = Training::new(config.clone(), None).unwrap();
    (0..10).for_each(|_| drop(teacher.run_episode().unwrap()));
    let other = RunConfig { seed: 8, ..config.on(&Arc::new(task::load("task4").unwrap())) };
    let mut pupil = Training::new(other, None).unwrap();
    let observation = vec![0.3; teacher.ddpg().observation_len()];
    assert_ne!(pupil.ddpg().act(&observation), teacher.ddpg().act(&observation));
    pupil.adopt(teacher.ddpg().clone()).unwrap();
    assert_eq!(pupil.ddpg().act(&observation), teacher.ddpg().act(&observation));
    let objects = RunConfig { observation: Observation::Objects, ..config.clone() };
    let outcome = Training::new(objects, None).unwrap().adopt(teacher.ddpg().clone());
    assert!(matches!(outcome, Err(TrainingError::OtherObservations)));
    let faster = config.with_setting("ddpg.tau", "0.5").unwrap();
    let outcome = Training::new(faster, None).unwrap().adopt(teacher.ddpg().clone());
    assert!(matches!(outcome, Err(TrainingError::OtherSettings(name)) if name == "ddpg"));
}

#[test]
fn a_fork_may_leave_the_further_tasks_but_not_exchange_them() {
    let folder = tempfile::tempdir().unwrap();
    let refined = |episodes| {
        let refinement = Refinement { every: 1, least: 1, most: 5 };
        RunConfig { refinement, epsilon: "1".parse().unwrap(), ..several(Method::DdpgMge, episodes) }
    };
    let run = new_run(folder.path(), "run", &refined(7));
    finish(&run);
    let before = refined(12);
    let fork_with = |name: &str, config: RunConfig| {
        let config = config.forked(&before, "run", 6, Vec::new());
        fork(&run, &folder.path().join(name), config, |_, _| (), &Stop::default())
    };
    let alone = fork_with("alone", before.on(&before.task)).unwrap();
    finish(&alone);
    let config: RunConfig = alone.config().unwrap();
    let names: Vec<&str> = (1..=8).map(|episode| &*config.task_of(episode).name).collect();
    assert_eq!(names, ["task1", "task2", "task5", "task1", "task2", "task5", "task1", "task1"]);
    let other = before.with_setting("more_tasks", "task3").unwrap();
    assert!(matches!(fork_with("other", other), Err(ForkError::Training(TrainingError::OtherTasks))));
}

#[test]
fn a_fork_of_a_fork_keeps_the_tasks_of_all_earlier_episodes_and_does_not_begin_before_its_source() {
    let folder = tempfile::tempdir().unwrap();
    let before = RunConfig { evaluation: Evaluation { every: 2, ..Evaluation::default() }, ..config(Method::Ddpg, 5) };
    let run = new_run(folder.path(), "run", &before);
    finish(&run);
    let fork_at = |source: &RunDirectory, episode: u32, name: &str| {
        let before: RunConfig = source.config().unwrap();
        let task = Arc::new(Task { name: name.to_owned(), ..(*before.task).clone() });
        let after = before.on(&task).forked(&before, "run", episode, Vec::new());
        fork(source, &folder.path().join(name), after, |_, _| (), &Stop::default())
    };
    let first = fork_at(&run, 4, "second").unwrap();
    let second: RunConfig = fork_at(&first, 4, "third").unwrap().config().unwrap();
    let names: Vec<&str> = (3..=5).map(|episode| &*second.task_of(episode).name).collect();
    assert_eq!(names, ["task1", "task1", "third"]);
    assert!(first.checkpoints().names().unwrap().contains(&CheckpointName::Best), "a checkpoint of the source");
    assert!(matches!(fork_at(&first, 3, "fourth"), Err(ForkError::TooEarly(3))));
}

#[test]
fn a_checkpoint_of_other_tasks_is_not_resumed() {
    let config = several(Method::DdpgMge, 7);
    let checkpoint = Training::new(config.clone(), None).unwrap().checkpoint().unwrap();
    assert!(Training::resume(config.clone(), &checkpoint).is_ok());
    let fewer = config.with_setting("more_tasks", "task2").unwrap();
    assert!(matches!(Training::resume(fewer, &checkpoint), Err(TrainingError::OtherSettings(_))));
}

#[test]
fn settings_that_several_tasks_cannot_share_are_refused() {
    let several = several(Method::DdpgMgeAdaptive, 7);
    assert_eq!((several.observation, several.hold_tolerance), (Observation::Rays, None));
    for (key, value, expected) in [
        ("observation", "objects", "observation: must be `rays` with `more_tasks`"),
        ("hold_tolerance", "0.1", "hold_tolerance: must be null with `more_tasks`"),
        ("method", "planning", "method: cannot be used with `more_tasks`"),
        ("more_tasks", "nothing.json", "nothing.json"),
        ("tools", "train", "observation: is `rays`, but an agent that chooses among `tools`"),
    ] {
        let error = several.with_setting(key, value).unwrap_err().to_string();
        assert!(error.contains(expected), "{key}: {error}");
    }
    let alone = several.with_setting("more_tasks", "").unwrap();
    assert!(alone.further_tasks.is_empty() && alone.observation == Observation::Rays);
    let broken = RunConfig { further_tasks: Vec::new(), ..several.clone() };
    assert_eq!(broken.validate().unwrap_err().path, "more_tasks");
    let broken = RunConfig { more_tasks: String::new(), ..several.clone() };
    assert_eq!(broken.validate().unwrap_err().path, "more_tasks");
    let twice = several.with_setting("more_tasks", "task2, task2").unwrap_err().to_string();
    assert!(twice.contains("further_tasks[1].name: is also the name of another task"), "{twice}");
    assert_eq!(several.evaluation.episodes, 3, "each evaluation plays every task");
    // Another method keeps the tasks, and the settings say where they come from.
    let other = several.with_method(Method::DdpgUniform);
    assert_eq!(other.further_tasks, several.further_tasks);
    let back = other.with_method(Method::DdpgMgeAdaptive);
    assert_eq!((back.observation, back.hold_tolerance), (Observation::Rays, None));
    assert!(non_default_settings(&other).contains(&("more_tasks".to_owned(), "task2, task5".to_owned())));
}
