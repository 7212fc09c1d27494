//! Runs that are stopped, paused, killed and resumed.

use super::*;

#[test]
fn a_stopped_and_resumed_run_equals_an_uninterrupted_one() {
    for method in Method::ALL {
        let folder = tempfile::tempdir().unwrap();
        let config = config(method, 12);
        let [whole, broken] = ["whole", "broken"].map(|name| new_run(folder.path(), name, &config));
        finish(&whole);
        stop_at(&broken, 5);
        assert_eq!(broken.status().unwrap().state, RunState::Stopped("a test".to_owned()));
        assert_eq!(finish(&broken), Ending::Finished);
        assert_eq!(metrics(&whole), metrics(&broken), "{method}");
        assert_eq!(networks(&whole), networks(&broken), "{method}");
    }
}

#[test]
fn all_files_of_a_resumed_run_equal_those_of_an_uninterrupted_one() {
    let mut config = config(Method::DdpgMge, 12);
    let mut task = task::load("task1").unwrap();
    // Random starts, so that evaluations draw from their stream.
    task.rules.start_noise = 0.05;
    config.task = Arc::new(task);
    config.epsilon = "linear:1:0.5:12".parse().unwrap();
    config.evaluation = Evaluation { every: 2, episodes: 2 };
    config.refinement = Refinement { every: 6, least: 1, most: 5 };
    config.practice = Practice { rollouts: 30, enough: 2 };
    config.checkpoints.periodic_every = 4;
    let whole = check_resumed(&config, 5);
    let progress = String::from_utf8_lossy(&whole["checkpoint/last/progress.json"]);
    assert!(progress.contains("\"rewarding\":[[["), "nothing to refine from was kept: the test shows nothing");
}

#[test]
fn a_run_that_ends_at_its_success_is_the_beginning_of_a_longer_one() {
    let folder = tempfile::tempdir().unwrap();
    let long = config(Method::OpenLoop, 150);
    let mut short = long.clone();
    short.stop.success = Some(0.9);
    let [whole, ended] = [("whole", &long), ("ended", &short)].map(|(name, config)| {
        let run = new_run(folder.path(), name, config);
        assert_eq!(finish(&run), Ending::Finished);
        run
    });
    let records = |run| RunHistory::read(run).unwrap().records;
    let (all, first) = (records(&whole), records(&ended));
    let solved = all.iter().position(|record| record.episode >= 100 && record.rolling_success >= 0.9).unwrap();
    assert!(solved < 140 && first[..] == all[..=solved], "{solved}, {}", first.len());
    assert_eq!(ended.status().unwrap().state, RunState::Finished);
    // It is finished, until it is given all its episodes.
    assert_eq!(finish(&ended), Ending::Finished);
    assert_eq!(records(&ended), first);
    assert!(short.extends_to(150) && !short.extends_to(149) && !short.has_more(first.len() as u64));
    ended.replace_config(&short.extended(150)).unwrap();
    assert_eq!(finish(&ended), Ending::Finished);
    assert_eq!((metrics(&ended), networks(&ended)), (metrics(&whole), networks(&whole)));
}

#[test]
fn a_run_that_trains_its_model_is_the_same_after_a_stop_in_each_phase() {
    let mut config = config(Method::DdpgMgeAdaptive, 6);
    config.prior = PriorSource::default();
    config.model = TaskModelConfig { launches: 4, epochs: 150 };
    config.guidance.most_model_rollouts = 200;
    config.practice = Practice { rollouts: 50, enough: 50 };
    // No run finds the model in the cache.
    config.seed = std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
    let folder = tempfile::tempdir().unwrap();
    let broken = new_run(folder.path(), "broken", &config);
    let phases: [fn(&Phase) -> bool; 2] =
        [|phase| matches!(phase, Phase::TrainingModel { .. }), |phase| matches!(phase, Phase::Practising { .. })];
    for wanted in phases {
        let trainer = Trainer::spawn(broken.clone(), []).unwrap();
        while !wanted(&trainer.watch.phase()) {
            assert!(trainer.is_active(), "it ended before the phase: {:?}", broken.status());
            std::thread::sleep(Duration::from_millis(1));
        }
        trainer.send(Control::Stop { reason: "a test".to_owned() });
        assert_eq!(trainer.join(), Ok(Ending::Stopped));
        assert_eq!(broken.status().unwrap().last_episode, None);
    }
    stop_at(&broken, 3);
    finish(&broken);
    let whole = new_run(folder.path(), "whole", &config);
    finish(&whole);
    assert_eq!(lasting(&whole), lasting(&broken));
    // The run is continued with its own copy, whatever is in the cache.
    let copy = std::fs::read(whole.model_path()).unwrap();
    assert_eq!(Model::from_bytes(&copy, "").unwrap().provenance.training.observations, 4);
    let read = RunConfig::of(&whole).unwrap();
    assert_eq!(read, config);
    assert!(read.trains_as(&config));
}

#[test]
fn a_resumed_run_does_not_replace_a_better_best() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::Ddpg, 12));
    stop_at(&run, 5);
    let manifest = run.checkpoints().path(CheckpointName::Best).join("manifest.json");
    let mut best: serde_json::Value = serde_json::from_slice(&std::fs::read(&manifest).unwrap()).unwrap();
    best["score"] = 1000.0.into();
    std::fs::write(&manifest, best.to_string()).unwrap();
    finish(&run);
    assert_eq!(run.checkpoints().best_score().unwrap(), Some(1000.0));
    assert_eq!(run.checkpoints().load(CheckpointName::Best).unwrap().episode, 4);
}

#[test]
fn a_resumed_run_keeps_the_schedule_and_clusters_set_during_training() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 8);
    config.epsilon = "1".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    let given = Arc::new(ActionPrior::uniform(&config.task, &GuidanceConfig::default(), 77));
    let schedule = Control::SetSchedule { schedule: "step:0.8:0.5:4".parse().unwrap() };
    let first = [schedule, Control::SetPrior(given.clone()), Control::PauseAt(3)];
    let trainer = Trainer::spawn(run.clone(), first).unwrap();
    wait_for_pause(&trainer);
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    trainer.join().unwrap();
    assert_eq!(saved_prior(&run, &config.task).unwrap().as_ref(), Some(&*given));
    // As if other clusters had been set after the checkpoint.
    std::fs::write(run.prior_path(), ActionPrior::uniform(&config.task, &GuidanceConfig::default(), 78).to_json())
        .unwrap();
    finish(&run);
    let records = RunHistory::read(&run).unwrap().records;
    let epsilons: Vec<f32> = records.iter().map(|record| record.epsilon).collect();
    assert_eq!(epsilons, [0.8, 0.8, 0.8, 0.8, 0.4, 0.4, 0.4, 0.4]);
    assert_eq!(saved_prior(&run, &config.task).unwrap().as_ref(), Some(&*given));
}

#[test]
fn a_stop_while_clusters_are_built_takes_effect_and_the_run_starts_over() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::DdpgMge, 3);
    let [whole, stopped] = ["whole", "stopped"].map(|name| new_run(folder.path(), name, &config));
    finish(&whole);
    let (sender, controls) = unbounded();
    sender.send(Control::Stop { reason: "a test".to_owned() }).unwrap();
    assert_eq!(train(&stopped, &controls, &Watch::default()).unwrap(), Ending::Stopped);
    assert_eq!(stopped.status().unwrap().state, RunState::Stopped("a test".to_owned()));
    assert!(!stopped.prior_path().exists(), "the clusters were built in spite of the stop");
    finish(&stopped);
    assert_eq!(lasting(&whole), lasting(&stopped));
}

#[test]
fn a_killed_run_continues_from_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::Ddpg, 10);
    let [whole, killed] = ["whole", "killed"].map(|name| new_run(folder.path(), name, &config));
    finish(&whole);
    finish(&killed);
    // As after a kill in episode 8: the log continues beyond the checkpoint of episode 6.
    let mut training = Training::new(config, None).unwrap();
    (0..6).for_each(|_| drop(training.run_episode().unwrap()));
    training.evaluate(1).unwrap();
    std::fs::remove_dir_all(killed.path().join("checkpoint")).unwrap();
    killed.checkpoints().save(&[CheckpointName::Last], None, &training.checkpoint().unwrap()).unwrap();
    let log = std::fs::read_to_string(killed.events_path()).unwrap();
    let cut = log.find("\"episode\":8").unwrap();
    std::fs::write(killed.events_path(), &log[..cut]).unwrap();
    stop_at(&killed, 9);
    finish(&killed);
    assert_eq!(metrics(&whole), metrics(&killed));
}

#[test]
fn a_pause_is_recorded_once_until_the_run_resumes() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::Ddpg, 3));
    let trainer = Trainer::spawn(run.clone(), [Control::Pause, Control::Pause]).unwrap();
    wait_for_pause(&trainer);
    assert_eq!(trainer.watch.episode(), 0);
    trainer.send(Control::Pause);
    trainer.send(Control::Resume);
    assert_eq!(trainer.join(), Ok(Ending::Finished));
    let events = read_events(&run.events_path()).unwrap();
    let count = |wanted: fn(&Event) -> bool| events.iter().filter(|logged| wanted(&logged.event)).count();
    assert_eq!(count(|event| matches!(event, Event::Paused { episode: 0 })), 1);
    assert_eq!(count(|event| matches!(event, Event::Resumed { episode: 0 })), 1);
}

#[test]
fn clusters_are_recorded_for_a_new_run_but_not_again_for_a_resumed_one() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::DdpgMge, 6));
    let trainer = Trainer::spawn(run.clone(), [Control::PauseAt(4)]).unwrap();
    wait_for_pause(&trainer);
    assert_eq!(trainer.watch.episode(), 4);
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    trainer.join().unwrap();
    finish(&run);
    let events = read_events(&run.events_path()).unwrap();
    let changes = events.iter().filter_map(|logged| match logged.event {
        Event::ClustersChanged { episode, .. } => Some(episode),
        _ => None,
    });
    assert_eq!(changes.collect::<Vec<_>>(), [0]);
}

#[test]
fn a_checkpoint_with_other_settings_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::Ddpg, 4);
    let run = new_run(folder.path(), "run", &config);
    let (_sender, controls) = unbounded();
    train(&run, &controls, &Watch::default()).unwrap();
    let text = std::fs::read_to_string(run.config_path()).unwrap();
    let gamma = format!("\"gamma\": {}", config.ddpg.gamma);
    let seed = format!("\"seed\": {}", config.seed);
    for (name, written, changed) in [("ddpg.gamma", gamma, "\"gamma\": 0.5"), ("seed", seed, "\"seed\": 99")] {
        assert!(text.contains(&written), "{text}");
        std::fs::write(run.config_path(), text.replace(&written, changed)).unwrap();
        let error = train(&run, &controls, &Watch::default()).unwrap_err().to_string();
        assert!(error.contains(&format!("began with another `{name}`")), "{error}");
    }
}

#[test]
fn a_resumed_adaptive_run_equals_an_uninterrupted_one() {
    let mut config = config(Method::DdpgMgeAdaptive, 24);
    config.start_noise = Some(0.02);
    config.ddpg.replay_capacity = 1000;
    config.evaluation = Evaluation { every: 2, episodes: 2 };
    config.refinement = Refinement { every: 6, least: 1, most: 5 };
    let whole = check_resumed(&config, 9);
    let progress = String::from_utf8_lossy(&whole["checkpoint/last/progress.json"]);
    assert!(progress.contains("\"attempts\":[["), "there was no greedy attempt: the test shows nothing");
    let networks = String::from_utf8_lossy(&whole["checkpoint/last/learner.safetensors"]).replace('\\', "");
    assert!(networks.contains("\"by_stage\":[[["), "no segment reached its stage: the test shows nothing");
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
        let after = RunConfig { task, ..before.clone() }.forked(&before, "run", episode, Vec::new());
        fork(source, &folder.path().join(name), after, |_, _| (), &Stop::default())
    };
    let first = fork_at(&run, 4, "second").unwrap();
    let second: RunConfig = fork_at(&first, 4, "third").unwrap().config().unwrap();
    let names: Vec<&str> = (3..=5).map(|episode| &*second.task_of(episode).name).collect();
    assert_eq!(names, ["task1", "task1", "third"]);
    assert!(first.checkpoints().names().unwrap().contains(&CheckpointName::Best), "a checkpoint of the source");
    assert!(fork_at(&first, 3, "fourth").unwrap_err().to_string().contains("as early as episode 3"));
}
