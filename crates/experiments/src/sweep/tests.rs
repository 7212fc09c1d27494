//! Sweeps from the file to the table: expansion, training, results and collection.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use serde_json::{Value, json};

use super::results::{Results, readable_results};
use super::*;
use crate::error::Result;
use mge_base::stop::Stop;
use mge_dynamics::{ModelConfig, TrainConfig};
use mge_run::{RunDirectory, RunState};
use mge_trainer::batch::{Batch, BatchProgress, JobHandle};
use mge_trainer::{Control, Phase, Trainer};

/// Settings of agents that train quickly.
fn small(more: &Value) -> Value {
    let mut file = json!({
        "task": ["task1"], "method": ["ddpg", "ddpg-mge"], "epsilon": [0.2, "linear:0.5:0:8"], "model": "true",
        "seed": [0, 1], "episodes": 8, "ddpg.hidden": 8, "ddpg.warmup_steps": 30, "ddpg.replay_capacity": 60,
        "guidance.model_rollouts": 50, "guidance.environment_rollouts": 10, "checkpoints.last_every": 3
    });
    for (key, value) in more.as_object().unwrap() {
        file[key] = value.clone();
    }
    file
}

fn sweep(file: &Value) -> Sweep {
    Sweep::parse(file.to_string().as_bytes(), "sweep.json").unwrap()
}

fn names(sweep: &Sweep) -> Vec<&str> {
    sweep.jobs.iter().map(|job| job.name.as_str()).collect()
}

fn finish(sweep: &Sweep, folder: &Path) -> Vec<(String, String)> {
    run_sweep(sweep, folder, &mut |_| {}).unwrap()
}

fn run_sweep(
    sweep: &Sweep,
    folder: &Path,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Vec<(String, String)>> {
    let interrupt = Stop::default();
    run(sweep, folder, &mut Batch { threads: 2, interrupt: &interrupt, on_progress })
}

fn read_results(folder: &Path) -> Results {
    let (results, damaged) = readable_results(folder).unwrap();
    assert!(damaged.is_none(), "{damaged:?}");
    results
}

fn metrics(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join("runs").join(name).join("metrics.csv")).unwrap()
}

#[test]
fn a_file_expands_to_all_combinations_with_the_baseline_once() {
    let sweep = sweep(&small(&json!({"seed": [0]})));
    let expected = ["task1-ddpg-seed0", "task1-ddpg-mge-0.2-seed0", "task1-ddpg-mge-linear_0.5_0_8-seed0"];
    assert_eq!(names(&sweep), expected);
    let Work::Train(config) = &sweep.jobs[1].work else { panic!("an agent") };
    assert_eq!((config.epsilon.to_string().as_str(), config.ddpg.hidden), ("0.2", 8));
    let two = json!([{"task": "task1", "ddpg.gamma": [0.7, 0.8]}, {"task": ["task1", "task2"]}]);
    let usual = "task1-ddpg-mge-adaptive-ddpg.gamma";
    let expected = [format!("{usual}_0.7-seed0"), format!("{usual}_0.8-seed0")];
    assert_eq!(names(&self::sweep(&two))[..2], expected);
    assert_eq!(self::sweep(&two).jobs.len(), 4);
    let marked = format!("\u{feff}{two}");
    assert_eq!(Sweep::parse(marked.as_bytes(), "sweep.json").unwrap().jobs.len(), 4, "after a byte-order mark");
}

#[test]
fn combinations_that_differ_only_in_settings_without_effect_are_trained_once() {
    // No schedule depends on need, and all evaluations are later than the last episode.
    let idle = json!({"seed": [0], "hold_tolerance": [0.1, 0.2], "evaluation.every": [50, 5000]});
    assert_eq!(names(&sweep(&small(&idle))), names(&sweep(&small(&json!({"seed": [0]})))));
    let adaptive = json!({"task": "task1", "method": ["ddpg", "ddpg-adaptive"], "hold_tolerance": [0.1, 0.2]});
    let expected = [
        "task1-ddpg-seed0",
        "task1-ddpg-adaptive-hold_tolerance_0.1-seed0",
        "task1-ddpg-adaptive-hold_tolerance_0.2-seed0",
    ];
    assert_eq!(names(&sweep(&adaptive)), expected);
}

#[test]
fn ranges_include_both_ends_and_exclusions_leave_out_combinations() {
    let file = json!({"task": "task1", "method": ["ddpg", "planning"], "seed": ["9..10", 2], "exclude": [
        {"method": "ddpg", "seed": "10..12"}, {"seed": [2], "method": "planning"},
    ]});
    let expected = [("ddpg", 9), ("ddpg", 2), ("planning", 9), ("planning", 10)];
    assert_eq!(names(&sweep(&file)), expected.map(|(method, seed)| format!("task1-{method}-seed{seed}")));
    let jobs = sweep(&json!({"task": "task1", "method": "ddpg", "ddpg.hidden": "8..10"})).jobs;
    assert_eq!(jobs.len(), 3);
    assert_eq!(jobs[2].name, "task1-ddpg-ddpg.hidden_10-seed0");
}

#[test]
fn samples_are_drawn_for_all_settings_together_and_more_begin_with_the_same() {
    let sampled = |count: usize| {
        let text = format!(
            r#"{{"task": "task1", "method": "ddpg", "ddpg.gamma": {{"uniform": [0.9, 0.99]}}, "seed": "0..1",
                "ddpg.critic_learning_rate": {{"log_uniform": [1e-4, 1e-2]}}, "ddpg.hidden": {{"uniform": [8, 9]}},
                "samples": {{"count": {count}, "seed": 3}}}}"#
        );
        Sweep::parse(text.as_bytes(), "s.json").unwrap().jobs
    };
    let (few, many) = (sampled(8), sampled(20));
    assert_eq!((few.len(), many.len()), (2 * 8, 2 * 20));
    assert!(few.iter().all(|job| many.contains(job) && sweep(&job.alone).jobs == [job.clone()]));
    let config = |job: &Job| match &job.work {
        Work::Train(config) => config.ddpg.clone(),
        work => panic!("an agent: {work:?}"),
    };
    let drawn: Vec<_> = many.iter().map(config).collect();
    assert!(drawn.iter().all(|ddpg| (0.9..=0.99).contains(&ddpg.gamma) && [8, 9].contains(&ddpg.hidden)));
    assert_eq!(drawn.iter().filter(|ddpg| ddpg.hidden == 8).count() % 2, 0);
    assert!([8, 9].iter().all(|hidden| drawn.iter().any(|ddpg| ddpg.hidden == *hidden)));
    let low = drawn.iter().filter(|ddpg| ddpg.critic_learning_rate < 1e-3).count();
    assert!((10..=30).contains(&low), "half of them in the lower decade: {low} of 40");
}

#[test]
fn models_are_swept_by_the_names_of_their_settings() {
    let file = json!({"kind": "dynamics", "tools": "box,bucket", "learning_rate": [1e-3, 1e-4], "layers": [5, 17], "optimiser": "sgd"});
    let sweep = sweep(&file);
    assert_eq!(names(&sweep)[0], "bucket-box-learning_rate_0.001-layers_5-seed0");
    let Work::Dynamics(job) = &sweep.jobs[3].work else { panic!("a model") };
    assert_eq!((job.training.learning_rate, job.model.layers), (1e-4, 17));
    assert_eq!(job.training.optimiser, mge_nn::OptimiserKind::Sgd);
}

#[test]
fn a_job_alone_is_the_same_job() {
    for file in [small(&json!({})), json!({"kind": "dynamics", "tools": ["box"], "layers": [5, 17]})] {
        for job in sweep(&file).jobs {
            assert_eq!(sweep(&job.alone).jobs, [job]);
        }
    }
}

#[test]
fn tasks_of_a_slurm_array_run_several_jobs_if_there_are_too_many() {
    let seeds: Vec<usize> = (0..1001).collect();
    let mut sweep = sweep(&json!({"task": "task1", "seed": seeds, "method": "ddpg", "epsilon": 0.2}));
    for (count, tasks) in [(1001, 501), (1000, 1000)] {
        sweep.jobs.truncate(count);
        let script = slurm(&sweep, Path::new("/mge"), Path::new("/out"), "s").unwrap();
        assert!(script.contains(&format!("#SBATCH --array=0-{}\n", tasks - 1)));
        let commands: Vec<&str> = script.lines().filter(|line| line.starts_with("/mge sweep --one ")).collect();
        let alone = |line: &&str| Sweep::parse(shell_words::split(line).unwrap()[3].as_bytes(), "--one").unwrap().jobs;
        assert_eq!(commands.len(), tasks);
        for (command, jobs) in commands.iter().zip(sweep.jobs.chunks(count.div_ceil(tasks))).step_by(100) {
            assert_eq!(alone(command), jobs);
        }
    }
}

#[test]
fn shipped_sweeps_are_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sweeps");
    let count = |name: &str| Sweep::load(&folder.join(name)).unwrap().jobs.len();
    assert_eq!(count("model-ablation.json"), 4 * 3 * 5);
    assert_eq!(count("small.json"), 2 * 3 * 3);
    for file in std::fs::read_dir(&folder).unwrap() {
        let path = file.unwrap().path();
        // Those on the models of a study are parsed by the tests of studies.
        if path.is_file() && !std::fs::read_to_string(&path).unwrap().contains("\"study/") {
            assert!(!Sweep::load(&path).unwrap().jobs.is_empty(), "{}", path.display());
        }
    }
}

#[test]
fn mistakes_are_explained_before_any_work() {
    for (text, expected) in [
        (
            r#"{"task": "task1", "ddpg.gama": [0.9]}"#,
            "s.json:1: at ddpg.gama[0]: there is no setting `ddpg.gama`: did you mean `ddpg.gamma`?",
        ),
        ("{\"task\": [\"task1\",\n \"tsak2\"]}", "s.json:2: at task[1]: there is no task `tsak2`"),
        ("[{\"task\": \"task1\"},\n{\"task\": \"tsk2\"}]", "s.json:2: at [1].task: there is no task `tsk2`"),
        (r#"{"task": "task1", "method": ["ddgp"]}"#, "did you mean `ddpg`?"),
        (r#"{"task": ["task1", "task11"]}"#, "s.json:1: at task[1]: there is no task `task11`"),
        (r#"{"tasks": ["task1"]}"#, "at task: is missing"),
        (r#"{"seed": [1]}"#, "at task: is missing"),
        (r#"{"task": "task1", "ddpg.gamma": [0.9, 7]}"#, "at ddpg.gamma[1]: ddpg.gamma: is 7"),
        (r#"{"task": "task1", "epsilon": 2}"#, "at epsilon: "),
        (r#"{"task": "task1", "method": ["dqn"]}"#, "unknown method `dqn`"),
        (r#"{"task": "task1", "model": "nowhere.safetensors"}"#, "at model: nowhere.safetensors"),
        (r#"{"task": "task1", "seed": []}"#, "at seed: is an empty list"),
        (r#"{"task": "task1", "seed": [[1]]}"#, "at seed: must have values that are numbers"),
        ("{\"task\": \"task1\",\n \"seed\": [1,}", "s.json:2:"),
        (
            r#"[{"task": "task1"}, {"task": "task1", "sed": [1]}]"#,
            "at [1].sed[0]: there is no setting `sed`: did you mean `seed`?",
        ),
        (r#"{"task": "task1", "epsilon": 0.1, "threshold": [0.2]}"#, "at threshold: sets the same as `epsilon`"),
        ("[]", "at .: makes no run"),
        (r#"{"task": "task1", "exclude": {"task": "task1"}}"#, "at .: makes no run"),
        (r#"{"task": "task1", "exclude": {"sed": 1}}"#, "at exclude: the sweep does not set `sed`"),
        (r#"{"task": "task1", "seed": "3..1"}"#, "at seed: a range has a first and a last value"),
        (r#"{"task": "task1", "seed": "0..10000"}"#, "at most 10000 of them"),
        (r#"{"task": "task1", "ddpg.gamma": {"unifrm": [0, 1]}}"#, "at ddpg.gamma: unknown variant `unifrm`"),
        (r#"{"task": "task1", "ddpg.gamma": {"uniform": [0.9, 0.99]}}"#, "at samples: is missing"),
        (r#"{"task": "task1", "ddpg.gamma": {"log_uniform": [0, 1]}}"#, "of `log_uniform` positive ones"),
        (r#"{"task": "task1", "samples": {"count": 3}}"#, "at samples: no setting has samples"),
        ("3", "expected a map"),
        (
            r#"{"kind": "dynamic", "tools": "box"}"#,
            "at kind: must be `train`, `dynamics` or `hits`: did you mean `dynamics`?",
        ),
        (r#"{"kind": "dynamics", "tools": ["box", "bukket"]}"#, "at tools[1]: unknown tool `bukket`"),
        (
            r#"{"kind": "dynamics", "tools": "box", "layer": [3]}"#,
            "at layer[0]: there is no setting `layer` of a dynamics model: did you mean `layers`?",
        ),
        (
            r#"{"kind": "dynamics", "tools": "box", "layers": [0]}"#,
            "layers[0]: is 0, but must be a whole number from 1 to 64",
        ),
        (r#"{"kind": "dynamics", "layers": [5]}"#, "at tools: is missing"),
        (r#"{"kind": "dynamics", "tools": "box", "literal": 1}"#, "at literal: must be true or false"),
        (
            "[{\"task\": \"task1\", \"ddpg.gamma\": 0.9},\n {\"task\": \"task1\", \"ddpg.gamma\": 0.8}]",
            "s.json:2: at [1]: two different runs would be called `task1-ddpg-mge-adaptive-seed0`",
        ),
    ] {
        let error = Sweep::parse(text.as_bytes(), "s.json").unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with("s.json") && !error.contains('\n'), "{text}: {error}");
    }
    let grid = |seeds: u32| {
        let (seeds, episodes): (Vec<u32>, Vec<u32>) = ((0..seeds).collect(), (1..200).collect());
        json!({"task": "task1", "seed": seeds, "episodes": episodes})
    };
    for many in [grid(200), json!([grid(30), grid(30)])] {
        let error = Sweep::parse(many.to_string().as_bytes(), "s.json").unwrap_err().to_string();
        assert!(error.contains("more than 10000 combinations"), "{error}");
    }
}

#[test]
fn finished_runs_are_kept_interrupted_ones_continue_and_a_failure_stops_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken] = ["whole", "broken"].map(|name| folder.path().join(name));
    let sweep = sweep(&small(&json!({})));
    assert_eq!(finish(&sweep, &whole), []);

    // One run is finished, one was stopped midway, one has a damaged checkpoint.
    let [finished, stopped, damaged] = [0, 2, 3].map(|n| &sweep.jobs[n]);
    let done = Sweep { jobs: vec![finished.clone()] };
    assert_eq!(finish(&done, &broken), []);
    let log = std::fs::read(finished.folder(&broken).join("events.jsonl")).unwrap();
    stop_at(stopped, &broken, 4);
    let Work::Train(config) = &damaged.work else { panic!("an agent") };
    RunDirectory::create(damaged.folder(&broken), config).unwrap();
    let checkpoint = damaged.folder(&broken).join("checkpoint");
    std::fs::create_dir_all(checkpoint.join("last")).unwrap();
    std::fs::write(checkpoint.join("last/manifest.json"), "damaged").unwrap();

    let failures = finish(&sweep, &broken);
    assert_eq!(failures.len(), 1, "{failures:?}");
    assert_eq!(failures[0].0, damaged.name);
    assert!(failures[0].1.contains("manifest.json"), "{failures:?}");
    assert_eq!(std::fs::read(finished.folder(&broken).join("events.jsonl")).unwrap(), log);
    std::fs::remove_dir_all(&checkpoint).unwrap();
    assert_eq!(finish(&sweep, &broken), []);
    for job in &sweep.jobs {
        assert_eq!(metrics(&whole, &job.name), metrics(&broken, &job.name), "{}", job.name);
    }
    let results = read_results(&whole);
    assert_eq!(results.rows.len(), 6);
    assert_eq!(results.to_csv(), read_results(&broken).to_csv());
    let row = &results.rows[0];
    assert_eq!((&row["state"], &row["episodes"]), (&json!("finished"), &json!(8)));
}

#[test]
fn a_run_that_another_process_works_on_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = sweep(&small(&json!({"method": ["ddpg"], "seed": [0, 1], "epsilon": 0})));
    let directory = |job: &Job| {
        let Work::Train(config) = &job.work else { panic!("an agent") };
        RunDirectory::create(job.folder(folder.path()), config).unwrap()
    };
    let [held, free] = [0, 1].map(|n| directory(&sweep.jobs[n]));
    let lock = held.lock().unwrap();
    let ended = AtomicUsize::new(0);
    let failures = std::thread::scope(|scope| {
        let work =
            scope.spawn(|| run_sweep(&sweep, folder.path(), &mut |now| ended.store(now.ended, Ordering::Release)));
        while ended.load(Ordering::Acquire) < 1 {
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(!work.is_finished());
        drop(lock);
        work.join().unwrap().unwrap()
    });
    assert_eq!(failures, []);
    for directory in [held, free] {
        assert_eq!(directory.status().unwrap().state, RunState::Finished);
    }
}

#[test]
fn random_play_hardly_solves_the_tasks_and_truly_guided_play_does() {
    let file = include_bytes!("../../sweeps/audit.json");
    let mut jobs = Sweep::parse(file, "audit.json").unwrap().jobs;
    jobs.retain(|job| job.name.ends_with("-seed0"));
    assert_eq!(jobs.len(), 18);
    for job in &jobs {
        let Work::Hits(count) = &job.work else { panic!("{}", job.name) };
        let goal = HitJob { episodes: 200, ..HitJob::clone(count) }.count(&Stop::default()).unwrap().goal;
        let findable = ["task1", "task3"].contains(&count.task.name.as_str());
        let expected = match (count.policy, findable) {
            (Policy::Guided, _) => 10..=200,
            (_, true) => 0..=8,
            (_, false) => 0..=1,
        };
        assert!(expected.contains(&goal), "{}: {goal}", job.name);
    }
}

#[test]
fn literal_models_have_the_settings_of_the_literal_training() {
    let literal = |value: bool| {
        let sweep = sweep(&json!({"kind": "dynamics", "tools": "box", "literal": value, "seed": 3}));
        let Work::Dynamics(job) = &sweep.jobs[0].work else { panic!("a model") };
        (job.model.clone(), job.training.clone())
    };
    let seed = |training: TrainConfig| TrainConfig { seed: 3, ..training };
    assert_eq!(literal(true), (ModelConfig::literal(), seed(TrainConfig::literal())));
    assert_eq!(literal(false), (ModelConfig::default(), seed(TrainConfig::default())));
}

#[test]
fn settings_of_a_model_do_not_depend_on_their_order() {
    let model = |text: &str| {
        let sweep = Sweep::parse(text.as_bytes(), "test").unwrap();
        let Work::Dynamics(job) = &sweep.jobs[0].work else { panic!("a model") };
        job.model.clone()
    };
    let last = model(r#"{"kind": "dynamics", "tools": "create", "properties": false}"#);
    assert!(!last.properties);
    assert_eq!(model(r#"{"kind": "dynamics", "properties": false, "tools": "create"}"#), last);
}

/// Trains a job's run up to an episode, and stops it there.
fn stop_at(job: &Job, sweep: &Path, episode: u32) {
    let Work::Train(config) = &job.work else { panic!("an agent") };
    let directory = RunDirectory::create(job.folder(sweep), config).unwrap();
    let trainer = Trainer::spawn(directory.clone(), [Control::PauseAt(episode.into())]).unwrap();
    while trainer.watch.phase() != Phase::Paused {
        assert!(trainer.is_active(), "the training ended before it paused");
        std::thread::sleep(Duration::from_millis(2));
    }
    trainer.send(Control::Stop { reason: "a test".to_owned() });
    trainer.join().unwrap();
    assert!(matches!(directory.status().unwrap().state, RunState::Stopped(_)));
}

#[test]
fn a_run_with_other_settings_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let one = json!({"method": ["ddpg"], "seed": [0], "epsilon": 0});
    assert_eq!(finish(&sweep(&small(&one)), folder.path()), []);
    let mut other = small(&one);
    other["ddpg.gamma"] = json!(0.5);
    let error = run_sweep(&sweep(&other), folder.path(), &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("holds a run with other settings"), "{error}");
}

#[test]
fn models_are_trained_evaluated_and_tabulated() {
    let folder = tempfile::tempdir().unwrap();
    let file = json!({
        "kind": "dynamics", "tools": "box", "layers": [2, 3], "learning_rate": 1e-3, "epochs": 3, "width": 8,
        "observations": 10, "validation": 3, "evaluation.launches": 5, "evaluation.episodes": 1,
        "evaluation.hit_rollouts": 10
    });
    let sweep = sweep(&file);
    let mut reports = Vec::new();
    let failures = run_sweep(&sweep, folder.path(), &mut |now| reports.push((now.done, now.total)));
    assert_eq!(failures.unwrap(), []);
    assert!(reports.iter().all(|(_, total)| *total == 2 * 3), "two models of three epochs each: {reports:?}");
    assert_eq!(reports.last(), Some(&(2 * 3, 2 * 3)));
    let results = read_results(folder.path());
    for (row, layers) in results.rows.iter().zip([2, 3]) {
        assert_eq!(
            (&row["layers"], &row["state"], &row["epochs_done"]),
            (&json!(layers), &json!("finished"), &json!(3))
        );
        for measure in ["train_loss", "validation_loss", "one_step_error", "action_error"] {
            assert!(row[measure].as_f64().unwrap() > 0.0, "{measure}: {row:?}");
        }
    }
    let Work::Dynamics(job) = &sweep.jobs[0].work else { panic!("a model") };
    let handle = JobHandle::default();
    let alone = folder.path().join("alone");
    RunDirectory::open_or_create(&alone, job).unwrap();
    job.run(&alone, "test", &handle).unwrap();
    assert_eq!(handle.done(), 3, "epochs are the unit of its progress");
    // The model in the folder is the evaluated one.
    let model = mge_dynamics::Model::load(&sweep.jobs[0].folder(folder.path()).join("model.safetensors")).unwrap();
    assert_eq!(model.config().layers, 2);
    let before = results.to_csv();
    assert_eq!(finish(&sweep, folder.path()), []);
    assert_eq!(read_results(folder.path()).to_csv(), before);
    write_results(&folder.path().into()).unwrap();
    let csv = std::fs::read_to_string(folder.path().join("results.csv")).unwrap();
    assert!(csv.starts_with("run,state,tools,layers,seed,epochs_done,train_loss,"), "{csv}");
}

#[test]
fn a_setting_that_is_also_a_measure_is_one_column_of_the_results() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = sweep(&small(&json!({"method": ["ddpg"], "seed": [0], "epsilon": 0, "episodes": [2, 3]})));
    assert_eq!(finish(&sweep, folder.path()), []);
    let csv = String::from_utf8(read_results(folder.path()).to_csv()).unwrap();
    let heading = csv.lines().next().unwrap();
    assert_eq!(heading.split(',').filter(|column| *column == "episodes").count(), 1, "{heading}");
}

#[test]
fn a_setting_that_is_a_list_is_swept_as_one_value_or_as_a_list_of_them() {
    let jobs = |value: Value| sweep(&json!({"task": "task1", "method": "ddpg", "ddpg.target_clamp": value})).jobs;
    let clamp = |job: &Job| match &job.work {
        Work::Train(config) => config.ddpg.target_clamp,
        work => panic!("an agent: {work:?}"),
    };
    let one = jobs(json!([-2, 9]));
    assert_eq!((one.len(), clamp(&one[0]), one[0].name.as_str()), (1, Some([-2.0, 9.0]), "task1-ddpg-seed0"));
    let two = jobs(json!([[-2, 9], null]));
    assert!(two[1].name.ends_with("ddpg.target_clamp_null-seed0"), "{}", two[1].name);
    assert_eq!(two.iter().map(clamp).collect::<Vec<_>>(), [Some([-2.0, 9.0]), None]);
    assert_eq!(jobs(json!("[-2, 9]"))[0].work, one[0].work);
}

#[test]
fn hits_are_counted_once_and_tabulated() {
    let folder = tempfile::tempdir().unwrap();
    let file = json!({
        "kind": "hits", "task": "task1", "policy": ["guided", "random", "uniform"], "model": "true", "build": [5],
        "seed": [0, 1], "episodes": 3
    });
    let sweep = sweep(&file);
    let expected = ["task1-guided-build_5-seed0", "task1-guided-build_5-seed1", "task1-random-seed0"];
    assert_eq!(names(&sweep)[..3], expected);
    assert_eq!(finish(&sweep, folder.path()), []);
    let results = read_results(folder.path());
    assert_eq!(results.rows.len(), 6);
    let csv = String::from_utf8(results.to_csv()).unwrap();
    assert!(csv.starts_with("run,state,task,policy,prior,build,seed,episodes,goal,"), "{csv}");
    assert!(csv.lines().next().unwrap().ends_with(",goal,subgoal_1"), "{csv}");
    let Work::Hits(job) = &sweep.jobs[1].work else { panic!("a count") };
    let counted: HitCounts = result_in(&sweep.jobs[1].folder(folder.path())).unwrap().unwrap();
    assert_eq!(counted, job.count(&Stop::default()).unwrap());
    assert_eq!((counted.episodes, job.build, job.seed), (3, 5, 1));
    assert_eq!(finish(&sweep, folder.path()), []);
    assert_eq!(read_results(folder.path()), results);
    let table = |results: &Results| Summary::new(results, &mge_stats::Bootstrap::default()).unwrap().to_markdown();
    assert!(table(&results).contains(" [0, 0] |"), "counts have no decimals: {}", table(&results));
    let mut alone = results;
    alone.rows.retain(|row| row["seed"] == 0);
    let table = table(&alone);
    assert!(table.contains("| random |") && !table.contains('['), "a single seed has no interval: {table}");
    let wrong = json!({"kind": "hits", "task": "task1", "polcy": "random"}).to_string();
    let error = Sweep::parse(wrong.as_bytes(), "s.json").unwrap_err().to_string();
    assert!(error.contains("no setting `polcy` of a count of hits: did you mean `policy`?"), "{error}");
}

#[test]
fn models_are_reported_by_the_settings_in_which_they_differ() {
    let folder = tempfile::tempdir().unwrap();
    let small = json!({
        "kind": "dynamics", "tools": ["box,bucket", "square,floor"], "seed": [0, 1], "epochs": 2, "layers": 1,
        "width": 8, "embedding": 4, "observations": 8, "validation": 2, "evaluation.launches": 10,
        "evaluation.episodes": 1, "evaluation.horizon": 2, "evaluation.hit_rollouts": 10
    });
    let mut ablated = small.clone();
    ablated["edges"] = json!(["fully_connected"]);
    let sweep = sweep(&json!([small, ablated]));
    assert_eq!(finish(&sweep, folder.path()), []);
    let folders = [folder.path().to_owned()];
    let out = mge_base::atomic::Target::from(&*folder.path().join("report"));
    let report = || report_measured(&folders, &out, &mge_stats::Bootstrap::default(), "test").unwrap();
    assert_eq!(report(), Some(0));
    let results = read_results(folder.path());
    let summary = Summary::new(&results, &mge_stats::Bootstrap::default()).unwrap();
    let groups: Vec<_> = summary.groups.iter().map(|group| (group.setting("tools"), group.setting("edges"))).collect();
    let expected =
        ["bucket,box", "square,floor"].map(|tools| ["fully_connected", "dynamic"].map(|edges| (tools, edges)));
    assert_eq!(groups.len(), 4);
    for (tools, edges) in expected.concat() {
        let group = summary
            .groups
            .iter()
            .find(|group| (group.setting("tools"), group.setting("edges")) == (Some(tools), Some(edges)));
        let group = group.unwrap_or_else(|| panic!("{tools} {edges}: {groups:?}"));
        let rows = results.rows.iter().filter(|row| row["tools"] == tools && row["edges"] == edges);
        let errors: Vec<f64> = rows.map(|row| row["rollout_error_2"].as_f64().unwrap()).collect();
        assert_eq!((group.count, errors.len()), (2, 2));
        assert!((group.measures_like("rollout_error_2")[0].value - (errors[0] + errors[1]) / 2.0).abs() < 1e-12);
    }
    let text = std::fs::read_to_string(out.path.join("report.md")).unwrap();
    assert!(text.contains("| square,floor | fully_connected | 2 |"), "{text}");
    std::fs::remove_file(sweep.jobs[0].folder(folder.path()).join("result.json")).unwrap();
    assert_eq!(report(), Some(1));
}
