//! What goes wrong outside of the program: a full disk, a folder that cannot be written, a run
//! in use, a file of an older version. One clear line, and nothing lost.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mge::run::{RunDirectory, RunState};

const MGE: &str = env!("CARGO_BIN_EXE_mge");

/// Settings under which the log outgrows a checkpoint.
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

/// The one line with which it failed.
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
fn a_file_that_cannot_grow_stops_the_run_and_it_goes_on_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken] = ["whole", "broken"].map(|name| folder.path().join(name));
    let output = Command::new(MGE).args(train(&whole, "200")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));

    // Files of at most 64 blocks: like a full disk, but only for this process.
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

/// A copy of the run that the first version of the format left, stopped in the middle.
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
fn runs_of_the_first_format_keep_loading() {
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
    assert!(resumed.starts_with(&recorded), "what was recorded has changed:\n{resumed}");
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
