//! External failures: a full disk, an unwritable folder, a run in use, a file of an older version, signals. Each gives
//! one clear line and loses nothing.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mge::run::{RunDirectory, RunState};

const MGE: &str = env!("CARGO_BIN_EXE_mge");

/// Settings with which the log grows larger than a checkpoint.
const SMALL: [&str; 14] = [
    "--method",
    "ddpg",
    "--quiet",
    "--set",
    "ddpg.hidden=4",
    "--set",
    "ddpg.replay_capacity=20",
    "--set",
    "ddpg.batch_size=4",
    "--set",
    "ddpg.warmup_steps=20",
    "--set",
    "checkpoints.last_every=10",
    "--set=evaluation.every=0",
];

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn mge(arguments: &[&str]) -> Output {
    Command::new(MGE).args(arguments).output().expect("the program starts")
}

/// The one-line error of a failed command.
#[track_caller]
fn failure(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let message = text(&output.stderr);
    assert!(message.starts_with("error: ") && message.lines().count() == 1, "{message}");
    message
}

fn train(run: &Path, episodes: &str) -> Vec<String> {
    let start = ["train", "task1", "--episodes", episodes, "--out"].map(str::to_owned);
    let path = run.display().to_string();
    start.into_iter().chain([path]).chain(SMALL.map(str::to_owned)).collect()
}

fn metrics(run: &Path) -> String {
    std::fs::read_to_string(run.join("metrics.csv")).unwrap()
}

#[cfg(unix)]
#[test]
fn a_full_disk_stops_a_run_that_can_be_resumed_when_there_is_space() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken] = ["whole", "broken"].map(|name| folder.path().join(name));
    let output = Command::new(MGE).args(train(&whole, "200")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));

    // Limits files to 64 blocks: like a full disk, but only for this process.
    let limited = "trap '' XFSZ; ulimit -f 64; exec \"$@\"";
    let output = Command::new("sh").args(["-c", limited, "sh", MGE]).args(train(&broken, "200")).output().unwrap();
    let message = failure(&output);
    assert!(message.contains("cannot write") && message.contains("broken"), "{message}");
    let directory = RunDirectory::open(&broken).unwrap();
    let (checkpoint, problems) = directory.checkpoints().load_newest().unwrap();
    assert!(problems.is_empty() && checkpoint.episode >= 10 && checkpoint.episode < 200, "{}", checkpoint.episode);

    let output = mge(&["resume", &broken.display().to_string(), "--quiet"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(metrics(&whole), metrics(&broken));
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_named() {
    for (run, expected) in [("/proc/mge-run", "/proc/mge-run"), ("/dev/null/run", "/dev/null")] {
        let output = Command::new(MGE).args(train(Path::new(run), "10")).output().unwrap();
        let message = failure(&output);
        assert!(message.contains(expected), "{message}");
    }
    let folder = tempfile::tempdir().unwrap();
    let sweep = folder.path().join("s.json");
    std::fs::write(&sweep, r#"{"task": "task1", "method": "ddpg", "seed": [0], "episodes": 5}"#).unwrap();
    let message = failure(&mge(&["sweep", &sweep.display().to_string(), "--out", "/proc/mge-sweep"]));
    assert!(message.contains("/proc/mge-sweep"), "{message}");
}

#[test]
fn a_run_in_use_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let output = Command::new(MGE).args(train(&run, "5")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let directory = RunDirectory::open(&run).unwrap();
    let _lock = directory.lock().unwrap();
    let before = metrics(&run);
    let message = failure(&mge(&["resume", &run.display().to_string(), "--quiet"]));
    assert!(message.contains(&format!("is in use by process {}", std::process::id())), "{message}");
    assert_eq!(metrics(&run), before);
}

/// A run of another process is controlled from a shell, also after it has detached from its terminal.
#[cfg(unix)]
#[test]
fn a_run_is_paused_re_scheduled_continued_and_stopped_by_other_processes() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let path = run.display().to_string();
    let asked = |arguments: &[&str]| {
        let output = mge(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        text(&output.stdout)
    };
    let child = under_way(&train(&run, "1000000"), &run, 3);
    assert!(asked(&["pause", &path]).ends_with(": paused\n"));
    let at_rest = metrics(&run);
    assert_eq!(asked(&["pause", &path]), "paused already\n");
    assert!(asked(&["epsilon", &path, "0.25"]).ends_with(": epsilon is now 0.25\n"));
    assert_eq!(metrics(&run), at_rest, "a paused run went on");
    assert!(asked(&["resume", &path]).ends_with(": going on\n"));
    while metrics(&run) == at_rest {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(asked(&["stop", &path]).contains("requested by another process"));
    assert!(ended(child).status.success());
    let message = failure(&mge(&["stop", &path]));
    assert!(message.contains("nobody is training") && message.contains("mge resume"), "{message}");

    let detached = ["resume", "--detached", "--quiet", &path].map(str::to_owned);
    // The program installs its signal handlers before it trains.
    let child = under_way(&detached, &run, metrics(&run).lines().count());
    signal(&child, rustix::process::Signal::HUP);
    let before = metrics(&run);
    while metrics(&run) == before {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    asked(&["stop", &path]);
    assert!(ended(child).status.success(), "a closed terminal ended a detached run");
}

/// Starts a training in its own process and waits until it has finished at least this many episodes.
#[cfg(unix)]
fn under_way(arguments: &[String], run: &Path, episodes: usize) -> std::process::Child {
    let mut child = Command::new(MGE)
        .args(arguments)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    let rows = || std::fs::read_to_string(run.join("metrics.csv")).map_or(0, |text| text.lines().count());
    while rows() <= episodes {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was asked to");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child
}

#[cfg(unix)]
fn signal(child: &std::process::Child, signal: rustix::process::Signal) {
    let id = rustix::process::Pid::from_child(child);
    rustix::process::kill_process(id, signal).unwrap();
}

#[cfg(unix)]
#[test]
fn a_signal_saves_everything_and_says_how_to_continue() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("my run");
    let resume = ["resume".to_owned(), run.display().to_string(), "--quiet".to_owned()];
    let mut done = 0;
    for (number, status, arguments) in [(Signal::INT, 130, train(&run, "100000")), (Signal::TERM, 143, resume.to_vec())]
    {
        let child = under_way(&arguments, &run, done + 30);
        signal(&child, number);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(status), "{}", text(&output.stderr));
        let records = mge::run::read_metrics(&run.join("metrics.csv")).unwrap();
        let directory = RunDirectory::open(&run).unwrap();
        let (checkpoint, _) = directory.checkpoints().load_newest().unwrap();
        assert_eq!(checkpoint.episode, records.len() as u64, "episodes were lost");
        assert!(matches!(directory.status().unwrap().state, RunState::Stopped(_)));
        assert!(records.iter().zip(1..).all(|(record, episode)| record.episode == episode));
        let message = text(&output.stderr);
        let expected = format!(
            "stopped after {} of 100000 episodes: continue with `mge resume '{}'`\n",
            records.len(),
            run.display()
        );
        assert_eq!(message, expected);
        done = records.len();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_second_signal_ends_the_program_at_once() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    // It blocks on its task, which is never written.
    assert!(Command::new("mkfifo").arg(folder.path().join("task.json")).status().unwrap().success());
    let mut child = listening("train task.json --method ddpg --quiet --out run", folder.path());
    signal(&child, Signal::TERM);
    std::thread::sleep(std::time::Duration::from_millis(100));
    assert!(child.try_wait().unwrap().is_none(), "the first signal ended it at once");
    signal(&child, Signal::TERM);
    assert_eq!(child.wait().unwrap().code(), Some(143));
}

/// The output of a program that must end within two minutes.
#[cfg(unix)]
fn ended(mut child: std::process::Child) -> Output {
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
    let mut command = Command::new(MGE);
    command.args(line.split_whitespace()).current_dir(folder);
    let child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap();
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
    let output = Command::new(MGE).args(train(&folder.path().join("run"), "5")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    for line in [
        "tasks audit task1 --episodes 1000000",
        "tasks propose task2 --subgoals 50",
        "clusters task5",
        "evaluate run --episodes 1000000",
        "dynamics evaluate bucket-box --launches 1000000 --quiet",
        "dynamics train --tools box --epochs 1000 --quiet --out m.safetensors",
        "bench",
    ] {
        let child = listening(line, folder.path());
        signal(&child, Signal::TERM);
        let output = ended(child);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(143), "{line}: {message}");
        let last = message.lines().last().unwrap();
        assert!(last.contains("the same command") && message.lines().count() < 4, "{line}: {message}");
    }
    std::fs::write(folder.path().join("s.mge"), "method ddpg\nepisodes 100000\ntrain made\nwait\n").unwrap();
    let child = listening("script s.mge --quiet", folder.path());
    while !folder.path().join("made/metrics.csv").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    signal(&child, Signal::INT);
    let output = ended(child);
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("s.mge:4: interrupted; `mge resume`"), "{}", text(&output.stderr));
    let made = RunDirectory::open(folder.path().join("made")).unwrap();
    assert!(matches!(made.status().unwrap().state, RunState::Stopped(_)));
    // Two runs, the script, and the checkpoint of the model.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4, "something else was left");
}

/// Uses the largest settings for work within one episode or before the first.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_training_during_a_very_long_episode() {
    let planning = "--set planner.rollouts=10000 --set planner.iterations=1000 --set planner.horizon=100";
    let clusters = "--set guidance.model_rollouts=100000 --set guidance.horizon=100 \
        --set guidance.environment_rollouts=100000";
    // One update takes minutes.
    let networks = "--set ddpg.batch_size=65536 --set ddpg.hidden=1024 --set ddpg.layers=4 --set ddpg.warmup_steps=0";
    for (method, source, settings) in [
        ("planning", "true", planning),
        ("planning", "learned", planning),
        ("ddpg-mge", "true", clusters),
        ("ddpg-mge", "learned", clusters),
        ("ddpg", "true", networks),
        ("ddpg-model-replay", "learned", "--set model_replay.rollouts=1000 --set model_replay.horizon=100"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let line = format!("train task1 --quiet --method {method} --model {source} {settings} --out");
        let mut command = Command::new(MGE);
        command.args(line.split_whitespace()).arg(&run).stderr(std::process::Stdio::piped());
        let mut child = command.spawn().unwrap();
        while !run.join("tensorboard").exists() {
            assert!(child.try_wait().unwrap().is_none(), "{line}: it ended before it was asked to");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        std::thread::sleep(std::time::Duration::from_millis(200));
        signal(&child, rustix::process::Signal::INT);
        let output = ended(child);
        let message = text(&output.stderr);
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
    // It blocks on its task until after the signal was sent.
    assert!(Command::new("mkfifo").arg(folder.path().join("task.json")).status().unwrap().success());
    let child = listening("train task.json --method ddpg --quiet --out run", folder.path());
    signal(&child, rustix::process::Signal::TERM);
    let task = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tasks/task1.json")).unwrap();
    let pipe = folder.path().join("task.json");
    // Writes the task as often as it is read. The thread is not joined, as its last write may block forever.
    std::thread::spawn(move || {
        while std::fs::write(&pipe, &task).is_ok() {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
    });
    let output = ended(child);
    assert_eq!(output.status.code(), Some(143), "{}", text(&output.stderr));
    assert!(text(&output.stderr).starts_with("stopped after "), "{}", text(&output.stderr));
}

#[cfg(unix)]
#[test]
fn a_sweep_and_a_study_end_on_a_signal_and_can_be_continued() {
    use rustix::process::Signal;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.json");
    std::fs::write(
        &file,
        r#"{"task": "task1", "method": "ddpg", "seed": [0, 1], "episodes": 100000, "ddpg.hidden": 4}"#,
    )
    .unwrap();
    let [sweep, study] = ["sweep", "study"].map(|name| folder.path().join(name).display().to_string());
    let sweep_arguments = ["sweep".to_owned(), file.display().to_string(), "--out".to_owned(), sweep.clone()];
    let child = Command::new(MGE).args(sweep_arguments).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let runs = Path::new(&sweep).join("runs");
    let metrics = || -> Vec<PathBuf> {
        let runs = std::fs::read_dir(&runs).into_iter().flatten().flatten();
        runs.map(|entry| entry.path().join("metrics.csv")).filter(|path| path.exists()).collect()
    };
    while metrics().is_empty() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    signal(&child, Signal::INT);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let message = text(&output.stderr);
    assert!(message.trim_end().lines().last().unwrap().contains("the same command continues"), "{message}");
    for path in metrics() {
        let directory = RunDirectory::open(path.parent().unwrap()).unwrap();
        let records = mge::run::read_metrics(&path).unwrap();
        assert_eq!(directory.checkpoints().load_newest().unwrap().0.episode, records.len() as u64);
    }

    let child = Command::new(MGE)
        .args(["reproduce", "--quick", "--out", &study])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    while std::fs::read_dir(&study).map_or(0, |entries| entries.count()) == 0 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    signal(&child, Signal::TERM);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(143), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("the same command continues"), "{}", text(&output.stderr));
}

#[cfg(unix)]
#[test]
fn a_run_whose_folder_is_deleted_or_moved_ends_with_an_error_and_does_not_recreate_it() {
    let folder = tempfile::tempdir().unwrap();
    let [run, moved] = ["run", "moved"].map(|name| folder.path().join(name));
    for delete in [true, false] {
        let child = under_way(&train(&run, "100000"), &run, 30);
        match delete {
            // The training may write a file during the removal.
            true => while std::fs::remove_dir_all(&run).is_err() {},
            false => std::fs::rename(&run, &moved).unwrap(),
        }
        let message = failure(&child.wait_with_output().unwrap());
        assert!(message.contains("was moved or deleted while it was being trained"), "{message}");
        assert!(!run.exists(), "the folder was created again");
    }
    assert!(matches!(RunDirectory::open(&moved).unwrap().status().unwrap().state, RunState::Failed(_)));
    let child = under_way(&["resume".to_owned(), moved.display().to_string(), "--quiet".to_owned()], &moved, 60);
    signal(&child, rustix::process::Signal::TERM);
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(143));
}

#[test]
fn a_folder_with_a_partly_created_run_is_reused() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join("lock"), "1").unwrap();
    std::fs::write(run.join(".mge-abcdef"), "{\"format\": 1, \"mge").unwrap();
    let output = Command::new(MGE).args(train(&run, "5")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(!run.join(".mge-abcdef").exists(), "the temporary file remains");
    std::fs::write(run.join(".mge-later"), "x").unwrap();
    let output = mge(&["resume", &run.display().to_string(), "--quiet"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[cfg(unix)]
#[test]
fn links_are_not_followed_and_pipes_do_not_block() {
    let folder = tempfile::tempdir().unwrap();
    let thesis = folder.path().join("thesis.tex");
    std::fs::write(&thesis, "years of work").unwrap();
    let run = first_version(folder.path());
    let path = run.display().to_string();
    for name in ["checkpoint", "tensorboard"] {
        let elsewhere = folder.path().join(format!("{name} elsewhere"));
        std::fs::create_dir_all(run.join(name)).unwrap();
        std::fs::rename(run.join(name), &elsewhere).unwrap();
        let kept = std::fs::read_dir(&elsewhere).unwrap().count();
        std::os::unix::fs::symlink(&elsewhere, run.join(name)).unwrap();
        let message = failure(&mge(&["resume", &path, "--quiet"]));
        assert!(message.contains(&format!("{name}: it is no folder but a link")), "{message}");
        assert_eq!(std::fs::read_dir(&elsewhere).unwrap().count(), kept, "the target of the link was written to");
        std::fs::remove_file(run.join(name)).unwrap();
        std::fs::rename(&elsewhere, run.join(name)).unwrap();
    }
    std::fs::remove_file(run.join("lock")).unwrap_or_default();
    std::os::unix::fs::symlink(&thesis, run.join("lock")).unwrap();
    let message = failure(&mge(&["resume", &path, "--quiet"]));
    assert!(message.contains("lock: it is no regular file"), "{message}");
    std::fs::remove_file(run.join("lock")).unwrap();
    for file in ["events.jsonl", "metrics.csv", "episodes.jsonl"] {
        let kept = std::fs::read(run.join(file)).unwrap_or_default();
        std::fs::remove_file(run.join(file)).unwrap_or_default();
        assert!(Command::new("mkfifo").arg(run.join(file)).status().unwrap().success());
        let message = failure(&mge(&["resume", &path, "--quiet"]));
        assert!(message.contains(&format!("{file}: it is no regular file")), "{message}");
        if file == "events.jsonl" {
            let report = folder.path().join("report").display().to_string();
            let message = failure(&mge(&["report", &path, "--out", &report]));
            assert!(message.contains("it is no regular file"), "{message}");
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
fn runs_of_the_first_format_still_load() {
    let folder = tempfile::tempdir().unwrap();
    let run = first_version(folder.path());
    let path = run.display().to_string();
    let status = RunDirectory::open(&run).unwrap().status().unwrap();
    assert!(matches!(status.state, RunState::Stopped(_)), "{:?}", status.state);
    assert_eq!(status.last_episode.unwrap().episode, 6);
    let recorded = metrics(&run);

    let figures = folder.path().join("figures").display().to_string();
    for arguments in [&["evaluate", &path][..], &["figures", &path, "--out", &figures], &["resume", &path, "--quiet"]] {
        let output = mge(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    }
    assert_eq!(RunDirectory::open(&run).unwrap().status().unwrap().state, RunState::Finished);
    let resumed = metrics(&run);
    assert!(resumed.starts_with(&recorded), "recorded episodes have changed:\n{resumed}");
    assert_eq!(resumed.lines().count(), 1 + 12);
}

#[test]
fn a_newer_format_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let run = first_version(folder.path());
    let config = run.join("config.json");
    let newer = std::fs::read_to_string(&config).unwrap().replacen("\"format\": 1", "\"format\": 2", 1);
    std::fs::write(&config, newer).unwrap();
    let message = failure(&mge(&["resume", &run.display().to_string()]));
    assert!(message.contains("config.json has format 2, and this program reads formats 1 to 1"), "{message}");
}
