//! Whole trainings on small networks: what a run leaves behind.

mod tools;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::unbounded;

use super::*;
use crate::agent::ReplayBuffer;
use crate::guidance::ActionPrior;
use crate::run::{CheckpointName, EpisodeRecord, Event, RunDirectory, RunState, read_events, read_metrics};
use crate::stop::Stop;
use crate::task::{self, Task};

fn config(method: Method, episodes: u32) -> RunConfig {
    let mut config = RunConfig::usual(Arc::new(task::load("task1").unwrap()), method);
    config.episodes = episodes;
    config.seed = 3;
    config.prior = PriorSource::TruePhysics;
    config.guidance.model_rollouts = 100;
    config.guidance.environment_rollouts = 20;
    config.ddpg.hidden = 8;
    config.ddpg.batch_size = 16;
    config.ddpg.warmup_steps = 30;
    config.ddpg.replay_capacity = 60;
    config.evaluation.every = 4;
    config.checkpoints.last_every = 3;
    config
}

fn new_run(folder: &Path, name: &str, config: &RunConfig) -> RunDirectory {
    RunDirectory::create(folder.join(name), config).unwrap()
}

fn finish(directory: &RunDirectory) -> Ending {
    let (_sender, controls) = unbounded();
    train(directory, &controls, &Watch::default()).unwrap()
}

/// Trains until the run has paused at `episode`, then stops it.
fn stop_at(directory: &RunDirectory, episode: u32) {
    let trainer = Trainer::spawn_with(directory.clone(), [Control::Advance(episode)]).unwrap();
    wait_for_pause(&trainer);
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    assert_eq!(trainer.join(), Ok(Ending::Stopped));
}

fn wait_for_pause(trainer: &Trainer) {
    while trainer.watch().phase() != Phase::Paused {
        assert!(trainer.is_active(), "the training ended before it paused");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn metrics(directory: &RunDirectory) -> Vec<u8> {
    std::fs::read(directory.metrics_path()).unwrap()
}

fn networks(directory: &RunDirectory) -> Vec<u8> {
    let checkpoint = directory.checkpoints().load(CheckpointName::Last).unwrap();
    checkpoint.section(NETWORKS_SECTION).unwrap().to_vec()
}

#[test]
fn one_seed_gives_the_same_bytes_and_another_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 8);
    let runs = ["a", "b"].map(|name| new_run(folder.path(), name, &config));
    config.seed += 1;
    let other = new_run(folder.path(), "c", &config);
    for run in [&runs[0], &runs[1], &other] {
        assert_eq!(finish(run), Ending::Finished);
    }
    assert_eq!(metrics(&runs[0]), metrics(&runs[1]));
    assert_eq!(networks(&runs[0]), networks(&runs[1]));
    assert_ne!(metrics(&runs[0]), metrics(&other));
}

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

/// Everything a run leaves that does not depend on when and by how many processes it was made.
fn lasting(directory: &RunDirectory) -> BTreeMap<String, Vec<u8>> {
    fn collect(folder: &Path, root: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root).unwrap().display().to_string();
            match name.as_str() {
                "events.jsonl" | "log.txt" | "lock" | "tensorboard" => {}
                _ if path.is_dir() => collect(&path, root, files),
                _ => _ = files.insert(name, std::fs::read(&path).unwrap()),
            }
        }
    }
    let mut files = BTreeMap::new();
    collect(directory.path(), directory.path(), &mut files);
    let of_training = |event: &Event| {
        matches!(
            event,
            Event::EpisodeFinished(_) | Event::Evaluated { .. } | Event::ClustersChanged { .. } | Event::Practised(_)
        )
    };
    let events = read_events(&directory.events_path()).unwrap().into_iter().map(|logged| logged.event);
    let events: Vec<Event> = events.filter(of_training).collect();
    files.insert("events".to_owned(), serde_json::to_vec(&events).unwrap());
    files
}

#[test]
fn everything_of_a_resumed_run_is_that_of_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 12);
    let mut task = task::load("task1").unwrap();
    // Starts that differ, so that evaluations draw from their stream.
    task.rules.start_noise = 0.05;
    config.task = Arc::new(task);
    config.epsilon = "linear:1:0.5:12".parse().unwrap();
    config.evaluation = Evaluation { every: 2, episodes: 2, tools: None };
    config.refinement = Refinement { every: 6, least: 1, most: 5 };
    config.practice = Practice { rollouts: 30, enough: 2 };
    config.checkpoints.periodic_every = 4;
    let [whole, broken] = ["whole", "broken"].map(|name| new_run(folder.path(), name, &config));
    finish(&whole);
    stop_at(&broken, 5);
    finish(&broken);
    let (whole, broken) = (lasting(&whole), lasting(&broken));
    assert_eq!(Vec::from_iter(whole.keys()), Vec::from_iter(broken.keys()));
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
    let progress = String::from_utf8_lossy(&whole["checkpoint/last/progress.json"]);
    assert!(progress.contains("\"rewarding\":[[["), "nothing to refine from was kept: the test shows nothing");
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
fn a_schedule_and_clusters_given_while_training_are_those_of_the_resumed_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 8);
    config.epsilon = "1".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    let given = Arc::new(ActionPrior::uniform(&config.task, 77));
    let schedule = Control::SetSchedule("step:0.8:0.5:4".parse().unwrap());
    let first = [schedule, Control::SetPrior(given.clone()), Control::Advance(3)];
    let trainer = Trainer::spawn_with(run.clone(), first).unwrap();
    wait_for_pause(&trainer);
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    trainer.join().unwrap();
    assert_eq!(saved_prior(&run, &config.task).unwrap().as_ref(), Some(&*given));
    // As if others had been given that no checkpoint knows.
    std::fs::write(run.prior_path(), ActionPrior::uniform(&config.task, 78).to_json()).unwrap();
    finish(&run);
    let records = read_metrics(&run.metrics_path()).unwrap();
    let epsilons: Vec<f32> = records.iter().map(|record| record.epsilon).collect();
    assert_eq!(epsilons, [0.8, 0.8, 0.8, 0.8, 0.4, 0.4, 0.4, 0.4]);
    assert_eq!(saved_prior(&run, &config.task).unwrap().as_ref(), Some(&*given));
}

#[test]
fn thresholds_and_noise_are_those_of_the_episode() {
    let mut config = config(Method::DdpgMge, 6);
    config.epsilon = "linear:1:0:4".parse().unwrap();
    config.ddpg.ou.sigma = 0.4;
    config.noise_decay = NoiseDecay { final_scale: 0.1, share: 0.5 };
    let prior = Arc::new(ActionPrior::uniform(&config.task, 0));
    let mut training = Training::new(config.clone(), Some(prior)).unwrap();
    let mut noise_used = Vec::new();
    let mut records = Vec::new();
    for _ in 0..6 {
        records.push(training.run_episode().unwrap().0);
        noise_used.push(training.noise_scale());
    }
    let of = |value: fn(&EpisodeRecord) -> f32| records.iter().map(value).collect::<Vec<f32>>();
    assert_eq!(of(|record| record.epsilon), [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]);
    let near = |found: Vec<f32>, expected: [f32; 6]| {
        assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6), "{found:?}");
    };
    near(of(|record| record.noise_sigma), [0.4, 0.8 / 3.0, 0.4 / 3.0, 0.04, 0.04, 0.04]);
    near(noise_used, [1.0, 2.0 / 3.0, 1.0 / 3.0, 0.1, 0.1, 0.1]);
}

#[test]
fn an_episode_that_is_cut_off_is_not_learned_as_an_end() {
    let last_of = |max_actions| {
        let mut config = config(Method::Ddpg, 1);
        let mut task = task::load("task1").unwrap();
        task.rules.max_actions = max_actions;
        config.task = Arc::new(task);
        let mut training = Training::new(config, None).unwrap();
        let (record, _) = training.run_episode().unwrap();
        let checkpoint = training.checkpoint().unwrap();
        let replay = ReplayBuffer::from_bytes(checkpoint.section("replay.bin").unwrap()).unwrap();
        let last = replay.get(replay.len() - 1).unwrap();
        (record, last.terminated)
    };
    let (record, terminated) = last_of(1);
    assert!(record.truncated && !record.terminated && !terminated, "{record:?}, stored as {terminated}");
    let (record, terminated) = last_of(100);
    assert!(!record.truncated && record.terminated && terminated, "{record:?}, stored as {terminated}");
}

#[test]
fn a_past_run_shows_its_clusters_unless_they_are_of_another_task() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::DdpgMge, 2);
    let run = new_run(folder.path(), "run", &config);
    assert_eq!(saved_prior(&run, &config.task).unwrap(), None);
    finish(&run);
    let prior = saved_prior(&run, &config.task).unwrap().unwrap();
    assert_eq!(prior.stages.len(), config.task.stage_count());
    let other = task::load("task4").unwrap();
    let error = saved_prior(&run, &other).unwrap_err().to_string();
    assert!(error.contains("prior.json: the action prior is for task1"), "{error}");
}

#[test]
fn a_replayed_episode_keeps_who_chose_each_action() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::Planning, 1);
    config.planner.rollouts = 20;
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let played = crate::run::read_episode(&run.episodes_path(), 1).unwrap();
    let trace = Trace::replay(&config.task, &played);
    assert!(!trace.steps.is_empty() && trace.steps.iter().all(|step| step.source == Source::Planner));
}

#[test]
fn a_stop_while_clusters_are_built_takes_effect_and_the_run_begins_again() {
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
fn a_killed_run_goes_on_from_its_checkpoint() {
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
    let save = crate::run::CheckpointAction::Save(CheckpointName::Last);
    killed.checkpoints().apply(&[save], &training.checkpoint().unwrap()).unwrap();
    let log = std::fs::read_to_string(killed.events_path()).unwrap();
    let cut = log.find("\"episode\":8").unwrap();
    std::fs::write(killed.events_path(), &log[..cut]).unwrap();
    finish(&killed);
    assert_eq!(metrics(&whole), metrics(&killed));
}

#[test]
fn clusters_are_used_by_the_methods_that_have_them() {
    let folder = tempfile::tempdir().unwrap();
    for method in Method::ALL {
        let mut config = config(method, 6);
        config.epsilon = "1".parse().unwrap();
        let run = new_run(folder.path(), method.name(), &config);
        finish(&run);
        let records = read_metrics(&run.metrics_path()).unwrap();
        let guided = method.has_clusters();
        // Open-loop replay repeats its first success.
        let first_goal = records.iter().position(|record| record.goal).filter(|_| method == Method::OpenLoop);
        let explored = first_goal.map_or(&records[..], |first| &records[..=first]);
        assert!(explored.iter().all(|record| record.guided == guided), "{method}");
        assert_eq!(run.path().join("prior.json").exists(), guided);
    }
}

#[test]
fn a_new_schedule_holds_from_the_next_episode_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 6);
    config.epsilon = "1".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    let trainer = Trainer::spawn_with(run.clone(), [Control::Advance(3)]).unwrap();
    wait_for_pause(&trainer);
    trainer.send(Control::SetSchedule("0".parse().unwrap()));
    trainer.send(Control::Resume);
    assert_eq!(trainer.join(), Ok(Ending::Finished));
    let records = read_metrics(&run.metrics_path()).unwrap();
    let epsilons: Vec<f32> = records.iter().map(|record| record.epsilon).collect();
    assert_eq!(epsilons, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let events = read_events(&run.events_path()).unwrap();
    assert!(events.iter().any(|logged| matches!(logged.event, Event::ScheduleChanged { episode: 3, .. })));
}

#[test]
fn a_pause_is_recorded_once_until_the_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::Ddpg, 3));
    let trainer = Trainer::spawn_with(run.clone(), [Control::Pause, Control::Pause]).unwrap();
    wait_for_pause(&trainer);
    assert_eq!(trainer.watch().episode(), 0);
    trainer.send(Control::Pause);
    trainer.send(Control::Resume);
    assert_eq!(trainer.join(), Ok(Ending::Finished));
    let events = read_events(&run.events_path()).unwrap();
    let count = |wanted: fn(&Event) -> bool| events.iter().filter(|logged| wanted(&logged.event)).count();
    assert_eq!(count(|event| matches!(event, Event::Paused { episode: 0 })), 1);
    assert_eq!(count(|event| matches!(event, Event::Resumed { episode: 0 })), 1);
}

#[test]
fn the_clusters_of_a_new_run_are_recorded_and_those_of_a_resumed_one_not_again() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::DdpgMge, 6));
    let trainer = Trainer::spawn_with(run.clone(), [Control::Advance(4)]).unwrap();
    wait_for_pause(&trainer);
    assert_eq!(trainer.watch().episode(), 4);
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
fn a_live_view_is_given_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let run = new_run(folder.path(), "run", &config(Method::Ddpg, 4));
    let (_sender, controls) = unbounded();
    let watch = Watch::default();
    watch.request();
    train(&run, &controls, &watch).unwrap();
    let view = watch.take().unwrap();
    assert_eq!(view.trace.episode, 1);
    assert!(view.trace.steps.iter().all(|step| step.path.len() == 40));
    assert!(watch.take().is_none());
}

#[test]
fn clusters_follow_the_agent_s_own_rewarding_actions() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 40);
    config.epsilon = "1".parse().unwrap();
    config.refinement = Refinement { every: 10, least: 3, most: 5 };
    let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap().unwrap());
    let mut training = Training::new(config.clone(), Some(prior.clone())).unwrap();
    let mut reached = vec![0; 2];
    for _ in 0..40 {
        let (record, _) = training.run_episode().unwrap();
        reached[0] += record.subgoals;
        if let Some(refined) = training.refine() {
            assert_eq!(training.episode() % 10, 0);
            assert_eq!(training.prior(), Some(&refined));
        }
    }
    assert!(reached[0] >= 3, "{reached:?}");
    let refined = training.prior().unwrap();
    assert_eq!(refined.stages[0].actions.len(), 5);
    assert_ne!(refined.stages[0].clusters, prior.stages[0].clusters);
    // The run records the change, and its file has the clusters in force.
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let saved = std::fs::read_to_string(run.path().join("prior.json")).unwrap();
    assert_eq!(saved, refined.to_json());
}

#[test]
fn clusters_follow_no_fewer_actions_than_asked_for() {
    let mut config = config(Method::DdpgMge, 20);
    config.epsilon = "1".parse().unwrap();
    let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap().unwrap());
    for (least, expected) in [(4, true), (1000, false)] {
        config.refinement = Refinement { every: 1, least, most: least };
        let mut training = Training::new(config.clone(), Some(prior.clone())).unwrap();
        let mut refined = 0;
        for _ in 0..20 {
            training.run_episode().unwrap();
            if let Some(now) = training.refine() {
                refined += 1;
                let changed = now.stages.iter().zip(&prior.stages).filter(|(now, built)| now.actions != built.actions);
                changed.for_each(|(stage, _)| assert_eq!(stage.actions.len(), least));
            }
        }
        assert_eq!(refined > 0, expected, "{least}");
    }
}

#[test]
fn guidance_is_drawn_anew_as_often_as_asked_for() {
    // Changes between clusters and policy, directly after a subgoal and elsewhere.
    let changes = |granularity| {
        let mut config = config(Method::DdpgMge, 30);
        config.epsilon = "0.7".parse().unwrap();
        config.granularity = granularity;
        let prior = build_prior(&config, |_| (), &Stop::default()).unwrap().map(Arc::new);
        let mut training = Training::new(config, prior).unwrap();
        let mut changes = [0, 0];
        for _ in 0..30 {
            let (_, trace) = training.run_episode().unwrap();
            for pair in trace.steps.windows(2).filter(|pair| pair[0].source != pair[1].source) {
                changes[usize::from(pair[0].subgoals.is_empty())] += 1;
            }
        }
        changes
    };
    assert_eq!(changes(Granularity::Episode), [0, 0]);
    let [after_a_subgoal, elsewhere] = changes(Granularity::Stage);
    assert!(after_a_subgoal > 0 && elsewhere == 0, "{after_a_subgoal} {elsewhere}");
    assert!(changes(Granularity::Step)[1] > 0);
}

#[test]
fn plans_through_the_true_physics_reach_the_subgoal() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::Planning, 4);
    config.planner.rollouts = 100;
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let records = read_metrics(&run.metrics_path()).unwrap();
    assert!(records.iter().map(|record| record.subgoals).sum::<u32>() >= 3, "{records:?}");
    assert!(records.iter().all(|record| record.critic_loss.is_none()), "nothing is learned");
}

#[test]
fn imagined_transitions_enter_the_replay_buffer_beside_the_real_ones() {
    let mut training = Training::new(config(Method::ModelReplay, 3), None).unwrap();
    let (record, _) = training.run_episode().unwrap();
    let imagined = training.transitions() - record.steps;
    let ModelReplay { rollouts, horizon } = training.config().model_replay;
    assert!(imagined >= rollouts as u64 && imagined <= (rollouts * horizon) as u64, "{imagined}");
}

#[test]
fn a_method_that_predicts_needs_a_model() {
    for method in [Method::Planning, Method::ModelReplay] {
        let mut config = config(method, 3);
        config.prior = PriorSource::Uniform;
        let error = Training::new(config, None).unwrap_err().to_string();
        assert!(error.contains("needs a model"), "{error}");
    }
}

#[test]
fn a_shipped_model_is_chosen_by_its_name() {
    let task = crate::task::load("task1").unwrap();
    let named = rollout_model(&PriorSource::from("bucket-box".to_owned()), &task).unwrap().unwrap();
    let usual = rollout_model(&PriorSource::Learned, &task).unwrap().unwrap();
    assert_eq!(named.1, usual.1);
}

#[test]
fn a_checkpoint_of_other_settings_is_not_continued() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::Ddpg, 4);
    let run = new_run(folder.path(), "run", &config);
    let (_sender, controls) = unbounded();
    train(&run, &controls, &Watch::default()).unwrap();
    let text = std::fs::read_to_string(run.config_path()).unwrap();
    let gamma = format!("\"gamma\": {}", config.ddpg.gamma);
    assert!(text.contains(&gamma), "{text}");
    std::fs::write(run.config_path(), text.replace(&gamma, "\"gamma\": 0.5")).unwrap();
    let error = train(&run, &controls, &Watch::default()).unwrap_err().to_string();
    assert!(error.contains("other settings of `ddpg`"), "{error}");
}

#[test]
fn a_missing_model_fails_the_run_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 4);
    config.prior = PriorSource::ModelFile("nowhere.safetensors".to_owned());
    let run = new_run(folder.path(), "run", &config);
    let (_sender, controls) = unbounded();
    let error = train(&run, &controls, &Watch::default()).unwrap_err().to_string();
    assert!(error.contains("nowhere.safetensors"), "{error}");
    assert_eq!(run.status().unwrap().state, RunState::Failed(error));
}

#[test]
fn a_resumed_adaptive_run_is_that_of_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMgeAdaptive, 24);
    config.start_noise = Some(0.02);
    config.ddpg.replay_capacity = 1000;
    config.evaluation = Evaluation { every: 2, episodes: 2, tools: None };
    config.refinement = Refinement { every: 6, least: 1, most: 5 };
    let [whole, broken] = ["whole", "broken"].map(|name| new_run(folder.path(), name, &config));
    finish(&whole);
    stop_at(&broken, 9);
    finish(&broken);
    let (whole, broken) = (lasting(&whole), lasting(&broken));
    assert_eq!(Vec::from_iter(whole.keys()), Vec::from_iter(broken.keys()));
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
    let progress = String::from_utf8_lossy(&whole["checkpoint/last/progress.json"]);
    assert!(progress.contains("\"attempts\":[["), "there was no greedy attempt: the test shows nothing");
    let networks = String::from_utf8_lossy(&whole["checkpoint/last/learner.safetensors"]).replace('\\', "");
    assert!(networks.contains("\"by_stage\":[[["), "no segment reached its stage: the test shows nothing");
}

#[test]
fn the_log_has_the_needs_of_every_stage() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(Method::DdpgMgeAdaptive, 20);
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let events = read_events(&run.events_path()).unwrap();
    let needs: Vec<(u64, Vec<f32>)> = events
        .into_iter()
        .filter_map(|logged| match logged.event {
            Event::NeedsChanged { episode, needs } => Some((episode, needs)),
            _ => None,
        })
        .collect();
    assert_eq!(needs[0], (0, vec![1.0, 1.0]));
    assert!(needs.windows(2).all(|pair| pair[0].1 != pair[1].1), "{needs:?}");
    let history = crate::run::RunHistory::read(&run).unwrap();
    assert_eq!(history.needs, needs.last().unwrap().1);
    // Clusters are drawn by half of the mean need before the episode.
    for record in history.records.iter() {
        let (_, before) = needs.iter().rev().find(|(episode, _)| *episode < record.episode).unwrap();
        assert!((record.epsilon - 0.25 * (before[0] + before[1])).abs() < 1e-6, "{record:?}, {before:?}");
    }
}

#[test]
fn the_start_noise_of_the_run_goes_before_that_of_the_task() {
    for (of_task, of_run, expected) in
        [(0.0, Some(0.02), 0.02), (0.05, None, 0.05), (0.05, Some(0.01), 0.01), (0.05, Some(0.0), 0.0)]
    {
        let mut config = config(Method::Ddpg, 1);
        let mut task = Task::clone(&config.task);
        task.rules.start_noise = of_task;
        (config.task, config.start_noise) = (Arc::new(task), of_run);
        let mut training = Training::new(config, None).unwrap();
        let shifts: Vec<f32> = (0..200).flat_map(|_| training.run_episode().unwrap().1.shift).collect();
        let widest = shifts.iter().fold(0.0f32, |widest, shift| widest.max(shift.abs()));
        assert!(widest <= expected && widest >= 0.95 * expected, "{widest}, not {expected}");
    }
}

#[test]
fn the_first_success_is_repeated() {
    let mut config = config(Method::OpenLoop, 60);
    config.guidance.model_rollouts = 300;
    let prior = build_prior(&config, |_| (), &Stop::default()).unwrap().map(Arc::new);
    let mut training = Training::new(config, prior).unwrap();
    let episodes: Vec<(EpisodeRecord, Trace)> = (0..60).map(|_| training.run_episode().unwrap()).collect();
    let first = episodes.iter().position(|(record, _)| record.goal).unwrap();
    assert!(first < 50, "no success in time to repeat it");
    let actions = |trace: &Trace| trace.steps.iter().map(|step| step.action).collect::<Vec<_>>();
    for (record, trace) in &episodes[first + 1..] {
        assert!(record.goal && !record.guided && trace.steps.iter().all(|step| step.source == Source::Recorded));
        assert_eq!(actions(trace), actions(&episodes[first].1));
    }
}

#[test]
fn the_usual_settings_of_a_method_go_with_it_and_chosen_ones_stay() {
    let plain = config(Method::DdpgMge, 8).with_setting("ddpg.gamma", "0.9").unwrap();
    let adaptive = plain.with_setting("method", "ddpg-mge-adaptive").unwrap();
    assert_eq!((adaptive.ddpg.gamma, adaptive.episodes, adaptive.seed), (0.9, 8, 3));
    assert!(adaptive.ddpg.imitation.share > 0.0);
    assert_eq!(adaptive.with_method(Method::DdpgMge), plain);
    let unusual = unusual_settings(&adaptive);
    assert!(unusual.iter().all(|(key, _)| !key.starts_with("ddpg.imitation")), "{unusual:?}");
    let again = unusual.iter().fold(RunConfig::new(adaptive.task.clone()), |config, (key, value)| {
        config.with_unchecked_setting(key, value).unwrap()
    });
    assert_eq!(again, adaptive);
}
