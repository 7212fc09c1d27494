//! Complete trainings with small networks, and the files that they produce.

mod charges;
mod guidance;
mod resume;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::unbounded;

use super::*;
use mge_agent::ReplayBuffer;
use mge_base::stop::Stop;
use mge_dynamics::{Model, TaskModelConfig};
use mge_guidance::{ActionPrior, GuidanceConfig};
use mge_physics::ToolKind;
use mge_run::{CheckpointName, EpisodeRecord, Event, RunDirectory, RunHistory, RunState, read_events};
use mge_task::{self as task, Task};

fn config(method: Method, episodes: u32) -> RunConfig {
    let mut config = RunConfig::default_for(Arc::new(task::load("task1").unwrap()), method);
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
    let trainer = Trainer::spawn(directory.clone(), [Control::PauseAt(episode.into())]).unwrap();
    wait_for_pause(&trainer);
    assert_eq!(trainer.watch.episode(), u64::from(episode));
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    assert_eq!(trainer.join(), Ok(Ending::Stopped));
}

/// All files and training events of a run that do not depend on time or on the number of processes.
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

/// Trains a run without interruption and one that is stopped at `episode` and resumed, and checks that their results
/// are equal. Returns these.
fn check_resumed(config: &RunConfig, episode: u32) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken] = ["whole", "broken"].map(|name| new_run(folder.path(), name, config));
    finish(&whole);
    stop_at(&broken, episode);
    finish(&broken);
    let (whole, broken) = (lasting(&whole), lasting(&broken));
    assert_eq!(Vec::from_iter(whole.keys()), Vec::from_iter(broken.keys()));
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{}: {name} differs", config.method);
    }
    whole
}

#[test]
fn a_run_is_stopped_after_the_minutes_of_its_settings() {
    let folder = tempfile::tempdir().unwrap();
    let mut limited = config(Method::Ddpg, 1_000_000);
    limited.stop.minutes = Some(0.0);
    assert!(limited.validate().is_err(), "it would never make progress");
    limited.stop.minutes = Some(0.01);
    let run = new_run(folder.path(), "run", &limited);
    assert_eq!(finish(&run), Ending::Stopped);
    let reason = "after 0.01 minutes, as `stop.minutes` says".to_owned();
    let status = run.status().unwrap();
    assert_eq!(status.state, RunState::Stopped(reason.clone()));
    let done = status.last_episode.unwrap().episode;
    // A pause that lasts longer does not count.
    let run = new_run(folder.path(), "paused", &limited);
    let trainer = Trainer::spawn(run.clone(), Some(Control::PauseAt(1))).unwrap();
    wait_for_pause(&trainer);
    std::thread::sleep(Duration::from_millis(700));
    trainer.send(Control::Resume);
    assert_eq!(trainer.join(), Ok(Ending::Stopped));
    let status = run.status().unwrap();
    assert_eq!(status.state, RunState::Stopped(reason));
    assert!(status.last_episode.is_some_and(|last| last.episode > done / 10), "it was not stopped at once");
}

fn wait_for_pause(trainer: &Trainer) {
    while trainer.watch.phase() != Phase::Paused {
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
fn equal_seeds_give_equal_bytes_and_different_seeds_do_not() {
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
fn thresholds_and_noise_follow_the_episode() {
    let mut config = config(Method::DdpgMge, 6);
    config.epsilon = "linear:1:0:4".parse().unwrap();
    config.ddpg.ou.sigma = 0.4;
    config.noise_decay = NoiseDecay { final_scale: 0.1, share: 0.5 };
    let prior = Arc::new(ActionPrior::uniform(&config.task, &GuidanceConfig::default(), 0));
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

    for (from, to) in [(6, 7), (25, 40), (4000, 6007), (1_000_000, 9_999_999)] {
        let short = RunConfig { episodes: from, ..config.clone() };
        let long = short.clone().extended(to);
        assert_eq!(long.episodes, to);
        for episode in (0..to).step_by(to as usize / 7) {
            assert_eq!(
                short.noise_scale(episode),
                long.noise_scale(episode),
                "episode {episode} of a run extended from {from} to {to}"
            );
        }
    }
}

#[test]
fn a_truncated_episode_is_not_learned_as_terminated() {
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
fn the_saved_clusters_of_a_run_are_read_only_for_its_task() {
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
fn a_replayed_episode_keeps_the_source_of_each_action() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::Planning, 1);
    config.planner.rollouts = 20;
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let played = mge_run::read_episode(&run.episodes_path(), 1).unwrap();
    let trace = Trace::replay(&config.task, &played);
    assert!(!trace.steps.is_empty() && trace.steps.iter().all(|step| step.source == Source::Planner));
}

#[test]
fn a_new_schedule_applies_from_the_next_episode_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 6);
    config.epsilon = "1".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    let trainer = Trainer::spawn(run.clone(), [Control::PauseAt(3)]).unwrap();
    wait_for_pause(&trainer);
    trainer.send(Control::SetSchedule { schedule: "0".parse().unwrap() });
    trainer.send(Control::Resume);
    assert_eq!(trainer.join(), Ok(Ending::Finished));
    let records = RunHistory::read(&run).unwrap().records;
    let epsilons: Vec<f32> = records.iter().map(|record| record.epsilon).collect();
    assert_eq!(epsilons, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let events = read_events(&run.events_path()).unwrap();
    assert!(events.iter().any(|logged| matches!(logged.event, Event::ScheduleChanged { episode: 3, .. })));
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
fn the_start_noise_of_the_run_overrides_that_of_the_task() {
    for (of_task, of_run, expected) in
        [(0.0, Some(0.02), 0.02), (0.05, None, 0.05), (0.05, Some(0.01), 0.01), (0.05, Some(0.0), 0.0)]
    {
        let mut config = config(Method::Ddpg, 1);
        let mut task = Task::clone(&config.task);
        task.rules.start_noise = of_task;
        (config.task, config.start_noise) = (Arc::new(task), of_run);
        let mut training = Training::new(config, None).unwrap();
        let shifts: Vec<f32> = (0..200).flat_map(|_| training.run_episode().unwrap().1.start.shift).collect();
        let widest = shifts.iter().fold(0.0f32, |widest, shift| widest.max(shift.abs()));
        assert!(widest <= expected && widest >= 0.95 * expected, "{widest}, not {expected}");
    }
}

#[test]
fn default_settings_change_with_the_method_and_chosen_ones_stay() {
    let plain = config(Method::DdpgMge, 8).with_setting("ddpg.gamma", "0.9").unwrap();
    let adaptive = plain.with_setting("method", "ddpg-mge-adaptive").unwrap();
    assert_eq!((adaptive.ddpg.gamma, adaptive.episodes, adaptive.seed), (0.9, 8, 3));
    assert!(adaptive.ddpg.imitation.share > 0.0);
    assert_eq!(adaptive.with_method(Method::DdpgMge), plain);
    let settings = non_default_settings(&adaptive);
    assert!(settings.iter().all(|(key, _)| !key.starts_with("ddpg.imitation")), "{settings:?}");
    let again = settings.iter().fold(RunConfig::new(adaptive.task.clone()), |config, (key, value)| {
        config.with_unchecked_setting(key, value).unwrap()
    });
    assert_eq!(again, adaptive);
}
