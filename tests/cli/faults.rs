//! External failures: a full disk, an unwritable folder, a run in use, a file of an older version, signals. Each gives
//! one clear line and loses nothing.

use std::path::{Path, PathBuf};

use crate::program::{self, fail, mge, succeed};
use mge::run::{RunDirectory, RunHistory, RunState};

/// Settings with which the log grows larger than a checkpoint.
const SMALL: &str = "--method ddpg --quiet --set ddpg.hidden=4 --set ddpg.replay_capacity=20 --set ddpg.batch_size=4 \
    --set ddpg.warmup_steps=20 --set checkpoints.last_every=10 --set=evaluation.every=0";

/// The arguments of a training in the folder `run`.
fn train<'a>(run: &'a str, episodes: &'a str) -> Vec<&'a str> {
    let start = ["train", "task1", "--episodes", episodes, "--out", run];
    start.into_iter().chain(SMALL.split_whitespace()).collect()
}

fn metrics(run: &Path) -> String {
    std::fs::read_to_string(run.join("metrics.csv")).unwrap()
}

#[test]
fn a_full_disk_stops_a_run_that_can_be_resumed_when_there_is_space() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken] = ["whole", "broken"].map(|name| folder.path().join(name));
    succeed(mge(&folder, train("whole", "200")));

    // Limits files to 64 blocks: like a full disk, but only for this process.
    let limited = "trap '' XFSZ; ulimit -f 64; exec \"$@\"";
    let mut command = std::process::Command::new("sh");
    command.args(["-c", limited, "sh", program::MGE]).args(train("broken", "200")).current_dir(&folder);
    let message = fail(command.output().unwrap(), "cannot write");
    assert!(message.contains("broken"), "{message}");
    let directory = RunDirectory::open(&broken).unwrap();
    let (Some(checkpoint), problems) = directory.newest_checkpoint().unwrap() else { panic!("a checkpoint") };
    assert!(problems.is_empty() && checkpoint.episode >= 10 && checkpoint.episode < 200, "{}", checkpoint.episode);

    succeed(mge(&folder, ["resume", "broken", "--quiet"]));
    assert_eq!(metrics(&whole), metrics(&broken));
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (run, expected) in [("/proc/mge-run", "/proc/mge-run"), ("/dev/null/run", "/dev/null")] {
        fail(mge(&folder, train(run, "10")), expected);
    }
    let sweep = r#"{"task": "task1", "method": "ddpg", "seed": [0], "episodes": 5}"#;
    std::fs::write(folder.path().join("s.json"), sweep).unwrap();
    fail(mge(&folder, ["sweep", "s.json", "--out", "/proc/mge-sweep"]), "/proc/mge-sweep");
}

#[test]
fn a_run_in_use_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    succeed(mge(&folder, train("run", "5")));
    let directory = RunDirectory::open(&run).unwrap();
    let _lock = directory.lock().unwrap();
    let before = metrics(&run);
    let expected = format!("is in use by process {}", std::process::id());
    fail(mge(&folder, ["resume", "run", "--quiet"]), &expected);
    assert_eq!(metrics(&run), before);
}

/// Waits for a change that another process makes.
fn wait_until(mut holds: impl FnMut() -> bool) {
    while !holds() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

/// Starts a training in the parent of its folder and waits until it has finished more than this many episodes.
fn under_way(arguments: &[&str], run: &Path, episodes: usize) -> std::process::Child {
    let mut child = program::command(run.parent().unwrap(), arguments)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    let rows = || std::fs::read_to_string(run.join("metrics.csv")).map_or(0, |text| text.lines().count());
    wait_until(|| {
        let has_finished = rows() > episodes;
        assert!(has_finished || child.try_wait().unwrap().is_none(), "it ended before it was asked to");
        has_finished
    });
    child
}

fn signal(child: &std::process::Child, signal: rustix::process::Signal) {
    let id = rustix::process::Pid::from_child(child);
    rustix::process::kill_process(id, signal).unwrap();
}

/// The messages of a program that must have ended with this status.
#[track_caller]
fn messages(output: &std::process::Output, status: i32) -> String {
    let messages = program::text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{messages}");
    messages
}

#[test]
fn a_signal_saves_everything_and_says_how_to_continue() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("my run");
    let path = run.to_str().unwrap();
    // Also with its progress, it says so once.
    let resume = vec!["resume", path];
    let mut done = 0;
    for (number, status, arguments) in [(Signal::INT, 130, train(path, "100000")), (Signal::TERM, 143, resume)] {
        let child = under_way(&arguments, &run, done + 30);
        signal(&child, number);
        let message = messages(&child.wait_with_output().unwrap(), status);
        let directory = RunDirectory::open(&run).unwrap();
        let records = RunHistory::read(&directory).unwrap().records;
        let (Some(checkpoint), _) = directory.newest_checkpoint().unwrap() else { panic!("a checkpoint") };
        assert_eq!(checkpoint.episode, records.len() as u64, "episodes were lost");
        assert!(matches!(directory.status().unwrap().state, RunState::Stopped(_)));
        assert!(records.iter().zip(1..).all(|(record, episode)| record.episode == episode));
        done = records.len();
        let expected = format!("stopped after {done} of 100000 episodes: continue with `mge resume '{path}'`\n");
        assert!(message.ends_with(&expected) && message.matches("stopped after").count() == 1, "{message}");
    }
}

fn make_pipe(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_signal_ends_the_program_at_once() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    // It blocks on its task, which is never written.
    let mut child = listening("train /dev/stdin --method ddpg --quiet --out run", folder.path());
    signal(&child, Signal::TERM);
    // Earlier, it would count as the same signal.
    std::thread::sleep(mge::stop::SAME_SIGNAL * 2);
    assert!(child.try_wait().unwrap().is_none(), "the first signal ended it at once");
    // Open until it has ended: otherwise the task would be read to its end.
    let _task = child.stdin.take();
    signal(&child, Signal::TERM);
    assert_eq!(child.wait().unwrap().code(), Some(143));
}

/// The output of a program that must end within two minutes.
fn ended(mut child: std::process::Child) -> std::process::Output {
    let begun = std::time::Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed().as_secs() > 120 {
            child.kill().unwrap();
            panic!("the signal had no effect");
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// Starts a command and waits until it handles SIGTERM.
#[cfg(target_os = "linux")]
fn listening(line: &str, folder: &Path) -> std::process::Child {
    let mut command = program::command(folder, line.split_whitespace());
    let pipe = std::process::Stdio::piped;
    let child = command.stdin(pipe()).stdout(std::process::Stdio::null()).stderr(pipe()).spawn().unwrap();
    let begun = std::time::Instant::now();
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        u64::from_str_radix(caught.trim(), 16).unwrap() & 1 << 14 != 0
    };
    while !listens() {
        assert!(begun.elapsed().as_secs() < 60, "{line}: no handler was installed");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_every_long_command_with_one_line() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, train("run", "5")));
    for line in [
        "tasks propose task2 --subgoals 50",
        "clusters task5",
        "dynamics train --tools box --epochs 1000 --quiet --out m.safetensors",
    ] {
        let child = listening(line, folder.path());
        signal(&child, Signal::TERM);
        let output = ended(child);
        let message = program::text(&output.stderr);
        assert_eq!(output.status.code(), Some(143), "{line}: {message}");
        let last = message.lines().last().unwrap();
        let is_told = last.contains("the same command") || last.contains("stopped before its end");
        assert!(is_told && message.lines().count() < 4, "{line}: {message}");
    }
    std::fs::write(folder.path().join("s.mge"), "method ddpg\nepisodes 100000\ntrain ./made\nwait\n").unwrap();
    let child = listening("script s.mge --quiet", folder.path());
    wait_until(|| folder.path().join("made/metrics.csv").exists());
    signal(&child, Signal::INT);
    let message = messages(&ended(child), 130);
    assert!(message.contains("s.mge:4: interrupted; `mge resume`"), "{message}");
    let made = RunDirectory::open(folder.path().join("made")).unwrap();
    assert!(matches!(made.status().unwrap().state, RunState::Stopped(_)));
    // Two runs and the script.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

/// Uses the largest settings for work within one episode or before the first.
#[test]
fn a_signal_ends_a_training_during_a_very_long_episode() {
    let planning = "--set planner.rollouts=10000 --set planner.iterations=1000 --set planner.horizon=100";
    let clusters = "--set guidance.model_rollouts=100000 --set guidance.most_model_rollouts=100000 \
        --set guidance.horizon=100 \
        --set guidance.environment_rollouts=100000";
    // One update takes minutes.
    let networks = "--set ddpg.batch_size=65536 --set ddpg.hidden=1024 --set ddpg.layers=4 --set ddpg.warmup_steps=0";
    for (method, source, settings) in [
        ("planning", "true", planning),
        ("planning", "learned", planning),
        ("ddpg-mge", "true", clusters),
        ("ddpg-mge", "learned", clusters),
        ("ddpg", "", networks),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let model = if method == "ddpg" { String::new() } else { format!("--model {source}") };
        let line = format!("train task1 --quiet --method {method} {model} {settings} --out run");
        let mut command = program::command(&folder, line.split_whitespace());
        let mut child = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
        wait_until(|| {
            let has_begun = run.join("tensorboard").exists();
            assert!(has_begun || child.try_wait().unwrap().is_none(), "{line}: it ended before it was asked to");
            has_begun
        });
        std::thread::sleep(std::time::Duration::from_millis(200));
        signal(&child, rustix::process::Signal::INT);
        let output = ended(child);
        let message = program::text(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{line}: {message}");
        assert!(message.starts_with("stopped after ") && message.lines().count() == 1, "{line}: {message}");
        let status = RunDirectory::open(&run).unwrap().status().unwrap();
        assert!(matches!(status.state, RunState::Stopped(_)), "{line}: {:?}", status.state);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_right_after_the_start_is_handled() {
    let folder = tempfile::tempdir().unwrap();
    let child = listening("train task1 --method ddpg --episodes 100000 --quiet --out run", folder.path());
    signal(&child, rustix::process::Signal::TERM);
    let message = messages(&ended(child), 143);
    assert!(message.starts_with("stopped after "), "{message}");
}

#[test]
fn a_sweep_and_a_study_end_on_a_signal_and_can_be_continued() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    let sweep = r#"{"task": "task1", "method": "ddpg", "seed": [0, 1], "episodes": 100000, "ddpg.hidden": 4}"#;
    std::fs::write(folder.path().join("s.json"), sweep).unwrap();
    let start = |line: &str| {
        let mut command = program::command(&folder, line.split(' '));
        command.stderr(std::process::Stdio::piped()).spawn().unwrap()
    };
    let child = start("sweep s.json --out sweep");
    let metrics = || -> Vec<PathBuf> {
        let runs = std::fs::read_dir(folder.path().join("sweep/runs")).into_iter().flatten().flatten();
        runs.map(|entry| entry.path().join("metrics.csv")).filter(|path| path.exists()).collect()
    };
    wait_until(|| !metrics().is_empty());
    signal(&child, Signal::INT);
    let message = messages(&child.wait_with_output().unwrap(), 130);
    assert!(message.trim_end().lines().last().unwrap().contains("the same command continues"), "{message}");
    for path in metrics() {
        let directory = RunDirectory::open(path.parent().unwrap()).unwrap();
        let records = RunHistory::read(&directory).unwrap().records;
        assert_eq!(directory.newest_checkpoint().unwrap().0.unwrap().episode, records.len() as u64);
    }

    let child = start("reproduce --quick --out study");
    wait_until(|| std::fs::read_dir(folder.path().join("study")).is_ok_and(|mut entries| entries.next().is_some()));
    signal(&child, Signal::TERM);
    let message = messages(&child.wait_with_output().unwrap(), 143);
    assert!(message.contains("the same command continues"), "{message}");
}

#[test]
fn a_run_whose_folder_is_deleted_or_moved_ends_with_an_error_and_does_not_recreate_it() {
    let folder = tempfile::tempdir().unwrap();
    let [run, moved] = ["run", "moved"].map(|name| folder.path().join(name));
    for delete in [true, false] {
        let child = under_way(&train("run", "100000"), &run, 30);
        match delete {
            // The training may write a file during the removal.
            true => while std::fs::remove_dir_all(&run).is_err() {},
            false => std::fs::rename(&run, &moved).unwrap(),
        }
        fail(child.wait_with_output().unwrap(), "was moved or deleted while it was being trained");
        assert!(!run.exists(), "the folder was created again");
    }
    assert!(matches!(RunDirectory::open(&moved).unwrap().status().unwrap().state, RunState::Failed(_)));
    let child = under_way(&["resume", "moved", "--quiet"], &moved, 60);
    signal(&child, rustix::process::Signal::TERM);
    messages(&child.wait_with_output().unwrap(), 143);
}

#[test]
fn a_folder_with_a_partly_created_run_is_reused() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join("lock"), "1").unwrap();
    std::fs::write(run.join(".mge-abcdefABCD.tmp"), "{\"format\": 1, \"mge").unwrap();
    succeed(mge(&folder, train("run", "5")));
    assert!(!run.join(".mge-abcdefABCD.tmp").exists(), "the temporary file remains");
    std::fs::write(run.join(".mge-laterLATER.tmp"), "x").unwrap();
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
}

#[test]
fn links_are_not_followed_and_pipes_do_not_block() {
    let folder = tempfile::tempdir().unwrap();
    let thesis = folder.path().join("thesis.tex");
    std::fs::write(&thesis, "years of work").unwrap();
    let run = first_version(folder.path());
    let refuses = |expected: &str| fail(mge(&folder, ["resume", "run", "--quiet"]), expected);
    for name in ["checkpoint", "tensorboard"] {
        let elsewhere = folder.path().join(format!("{name} elsewhere"));
        std::fs::create_dir_all(run.join(name)).unwrap();
        std::fs::rename(run.join(name), &elsewhere).unwrap();
        let kept = std::fs::read_dir(&elsewhere).unwrap().count();
        std::os::unix::fs::symlink(&elsewhere, run.join(name)).unwrap();
        refuses(&format!("{name}: not a folder, but a link"));
        assert_eq!(std::fs::read_dir(&elsewhere).unwrap().count(), kept, "the target of the link was written to");
        std::fs::remove_file(run.join(name)).unwrap();
        std::fs::rename(&elsewhere, run.join(name)).unwrap();
    }
    std::fs::remove_file(run.join("lock")).unwrap_or_default();
    std::os::unix::fs::symlink(&thesis, run.join("lock")).unwrap();
    refuses("lock: not a regular file");
    std::fs::remove_file(run.join("lock")).unwrap();
    for file in ["events.jsonl", "metrics.csv", "episodes.jsonl"] {
        let kept = std::fs::read(run.join(file)).unwrap_or_default();
        std::fs::remove_file(run.join(file)).unwrap_or_default();
        make_pipe(&run.join(file));
        refuses(&format!("{file}: not a regular file"));
        if file == "events.jsonl" {
            fail(mge(&folder, ["report", "run", "--out", "report"]), "not a regular file");
        }
        std::fs::remove_file(run.join(file)).unwrap();
        std::fs::write(run.join(file), kept).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&thesis).unwrap(), "years of work");
}

/// A copy of a run in the first version of the format, stopped in the middle.
fn first_version(folder: &Path) -> PathBuf {
    fn copy(from: &Path, to: &Path) {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap() {
            let path = entry.unwrap().path();
            let target = to.join(path.file_name().unwrap());
            if path.is_dir() { copy(&path, &target) } else { _ = std::fs::copy(&path, &target).unwrap() }
        }
    }
    let run = folder.join("run");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/run-format-1"), &run);
    run
}

#[test]
fn a_run_whose_recorded_episodes_are_lost_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let run = first_version(folder.path());
    std::fs::write(run.join("episodes.jsonl"), "").unwrap();
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
    assert_eq!(metrics(&run).lines().count(), 13);
}

#[test]
fn an_extended_run_can_be_repeated_from_its_start() {
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, train("run", "30")));
    succeed(mge(&folder, ["resume", "run", "--quiet", "--episodes", "40"]));
    let whole = metrics(&folder.path().join("run"));
    assert_eq!(whole.lines().count(), 41);
    succeed(mge(&folder, ["fork", "run", "--at", "25", "--out", "fork", "--quiet"]));
    assert_eq!(metrics(&folder.path().join("fork")), whole);
    let mut same = train("same", "40");
    same.extend(["--set", "noise_decay.share=0.375"]);
    succeed(mge(&folder, same));
    assert_eq!(metrics(&folder.path().join("same")), whole);
    let report = succeed(mge(&folder, ["compare", "run", "same"]));
    let row = |key: &str| report.lines().find(|line| line.contains(key)).map(|line| line.split_whitespace().collect());
    assert_eq!(row("extended_from"), Some(vec!["extended_from", "30"]), "{report}");
}

#[test]
fn refusing_fewer_episodes_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    succeed(mge(&folder, train("run", "20")));
    let [config, events] = ["config.json", "events.jsonl"].map(|name| run.join(name));
    let before = [&config, &events].map(|path| std::fs::read(path).unwrap());
    let rows = metrics(&run);
    fail(mge(&folder, ["resume", "run", "--episodes", "10", "--quiet"]), "has 20 episodes, which cannot become fewer");
    assert_eq!([&config, &events].map(|path| std::fs::read(path).unwrap()), before);
    succeed(mge(&folder, ["resume", "run", "--episodes", "30", "--quiet"]));
    assert!(metrics(&run).starts_with(&rows));
}

#[test]
fn a_run_that_is_named_twice_is_resumed_once() {
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, train("run", "10")));
    let resumed = mge(&folder, ["resume", "run", "./run", "--episodes", "15", "--quiet"]);
    assert_eq!(program::text(&resumed.stdout).lines().count(), 1, "one result: {resumed:?}");
    succeed(resumed);
    assert!(metrics(&folder.path().join("run")).lines().last().unwrap().starts_with("15,"));
}

#[test]
fn a_report_leaves_out_damaged_runs_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    for run in ["runs/good", "runs/damaged"] {
        succeed(mge(&folder, train(run, "5")));
    }
    std::fs::write(folder.path().join("runs/damaged/config.json"), "{").unwrap();
    succeed(mge(&folder, ["report", "runs"]));
    let report = std::fs::read_to_string(folder.path().join("report/report.md")).unwrap();
    assert!(report.contains("from 1 finished runs") && report.contains("- `runs/damaged`: "), "{report}");
    fail(mge(&folder, ["report", "runs/damaged"]), "config.json");
}

#[test]
fn settings_that_limit_each_other_are_given_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let train = |settings: &[&str]| {
        let start = ["train", "task1", "--method", "planning", "--episodes", "1", "--quiet", "--model", "true"];
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        mge(&folder, start.into_iter().chain(settings).chain(["--out", "run"]))
    };
    succeed(train(&["planner.rollouts=3", "planner.elites=2"]));
    let config = std::fs::read_to_string(folder.path().join("run/config.json")).unwrap();
    assert!(config.contains("\"rollouts\": 3") && config.contains("\"elites\": 2"), "{config}");
    fail(train(&["planner.rollouts=4", "planner.elites=5"]), "planner.elites");
}

#[test]
fn more_episodes_extend_an_unfinished_run_too() {
    let folder = tempfile::tempdir().unwrap();
    let run = first_version(folder.path());
    succeed(mge(&folder, ["resume", "run", "--quiet", "--episodes", "15"]));
    assert!(metrics(&run).lines().last().unwrap().starts_with("15,"));
}

#[test]
fn a_damaged_checkpoint_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = train("run", "20");
    arguments.extend(["--set", "checkpoints.periodic_every=10"]);
    succeed(mge(&folder, arguments));
    for checkpoint in ["last", "episode-20"] {
        std::fs::write(folder.path().join("run/checkpoint").join(checkpoint).join("replay.bin"), "").unwrap();
    }
    let output = mge(&folder, ["resume", "run", "--episodes", "30"]);
    let message = program::text(&output.stderr);
    assert!(message.contains("a checkpoint cannot be used: ") && message.contains("replay.bin"), "{message}");
    succeed(output);
}

#[test]
fn settings_of_a_bench_are_checked_before_its_search_for_subgoals() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("p")).unwrap();
    let index = r#"{"version": 2, "seed": 0, "split": "test", "start_noise": 0, "puzzles": []}"#;
    std::fs::write(folder.path().join("p/index.json"), index).unwrap();
    let bench = |setting| mge(&folder, ["puzzles", "bench", "p", "--prepare", "--out", "out", "--set", setting]);
    fail(bench("foo=1"), "there is no setting `foo`");
    fail(bench("ddpg.gamma=7"), "ddpg.gamma");
    fail(bench("prior=true"), "options of their own");
    assert!(!folder.path().join("out").exists());
    succeed(bench("threshold=0.5"));
}

#[test]
fn the_report_of_a_bench_is_about_its_own_trainings() {
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, ["puzzles", "generate", "--split", "train", "--seed", "13", "--count", "1", "--out", "p"]));
    let bench = |method| {
        let options = ["--episodes", "2", "--set", "ddpg.hidden=8", "--out", "out"];
        succeed(mge(
            &folder,
            [&["puzzles", "bench", "p", "--model", "true", "--method", method][..], &options].concat(),
        ));
        std::fs::read_to_string(folder.path().join("out/report.md")).unwrap()
    };
    assert!(bench("ddpg").contains("| DDPG |"));
    let report = bench("open-loop");
    assert!(report.contains("| open-loop replay |") && !report.contains("| DDPG |"), "{report}");
}

#[test]
fn results_do_not_replace_files_of_other_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let train = ["train", "task1", "--method", "ddpg", "--episodes", "1", "--set", "ddpg.hidden=8", "--quiet"];
    succeed(mge(&folder, train.into_iter().chain(["--out", "run"])));
    let config = std::fs::read(folder.path().join("run/config.json")).unwrap();
    fail(mge(&folder, ["export", "run", "--out", "run/config.json"]), "exists and is not");
    fail(
        mge(&folder, ["clusters", "task1", "--out", "run/config.json"]),
        "exists and is not a file of action clusters",
    );
    fail(mge(&folder, ["tasks", "propose", "task1", "--out", "run/config.json"]), "exists and is not a task");
    fail(mge(&folder, ["tasks", "propose", "task1", "--out", "run"]), "a folder");
    fail(mge(&folder, ["export", "run", "--out", "nowhere/a.safetensors"]), "the folder nowhere does not exist");
    assert_eq!(std::fs::read(folder.path().join("run/config.json")).unwrap(), config);
    for _ in 0..2 {
        succeed(mge(&folder, ["export", "run", "--out", "actor.safetensors"]));
    }
}

#[test]
fn a_run_in_a_folder_whose_name_is_not_text_prints_its_result() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["train", "task1", "--method", "ddpg", "--episodes", "1", "--set", "ddpg.hidden=8", "--out"];
    let arguments =
        arguments.map(std::ffi::OsStr::new).into_iter().chain([std::ffi::OsStr::from_bytes(b"bad\xffname")]);
    succeed(mge(&folder, arguments));
}

#[test]
fn a_script_finishes_what_it_has_started() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.mge"), "method ddpg\nset ddpg.hidden 4\nepisodes 3\ntrain run").unwrap();
    succeed(mge(&folder, ["script", "s.mge", "--quiet"]));
    assert_eq!(metrics(&folder.path().join("runs/run")).lines().count(), 4);
    std::fs::write(folder.path().join("s.mge"), "model nothing\nclusters").unwrap();
    fail(mge(&folder, ["script", "s.mge", "--quiet"]), "nothing");
}

#[test]
fn runs_of_the_first_format_still_load() {
    let folder = tempfile::tempdir().unwrap();
    let run = first_version(folder.path());
    let status = RunDirectory::open(&run).unwrap().status().unwrap();
    assert!(matches!(status.state, RunState::Stopped(_)), "{:?}", status.state);
    assert_eq!(status.last_episode.unwrap().episode, 6);
    let records = || RunHistory::read(&RunDirectory::open(&run).unwrap()).unwrap().records;
    let recorded = records();

    succeed(mge(&folder, ["evaluate", "run"]));
    succeed(mge(&folder, ["figures", "run", "--out", "figures"]));
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
    assert_eq!(RunDirectory::open(&run).unwrap().status().unwrap().state, RunState::Finished);
    let resumed = records();
    assert_eq!((resumed.len(), &resumed[..6]), (12, &recorded[..6]));
}

#[test]
fn a_newer_format_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let config = first_version(folder.path()).join("config.json");
    let newer = std::fs::read_to_string(&config).unwrap().replacen("\"format\": 1", "\"format\": 2", 1);
    std::fs::write(&config, newer).unwrap();
    let expected = "config.json has format 2, and this program reads formats 1 to 1";
    fail(mge(&folder, ["resume", "run"]), expected);
}

#[test]
fn a_run_with_settings_of_an_earlier_version_is_reported_but_neither_continued_nor_played() {
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, train("run", "20")));
    let run = folder.path().join("run");
    let config = std::fs::read_to_string(run.join("config.json")).unwrap();
    let earlier = config.replacen("\"start_noise\": null,", "\"start_noise\": null, \"tools\": \"train\",", 1);
    assert_ne!(earlier, config);
    std::fs::write(run.join("config.json"), earlier).unwrap();
    // As in a checkpoint of that version, its settings are those of the run.
    let checkpoint = run.join("checkpoint/last");
    let manifest = std::fs::read_to_string(checkpoint.join("manifest.json")).unwrap();
    let mut manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    manifest["sections"].as_array_mut().unwrap().retain(|section| section["name"] != "config.json");
    std::fs::write(checkpoint.join("manifest.json"), manifest.to_string()).unwrap();
    std::fs::remove_file(checkpoint.join("config.json")).unwrap();
    let before = metrics(&run);
    let report = succeed(mge(&folder, ["report", "run", "--out", "report"]));
    assert!(report.contains("report"), "{report}");
    succeed(mge(&folder, ["figures", "run", "--out", "figures"]));
    let expected = "the run was trained with `tools` train, which this version does not have";
    for line in
        ["resume run --episodes 30", "evaluate run", "fork run --at 10 --out fork", "export run --out a.safetensors"]
    {
        fail(mge(&folder, line.split_whitespace()), expected);
    }
    assert_eq!(metrics(&run), before);
    assert!(!folder.path().join("fork").exists());
}
